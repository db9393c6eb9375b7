# SPDX-License-Identifier: BSD-3-Clause
"""What a second of waiting counts."""

import pytest

from blackboard.costing.insertion import Aging
from blackboard.domain.task import Task, TaskType
from hive_common.pose import Pose


def posted(at):
    """Return a task that was posted at a time."""
    return Task("T1", TaskType.GA, (Pose(0.0, 0.0),), posted=at)


@pytest.mark.parametrize(("waited", "weight"), [(0.0, 1.0), (60.0, 2.0**0.5), (240.0, 4.0)])
def test_it_doubles_again_and_again(waited, weight):
    assert Aging(lambda: 1000.0, 120.0).weight(posted(1000.0 - waited)) == pytest.approx(weight)


def test_it_never_becomes_more_than_a_million_times():
    assert Aging(lambda: 1e9, 1.0).weight(posted(1.0)) == 2.0**20


def test_a_task_without_a_time_or_from_the_future_counts_as_new():
    aging = Aging(lambda: 1000.0, 120.0)

    assert aging.weight(posted(0.0)) == 1.0
    assert aging.weight(posted(2000.0)) == 1.0


def test_without_a_doubling_time_age_does_not_count():
    assert Aging().weight(posted(5.0)) == 1.0
