# SPDX-License-Identifier: BSD-3-Clause
"""Tasks that an operator takes off the list."""

import pytest

from blackboard.domain.talker import (
    TASK_STATE,
)
from blackboard.domain.task import Task, TaskState, TaskType
from hive_common.pose import Pose
from hive_lab.virtual.harness import BlackboardRig

A, B = Pose(1.0, 1.0), Pose(3.0, 3.0)
GO = Task("T1", TaskType.GA, (A,), priority=3)
CARRY = Task("T2", TaskType.GPAB, (A, B), payload=2.0)
ROUND = Task("T3", TaskType.GAB, (A, B))
WAITING, ASSIGNED, STARTED, DONE, REJECTED, CANCELLED, FAILED = TaskState


def in_state(state):
    """Return a rig with a task in a state."""
    rig = BlackboardRig()
    if state is WAITING:
        rig.post(ROUND)
        return rig
    rig.assign(ROUND)
    if state in {STARTED, DONE, FAILED}:
        rig.report("robot1", ROUND, state)
    elif state is CANCELLED:
        rig.cancel("T3")
    return rig


@pytest.mark.parametrize("state", [WAITING, ASSIGNED, STARTED])
def test_an_open_task_can_be_cancelled_and_its_robot_is_told(state):
    rig = in_state(state)
    rig.cancel("T3")

    record = rig.record(ROUND)
    assert (record.state, record.reason) == (CANCELLED, "cancelled by an operator")
    assert rig.states(ROUND)[-1][0] is CANCELLED
    assert rig.orders(take_back=True) == ([] if state is WAITING else [("T3", "robot1")])


@pytest.mark.parametrize("state", [DONE, CANCELLED, FAILED])
def test_a_task_that_has_ended_stays_as_it_is_and_that_is_said(state):
    rig = in_state(state)
    said = len(rig.states(ROUND))
    rig.cancel("T3")

    assert rig.record(ROUND).state is state
    assert rig.states(ROUND)[said:] == [(state, "robot1")]


def test_a_cancelled_task_is_not_given_to_who_bids_on_it():
    rig = BlackboardRig()
    rig.post(GO, CARRY)
    rig.join("robot1")
    rig.cancel("T1")
    rig.bid("robot1", T1=1.0, T2=2.0)

    assert rig.orders() == [("T2", "robot1")]


def test_done_after_a_cancel_does_not_count():
    rig = in_state(CANCELLED)
    rig.report("robot1", ROUND, DONE)

    assert rig.record(ROUND).state is CANCELLED


def test_what_does_not_exist_cannot_be_cancelled():
    rig = BlackboardRig()
    rig.cancel("never there")

    (warning,) = rig.talker.warnings
    assert warning.startswith(
        "a message on task_cancel is refused: there is no task 'never there'"
    )
    assert warning.endswith("on the list; it may have ended long ago")
    assert not rig.said(TASK_STATE)
