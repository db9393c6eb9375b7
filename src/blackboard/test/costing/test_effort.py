# SPDX-License-Identifier: BSD-3-Clause
"""What tasks take by what a robot has learned."""

import pytest

from blackboard.costing.cost import friction_force
from blackboard.costing.effort import Predictor, by_the_formula, charge_to_reach
from blackboard.costing.euclidean_lengths import EuclideanLengths
from blackboard.costing.experience import Experience, Learned
from blackboard.domain.battery import Battery
from blackboard.domain.task import StepKind, Task, TaskType
from hive_common.pose import Pose
from hive_lab.virtual.hive import SMALL_ROBOT

HERE, A, B = Pose(0.0, 0.0), Pose(6.0, 0.0), Pose(12.0, 0.0)
LEARNED = Learned(2.0, 1.5, 0.0, 1.4, 0.5, 2.0, 3.0, 0.0, 0.25, 30.0)
FORCE = friction_force(0.02, 50.0)


def predictor():
    return Predictor(SMALL_ROBOT, EuclideanLengths(), Experience(SMALL_ROBOT, LEARNED))


def test_a_drive_takes_what_friction_and_electronics_were_learned_to_draw():
    drive = predictor().drive(HERE, A, load=0.0)

    assert drive.duration == pytest.approx(2.0 + 6.0 * 1.5)
    assert drive.energy == pytest.approx(1.4 * FORCE * 6.0 + 0.5 * 20.0 * 11.0)


def test_the_arm_takes_the_time_and_draws_the_power_that_were_learned():
    pick, place = (predictor().arm_work(kind, HERE) for kind in (StepKind.PICK, StepKind.PLACE))

    assert (pick.duration, place.duration) == (10.0, 12.0)
    assert pick.energy == pytest.approx(0.5 * 120.0 * 10.0)


def test_the_charge_to_reach_a_charger_has_the_margin_on_top():
    battery, experience = Battery(SMALL_ROBOT.battery), Experience(SMALL_ROBOT, LEARNED)

    charge = charge_to_reach([B, A], HERE, SMALL_ROBOT, EuclideanLengths(), battery, experience)

    energy = predictor().drive(HERE, A, load=0.0).energy
    assert charge == pytest.approx(battery.charge_for(1.25 * energy))


@pytest.mark.parametrize("step", range(4))
def test_the_formula_says_the_same_from_lengths_alone(step):
    task = Task("T1", TaskType.GPAB, (A, B), payload=5.0)
    effort = Predictor(SMALL_ROBOT, EuclideanLengths()).effort(task, step, A if step else HERE)
    approach, rest = {0: (6.0, 6.0), 1: (0.0, 6.0), 2: (6.0, 0.0), 3: (0.0, 0.0)}[step]

    found = by_the_formula(SMALL_ROBOT, task, step, approach, rest)

    assert found == pytest.approx((effort.duration, effort.energy))
