# SPDX-License-Identifier: BSD-3-Clause
"""The hall in which robots learn."""

import pytest

pytest.importorskip("ompl")

from blackboard.domain.task import TaskState
from hive_lab.fleets.learning_hall import WEAR, WORN, LearningHall
from hive_lab.fleets.sites import LANE

SEED = 16  # the first two tasks are drives nearby, which a robot without an arm can do


def run_of_two():
    """Return the ends of two tasks, and whether the wheels were worn and the lane closed."""
    hall, ends = LearningHall(robots=1, seed=SEED), {}

    def note(update):
        if update.state is TaskState.DONE:
            worn = hall.fleet.true_batteries[WORN].friction == WEAR
            closed = hall.bodies.coordinator.roadmap.closed == {LANE}
            at = hall.fleet.network.now
            ends.setdefault(update.task_id, (at, update.robot_id, worn, closed))

    assert hall.run(2, note, limit=120.0, changes=True)
    return list(ends.values()), hall.fleet.true_batteries[WORN].level


def test_the_hall_changes_when_half_of_the_tasks_have_ended_and_a_seed_gives_the_same_again():
    first, again = run_of_two(), run_of_two()

    assert [(worn, closed) for _, _, worn, closed in first[0]] == [(False, False), (True, True)]
    assert first == again


def test_a_run_that_takes_too_long_ends():
    hall = LearningHall(robots=1, seed=SEED)

    assert not hall.run(2, lambda _: None, limit=5.0)
    assert hall.fleet.network.now < 10.0
