# SPDX-License-Identifier: BSD-3-Clause
"""Tasks that an operator cancels."""

import pytest

from blackboard.domain.record import OrderKind
from blackboard.domain.talker import (
    TASK_STATE,
)
from blackboard.domain.task import Task, TaskState, TaskType
from hive_common.pose import Pose
from hive_lab.virtual.harness import BlackboardHarness

A, B = Pose(1.0, 1.0), Pose(3.0, 3.0)
GO = Task("T1", TaskType.GA, (A,), priority=3)
CARRY = Task("T2", TaskType.GPAB, (A, B), payload=2.0)
ROUND = Task("T3", TaskType.GAB, (A, B))
WAITING, ASSIGNED, STARTED, DONE, REJECTED, CANCELLED, FAILED = TaskState


def in_state(state):
    """Return a harness with a task in a state."""
    harness = BlackboardHarness()
    if state is WAITING:
        harness.post(ROUND)
        return harness
    harness.assign(ROUND)
    if state in {STARTED, DONE, FAILED}:
        harness.report("robot1", ROUND, state)
    elif state is CANCELLED:
        harness.cancel("T3")
    return harness


@pytest.mark.parametrize("state", [WAITING, ASSIGNED, STARTED])
def test_an_open_task_can_be_cancelled_and_its_robot_is_told(state):
    harness = in_state(state)
    harness.cancel("T3")

    record = harness.record(ROUND)
    assert (record.state, record.reason) == (CANCELLED, "cancelled by an operator")
    assert harness.states(ROUND)[-1][0] is CANCELLED
    assert harness.orders(OrderKind.TAKE_BACK) == ([] if state is WAITING else [("T3", "robot1")])


@pytest.mark.parametrize("state", [DONE, CANCELLED, FAILED])
def test_cancelling_an_ended_task_tells_its_state_again(state):
    harness = in_state(state)
    said = len(harness.states(ROUND))
    harness.cancel("T3")

    assert harness.record(ROUND).state is state
    assert harness.states(ROUND)[said:] == [(state, "robot1")]


def test_a_cancelled_task_is_not_awarded_to_a_later_bid():
    harness = BlackboardHarness()
    harness.post(GO, CARRY)
    harness.join("robot1")
    harness.cancel("T1")
    harness.bid("robot1", T1=1.0, T2=2.0)

    assert harness.orders() == [("T2", "robot1")]


def test_a_done_report_after_a_cancel_does_not_count():
    harness = in_state(CANCELLED)
    harness.report("robot1", ROUND, DONE)

    assert harness.record(ROUND).state is CANCELLED


def test_an_unknown_task_cannot_be_cancelled():
    harness = BlackboardHarness()
    harness.cancel("never there")

    (warning,) = harness.talker.warnings
    assert warning.startswith(
        "a message on task_cancel is refused: there is no task 'never there'"
    )
    assert warning.endswith("on the list; it may have ended long ago")
    assert not harness.said(TASK_STATE)
