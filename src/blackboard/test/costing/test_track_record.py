# SPDX-License-Identifier: BSD-3-Clause
"""Margins that nine of ten tasks keep."""

import pytest

from blackboard.costing.track_record import Outcome, TrackRecord


def late(seconds):
    """Return a task that was predicted to take 25 s and 100 J, and took more by one number."""
    return Outcome(0.0, 30.0, 25.0, 30.0, 25.0 + seconds, 110.0, 100.0, 120.0, 100.0 + seconds)


@pytest.mark.parametrize(
    ("tasks", "margin"),
    [(8, 99.0), (9, 9.0), (10, 9.9), (19, 18.0)],
)
def test_a_margin_lies_where_one_in_ten_exceeds_it_also_between_two_tasks(tasks, margin):
    record = TrackRecord([late(number) for number in range(1, tasks + 1)], settled=tasks)

    assert record.time_margin(99.0 / 5.0) == pytest.approx(margin / 5.0)
    assert record.energy_margin(0.99) == pytest.approx(margin / 100.0)


def test_tasks_that_take_less_than_predicted_need_no_margin():
    record = TrackRecord([late(-5.0)] * 20, settled=20)

    assert (record.time_margin(3.0), record.energy_margin(0.6)) == (0.0, 0.0)


def test_only_tasks_since_the_last_change_count():
    record = TrackRecord([late(10.0)] * 30, settled=30)

    record.unsettle()
    for _ in range(12):
        record.add(late(1.0))

    assert record.time_margin(3.0) == pytest.approx(1.0 / 5.0)
