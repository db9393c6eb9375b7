# SPDX-License-Identifier: BSD-3-Clause
"""How the blackboard forgets ended tasks."""

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
    """Return a harness that has forgotten a task done by robot1."""
    harness = BlackboardHarness(keep_ended=30.0, **settings)
    harness.assign(GO)
    harness.report("robot1", GO, DONE)
    for _ in range(35):
        harness.wait(1.0)
        harness.join("robot1")
    assert harness.record(GO) is None
    return harness


def test_an_ended_task_leaves_the_list_after_its_time():
    harness = BlackboardHarness(keep_ended=30.0)
    harness.post(GO)
    harness.cancel("T1")

    harness.wait(29.0)
    assert harness.record(GO).state is CANCELLED
    harness.wait(3.0)
    assert harness.record(GO) is None


def test_a_robot_that_reports_on_a_forgotten_task_is_told_to_stop_reporting():
    harness = forgotten()
    harness.report("robot1", GO, DONE)

    order = harness.said(TASK_ASSIGN)[-1]
    assert (order.robot_id, order.kind) == ("robot1", OrderKind.FORGOTTEN)
    assert (order.task.id, order.assignment) == ("T1", 1)
    assert harness.record(GO) is None


def test_a_robot_that_has_a_forgotten_task_on_its_list_is_told_to_drop_it():
    harness = forgotten()
    harness.status("robot1", tasks=["T1"])

    order = harness.said(TASK_ASSIGN)[-1]
    assert (order.kind, order.assignment) == (OrderKind.FORGOTTEN, 1)


def test_the_id_of_a_forgotten_task_may_be_used_for_another():
    harness = forgotten()
    harness.post(replace(GO, goals=(B,)))
    harness.bid("robot1", T1=1.0)

    assert harness.record(GO).task.goals == (B,)
    assert harness.said(TASK_ASSIGN)[-1].assignment == 2


def test_a_late_report_on_a_forgotten_task_does_not_count_for_another_with_its_id():
    harness = forgotten()
    harness.post(GO)
    harness.bid("robot1", T1=1.0)
    harness.report("robot1", GO, DONE, assignment=1)

    assert harness.record(GO).state is ASSIGNED
    assert harness.said(TASK_ASSIGN)[-1].kind is OrderKind.FORGOTTEN

    harness.report("robot1", GO, DONE, assignment=2)
    assert harness.record(GO).state is DONE


def test_cancelling_a_forgotten_task_is_refused_with_the_reason():
    harness = forgotten()
    harness.cancel("T1")

    assert harness.states(GO)[-1] == (DONE, "robot1")
    assert (
        "there is no task 'T1' on the list; it may have ended long ago"
        in harness.talker.warnings[-1]
    )
