# SPDX-License-Identifier: BSD-3-Clause
"""Robots that fall silent."""

from blackboard.domain.characteristics import RobotState
from blackboard.domain.talker import (
    ROBOT_STATUS,
)
from blackboard.domain.task import Task, TaskState, TaskType
from hive_common.pose import Pose
from hive_lab.virtual.harness import BlackboardRig

A = Pose(1.0, 1.0)
GO = Task("T1", TaskType.GA, (A,), priority=3)
WAITING, ASSIGNED, STARTED, DONE, REJECTED, CANCELLED, FAILED = TaskState


def test_a_robot_that_falls_silent_is_said_to_be_offline_and_its_tasks_wait_for_another():
    rig = BlackboardRig(reassign=5.0)
    rig.assign(GO)
    rig.wait(6.1)

    status = rig.said(ROBOT_STATUS)[-1]
    assert (status.robot_id, status.state) == ("robot1", RobotState.OFFLINE)
    assert (rig.record(GO).state, rig.record(GO).robot) == (WAITING, "")


def test_a_robot_that_is_back_without_its_task_is_given_it_again():
    rig = BlackboardRig(reassign=5.0, order_timeout=2.0)
    rig.assign(GO)
    rig.wait(4.0)
    rig.status("robot1")

    assert rig.orders() == [("T1", "robot1"), ("T1", "robot1")]


def test_a_robot_that_is_offline_is_not_waited_for():
    rig = BlackboardRig(reassign=5.0)
    rig.join("robot1", "gone")
    for _ in range(7):
        rig.wait(1.0)
        rig.status("robot1")
    rig.post(GO)
    rig.bid("robot1", T1=1.0)

    assert rig.orders() == [("T1", "robot1")]
