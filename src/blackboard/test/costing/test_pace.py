# SPDX-License-Identifier: BSD-3-Clause
"""A robot learns how long its drives take."""

import math
import random

import pytest

from blackboard.costing.pace import MEAN_SPEED_SHARE, Pace
from blackboard.domain.task import Task, TaskType
from blackboard.errors import CharacteristicsError
from hive_common.pose import Pose
from hive_lab.virtual.hive import Hive

HERE = Pose(0.0, 0.0, 0.0)


def drives(number, seed=1):
    """Return drives from here: a goal, its length, and the turning [rad]."""
    chance = random.Random(seed)
    for _ in range(number):
        bearing, distance = chance.uniform(-3.0, 3.0), chance.uniform(1.0, 15.0)
        goal = Pose(distance * math.cos(bearing), distance * math.sin(bearing), bearing)
        yield goal, 1.1 * distance, abs(bearing)


def real(distance, turn):
    return 2.0 + 1.4 * distance + 0.6 * turn


def test_before_its_first_drive_a_robot_uses_the_rule_of_thumb():
    pace = Pace(max_speed=1.5)

    assert pace.duration(HERE, Pose(9.0, 0.0), 9.0) == pytest.approx(9.0 / 1.5 / MEAN_SPEED_SHARE)


def test_after_ten_drives_it_knows_what_a_drive_takes():
    pace = Pace(max_speed=1.5)
    for goal, distance, turn in drives(10):
        pace.learn(HERE, goal, distance, real(distance, turn))

    for goal, distance, turn in drives(20, seed=2):
        assert pace.duration(HERE, goal, distance) == pytest.approx(real(distance, turn), rel=0.03)


def test_a_drive_that_was_delayed_for_minutes_hardly_counts():
    pace = Pace(max_speed=1.5)
    for goal, distance, turn in drives(20):
        pace.learn(HERE, goal, distance, real(distance, turn))
    goal = Pose(8.0, 0.0)
    before = pace.duration(HERE, goal, 8.0)

    pace.learn(HERE, goal, 8.0, before + 300.0)

    assert pace.duration(HERE, goal, 8.0) == pytest.approx(before, rel=0.05)


def test_no_drive_is_thought_to_be_faster_than_the_robot():
    pace = Pace(max_speed=1.5)
    for goal, distance, _ in drives(20):
        pace.learn(HERE, goal, distance, 0.01)

    assert pace.duration(HERE, Pose(3.0, 0.0), 3.0) == pytest.approx(2.0)


def test_no_drive_takes_no_time_and_one_without_a_path_takes_forever():
    pace = Pace(max_speed=1.5)
    for goal, distance, turn in drives(10):
        pace.learn(HERE, goal, distance, real(distance, turn))
    before = pace.duration(HERE, Pose(3.0, 0.0), 3.0)
    pace.learn(HERE, Pose(3.0, 0.0), math.inf, 10.0)
    pace.learn(HERE, Pose(0.1, 0.0), 0.1, 10.0)

    assert pace.duration(HERE, HERE, 0.0) == 0.0
    assert pace.duration(HERE, Pose(3.0, 0.0), math.inf) == math.inf
    assert pace.duration(HERE, Pose(3.0, 0.0), 3.0) == before


def test_what_was_learned_can_be_handed_on():
    pace = Pace(max_speed=1.5)
    for goal, distance, turn in drives(5):
        pace.learn(HERE, goal, distance, real(distance, turn))
    goal = Pose(4.0, 2.0, 1.0)

    assert Pace(1.5, pace.times).duration(HERE, goal, 5.0) == pace.duration(HERE, goal, 5.0)
    with pytest.raises(CharacteristicsError, match=r"pace is \(1.0,\); allowed: three times"):
        Pace(1.5, (1.0,))


def test_a_robot_of_a_hive_predicts_better_once_it_has_driven():
    """Its steps take 10 s each, however far they lead."""
    hive = Hive()
    hive.add_robot("robot1", HERE)
    errors = []
    for number in range(12):
        goal = Pose(5.0 * (-1) ** number, 1.0)
        hive.post(Task(f"T{number}", TaskType.GA, (goal,)))
        hive.network.run(20.0)
        started = next(u for u in hive.updates(f"T{number}") if u.eta)
        errors.append(abs(started.eta - 10.0))

    assert errors[1] > 3.0
    assert errors[-1] < 1.0


def test_a_drive_that_was_stopped_half_way_is_not_learned_from():
    hive = Hive()
    hive.add_robot("robot1", HERE)
    hive.commands["robot1"].duration = lambda _: 1000.0
    hive.post(Task("T1", TaskType.GA, (Pose(5.0, 0.0),)))
    hive.network.run(5.0)
    hive.cancel("T1")
    hive.network.run(5.0)
    hive.post(Task("T2", TaskType.GA, (Pose(5.0, 0.0),)))
    hive.network.run(5.0)

    started = next(u for u in hive.updates("T2") if u.eta)
    assert started.eta == pytest.approx(5.0 / MEAN_SPEED_SHARE)
