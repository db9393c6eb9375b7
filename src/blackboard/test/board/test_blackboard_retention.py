# SPDX-License-Identifier: BSD-3-Clause
"""What has ended is forgotten in the end."""

from dataclasses import replace

from blackboard.domain.record import OrderKind
from blackboard.domain.talker import (
    TASK_ASSIGN,
)
from blackboard.domain.task import Task, TaskState, TaskType
from hive_common.pose import Pose
from hive_lab.virtual.harness import BlackboardHarness

A, B = Pose(1.0, 1.0), Pose(3.0, 3.0)
GO = Task("T1", TaskType.GA, (A,), priority=3)
WAITING, ASSIGNED, STARTED, DONE, REJECTED, CANCELLED, FAILED = TaskState


def forgotten(**settings):
    """Return a rig that has forgotten a task which robot1 has done."""
    harness = BlackboardHarness(keep_ended=30.0, **settings)
    harness.assign(GO)
    harness.report("robot1", GO, DONE)
    for _ in range(35):
        harness.wait(1.0)
        harness.join("robot1")
    assert harness.record(GO) is None
    return harness


def test_a_task_that_has_ended_leaves_the_list_after_its_time():
    harness = BlackboardHarness(keep_ended=30.0)
    harness.post(GO)
    harness.cancel("T1")

    harness.wait(29.0)
    assert harness.record(GO).state is CANCELLED
    harness.wait(3.0)
    assert harness.record(GO) is None


def test_a_robot_that_reports_on_a_forgotten_task_is_told_to_report_no_more():
    harness = forgotten()
    harness.report("robot1", GO, DONE)

    order = harness.said(TASK_ASSIGN)[-1]
    assert (order.robot_id, order.kind) == ("robot1", OrderKind.FORGOTTEN)
    assert (order.task.id, order.assignment) == ("T1", 1)
    assert harness.record(GO) is None


def test_a_robot_that_has_a_forgotten_task_on_its_list_is_told_to_drop_it():
    harness = forgotten()
    harness.status("robot1", tasks=["T1"])

    assert harness.said(TASK_ASSIGN)[-1].kind is OrderKind.FORGOTTEN


def test_an_id_that_is_forgotten_may_be_used_again_for_another_task():
    harness = forgotten()
    harness.post(replace(GO, goals=(B,)))
    harness.bid("robot1", T1=1.0)

    assert harness.record(GO).task.goals == (B,)
    assert harness.said(TASK_ASSIGN)[-1].assignment == 2


def test_a_late_report_on_a_forgotten_task_says_nothing_of_another_one_of_its_id():
    harness = forgotten()
    harness.post(GO)
    harness.bid("robot1", T1=1.0)
    harness.report("robot1", GO, DONE, assignment=1)

    assert harness.record(GO).state is ASSIGNED
    assert harness.said(TASK_ASSIGN)[-1].kind is OrderKind.FORGOTTEN

    harness.report("robot1", GO, DONE, assignment=2)
    assert harness.record(GO).state is DONE


def test_a_forgotten_task_cannot_be_cancelled_and_the_reason_is_said():
    harness = forgotten()
    harness.cancel("T1")

    assert harness.states(GO)[-1] == (DONE, "robot1")
    assert (
        "there is no task 'T1' on the list; it may have ended long ago"
        in harness.talker.warnings[-1]
    )
