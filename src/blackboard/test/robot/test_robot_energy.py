# SPDX-License-Identifier: BSD-3-Clause
"""What a robot takes from its battery."""

from dataclasses import replace

import pytest

from blackboard.domain.task import Task, TaskState, TaskType
from hive_common.pose import Pose
from hive_lab.virtual.harness import STEP, RobotHarness
from hive_lab.virtual.hive import SMALL_ROBOT

A, B = Pose(6.0, 0.0), Pose(12.0, 0.0)
CARRY = Task("T2", TaskType.GPAB, (A, B), payload=5.0)
ROUND = Task("T3", TaskType.GAB, (A, B), payload=5.0)
WAITING, STARTED, DONE, FAILED = (
    TaskState.WAITING,
    TaskState.STARTED,
    TaskState.DONE,
    TaskState.FAILED,
)


def test_driving_with_a_load_takes_more_than_without():
    def taken(harness):
        before = harness.battery.charge_left
        harness.robot.add_travel(1000.0)
        return before - harness.battery.charge_left

    empty, loaded = RobotHarness(), RobotHarness()
    loaded.order(ROUND)

    # 55 kg over 50 kg.
    assert taken(loaded) == pytest.approx(1.1 * taken(empty), rel=1e-3)


def test_the_arm_draws_its_power_while_it_works():
    harness = RobotHarness()
    harness.order(replace(CARRY, payload=0.0))
    harness.wait(4 * STEP)

    # 100 W for 5 s and 4 s, and 20 W all the time, at about 28 V.
    energy = 100.0 * 9.0 + 20.0 * 40.0
    used = (1.0 - harness.battery.level) * SMALL_ROBOT.battery.capacity
    assert used == pytest.approx(energy / (3600.0 * 28.0), rel=2e-3)


def test_a_parked_robot_draws_its_idle_power():
    harness = RobotHarness()
    harness.wait(100.0)

    used = (1.0 - harness.status.charge) * SMALL_ROBOT.battery.capacity
    assert used == pytest.approx(20.0 * 100.0 / (3600.0 * 28.0), rel=2e-3)
