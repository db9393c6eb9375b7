# SPDX-License-Identifier: BSD-3-Clause
"""What a robot predicts of its steps, by the formula or by what it has learned."""

import math

import numpy as np
import pytest

from blackboard.costing.experience import (
    ENDS,
    LEAST,
    MEAN_SPEED_SHARE,
    MOST,
    TIME_MARGIN,
    Experience,
    Learned,
    by_formula,
    turnings,
)
from blackboard.domain.task import StepKind
from blackboard.errors import CharacteristicsError
from hive_common.pose import Pose
from hive_lab.virtual.hive import SMALL_ROBOT

HERE = Pose(0.0, 0.0, 0.0)
LEARNED = Learned(2.0, 1.4, 0.6, 1.5, 0.8, 1.2, 0.9, 0.5, 0.1, 30.0)


def test_before_its_first_drive_a_robot_predicts_by_the_formula():
    experience = Experience(SMALL_ROBOT)

    assert experience.is_formula
    assert experience.duration(HERE, Pose(9.0, 0.0), 9.0) == pytest.approx(9.0 / MEAN_SPEED_SHARE)
    assert experience.arm_time(StepKind.PICK) == SMALL_ROBOT.pick_duration


def test_it_predicts_by_what_it_has_learned_of_drives_arm_and_margins():
    experience = Experience(SMALL_ROBOT, LEARNED)

    there = Pose(0.0, 9.0, 0.0)  # it turns by a quarter at both ends
    assert experience.duration(HERE, there, 10.0) == pytest.approx(2.0 + 14.0 + 0.6 * math.pi)
    assert experience.arm_time(StepKind.PICK) == pytest.approx(1.2 * SMALL_ROBOT.pick_duration)
    assert experience.arm_time(StepKind.PLACE) == pytest.approx(0.9 * SMALL_ROBOT.place_duration)
    assert experience.most_time(25.0) == pytest.approx(25.0 + 0.5 * 5.0)
    assert experience.most_energy(100.0) == pytest.approx(110.0)


@pytest.mark.parametrize("learned", [LEARNED, by_formula(1.0), LEARNED._replace(per_metre=50.0)])
def test_many_drives_are_predicted_as_each_alone(learned):
    experience = Experience(SMALL_ROBOT, learned)
    goals = [Pose(3.0, 1.0, 2.0), Pose(-4.0, 0.0, -1.0), HERE, Pose(20.0, 5.0, 0.0)]
    distances = np.array([[3.5, 4.0, 0.0, math.inf]])

    together = experience.durations(distances, turnings([HERE], goals))

    alone = [experience.duration(HERE, *each) for each in zip(goals, distances[0], strict=True)]
    assert together[0].tolist() == pytest.approx(alone)


@pytest.mark.parametrize(
    ("per_metre", "duration"),
    [(0.0, 3.0), (-9.0, 3.0), (1e6, MOST * 3.0 / MEAN_SPEED_SHARE + ENDS)],
)
def test_no_drive_is_thought_faster_than_the_robot_or_much_slower_than_the_formula(
    per_metre, duration
):
    experience = Experience(SMALL_ROBOT, LEARNED._replace(per_drive=0.0, per_metre=per_metre))

    assert experience.duration(HERE, Pose(3.0, 0.0), 3.0) == pytest.approx(duration)
    assert experience.is_clipped(HERE, Pose(3.0, 0.0), 3.0)
    assert not Experience(SMALL_ROBOT, LEARNED).is_clipped(HERE, Pose(3.0, 0.0), 3.0)


@pytest.mark.parametrize(("told", "used"), [(0.0, LEAST), (1.5, 1.5), (1e9, MOST)])
def test_no_share_is_far_from_the_formula(told, used):
    experience = Experience(SMALL_ROBOT, LEARNED._replace(friction=told, power=told, pick=told))

    learned = experience.learned
    assert (learned.friction, learned.power, learned.pick) == (used, used, used)


def test_margins_and_drives_have_limits():
    odd = LEARNED._replace(time_margin=1e12, energy_margin=-1.0, drives=1e12)

    learned = Experience(SMALL_ROBOT, odd).learned

    assert (learned.time_margin, learned.energy_margin) == (10.0 * TIME_MARGIN, 0.0)
    assert learned.drives == 1e6


def test_what_takes_no_time_and_what_takes_forever_stay_so():
    experience = Experience(SMALL_ROBOT, LEARNED)

    assert experience.duration(HERE, HERE, 0.0) == 0.0
    assert experience.duration(HERE, Pose(3.0, 0.0), math.inf) == math.inf


def test_an_older_robot_tells_the_times_of_its_drives_only():
    experience = Experience(SMALL_ROBOT, (2.0, 1.4, 0.6))

    assert experience.learned == by_formula(1.0)._replace(
        per_drive=2.0, per_metre=1.4, per_radian=0.6
    )


def test_a_wrong_number_of_numbers_is_refused():
    with pytest.raises(CharacteristicsError, match=r"pace is \(1.0,\); allowed: 3 or 10 numbers"):
        Experience(SMALL_ROBOT, (1.0,))
