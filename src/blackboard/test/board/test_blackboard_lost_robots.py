# SPDX-License-Identifier: BSD-3-Clause
"""Robots that fall silent."""

from blackboard.domain.characteristics import RobotState
from blackboard.domain.talker import BACKUP, ROBOT_STATUS
from blackboard.domain.task import Task, TaskState, TaskType
from hive_common.last_heard import FORGOTTEN_AFTER
from hive_common.pose import Pose
from hive_lab.virtual.harness import BlackboardHarness

A = Pose(1.0, 1.0)
GO = Task("T1", TaskType.GA, (A,), priority=3)
WAITING, ASSIGNED, STARTED, DONE, REJECTED, CANCELLED, FAILED = TaskState


def test_a_silent_robot_is_told_to_be_offline_and_its_tasks_wait_for_another():
    harness = BlackboardHarness(reassign=5.0)
    harness.assign(GO)
    harness.wait(6.1)

    status = harness.said(ROBOT_STATUS)[-1]
    assert (status.robot_id, status.state) == ("robot1", RobotState.OFFLINE)
    assert (harness.record(GO).state, harness.record(GO).robot) == (WAITING, "")


def test_a_silent_robot_is_told_to_be_offline_again_and_again_with_the_tasks_it_has_left():
    harness = BlackboardHarness(reassign=5.0, on_robot_lost="wait")
    harness.assign(GO)
    harness.report("robot1", GO, STARTED)
    harness.status("robot1", RobotState.BUSY, tasks=("T1", "T2"))
    harness.wait(9.0)

    told = [each for each in harness.said(ROBOT_STATUS) if each.state is RobotState.OFFLINE]
    assert len(told) >= 3
    assert (told[-1].task_id, told[-1].tasks) == ("T1", ("T1",))
    assert harness.said(BACKUP)[-1].offline == ("robot1",)

    harness.cancel("T1")
    harness.wait(2.0)
    assert (harness.said(ROBOT_STATUS)[-1].task_id, harness.said(ROBOT_STATUS)[-1].tasks) == (
        "",
        (),
    )


def test_a_robot_that_is_heard_again_is_no_longer_named_as_offline():
    harness = BlackboardHarness(reassign=5.0)
    harness.join("robot1")
    harness.wait(7.0)
    assert harness.said(BACKUP)[-1].offline == ("robot1",)

    harness.join("robot1")
    harness.wait(2.0)
    assert harness.said(BACKUP)[-1].offline == ()


def test_a_robot_that_comes_back_without_its_task_is_ordered_again():
    harness = BlackboardHarness(reassign=5.0, order_timeout=2.0)
    harness.assign(GO)
    harness.wait(4.0)
    harness.status("robot1")

    assert harness.orders() == [("T1", "robot1"), ("T1", "robot1")]


def test_a_robot_that_is_offline_is_not_waited_for():
    harness = BlackboardHarness(reassign=5.0)
    harness.join("robot1", "gone")
    for _ in range(7):
        harness.wait(1.0)
        harness.status("robot1")
    harness.post(GO)
    harness.bid("robot1", T1=1.0)

    assert harness.orders() == [("T1", "robot1")]


def test_a_robot_that_does_not_drop_what_is_not_its_own_is_asked_for_no_bids():
    harness = BlackboardHarness(reassign=5.0)
    harness.join("robot1")
    for _ in range(7):
        harness.wait(1.0)
        harness.status("robot1")
        harness.status("robot2", tasks=("stray",))
    harness.post(GO)
    harness.bid("robot2", T1=1.0)
    harness.bid("robot1", T1=2.0)

    assert harness.orders() == [("T1", "robot1")]


def test_a_robot_that_has_left_is_forgotten_by_the_blackboard():
    harness = BlackboardHarness(reassign=5.0)
    harness.join("gone")
    for _ in range(round(FORGOTTEN_AFTER / 60.0) + 2):
        harness.wait(60.0)
        harness.status("robot1")
    harness.post(GO)
    harness.report("gone", GO, DONE)

    said = "a message on task_state is refused: no robot 'gone' has been heard"
    assert harness.talker.warnings == [said]
