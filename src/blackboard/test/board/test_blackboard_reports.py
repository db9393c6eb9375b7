# SPDX-License-Identifier: BSD-3-Clause
"""Orders of the blackboard and reports of robots, which may be lost or late."""

import pytest

from blackboard.domain.bid import MAX_COST
from blackboard.domain.record import OrderKind
from blackboard.domain.talker import (
    SYNC,
    TASK_ASSIGN,
    TASK_BROADCAST,
)
from blackboard.domain.task import Task, TaskState, TaskType
from hive_common.pose import Pose
from hive_lab.virtual.harness import BlackboardHarness

A, B = Pose(1.0, 1.0), Pose(3.0, 3.0)
GO = Task("T1", TaskType.GA, (A,), priority=3)
CARRY = Task("T2", TaskType.GPAB, (A, B), payload=2.0)
ROUND = Task("T3", TaskType.GAB, (A, B))
WAITING, ASSIGNED, STARTED, DONE, REJECTED, CANCELLED, FAILED = TaskState


def test_a_lost_order_is_repeated():
    harness = BlackboardHarness(order_timeout=2.0)
    harness.assign(GO)
    harness.wait(1.0)
    harness.status("robot1")
    harness.wait(1.1)
    harness.status("robot1")

    assert harness.orders() == [("T1", "robot1"), ("T1", "robot1")]


def test_an_order_that_the_robot_s_status_shows_is_not_repeated():
    harness = BlackboardHarness(order_timeout=2.0)
    harness.assign(GO)
    for _ in range(5):
        harness.wait(1.0)
        harness.status("robot1", tasks=["T1"])

    assert harness.orders() == [("T1", "robot1")]


def test_a_done_task_is_not_ordered_again():
    harness = BlackboardHarness(order_timeout=2.0)
    harness.assign(GO)
    harness.report("robot1", GO, DONE)
    harness.wait(3.0)
    harness.status("robot1")

    assert harness.orders() == [("T1", "robot1")]


def test_a_robot_s_report_changes_the_list_and_is_not_told_again():
    harness = BlackboardHarness()
    harness.assign(CARRY)
    harness.report("robot1", CARRY, STARTED, step=1, eta=33.0)
    record = harness.record(CARRY)

    assert (record.state, record.robot, record.step, record.eta) == (STARTED, "robot1", 1, 33.0)
    assert harness.states(CARRY) == [(WAITING, ""), (ASSIGNED, "robot1"), (STARTED, "robot1")]


def test_a_late_report_does_not_undo_a_step():
    harness = BlackboardHarness()
    harness.assign(CARRY)
    harness.report("robot1", CARRY, STARTED, step=2)
    harness.report("robot1", CARRY, STARTED, step=1)

    assert harness.record(CARRY).step == 2


def test_done_is_done():
    harness = BlackboardHarness()
    harness.assign(GO)
    harness.report("robot1", GO, DONE, step=1)

    assert harness.record(GO).state is DONE


@pytest.mark.parametrize("state", [WAITING, STARTED, FAILED])
def test_a_report_of_another_robot_changes_nothing(state):
    harness = BlackboardHarness()
    harness.assign(GO)
    harness.report("robot2", GO, state)

    assert harness.record(GO).state is ASSIGNED


@pytest.mark.parametrize("state", [WAITING, STARTED, FAILED])
def test_a_report_on_an_earlier_assignment_changes_nothing(state):
    harness = BlackboardHarness()
    harness.assign(GO)
    harness.report("robot1", GO, WAITING)
    harness.bid("robot1", T1=1.0)
    harness.report("robot1", GO, state, assignment=1)

    assert (harness.record(GO).state, harness.record(GO).assignment) == (ASSIGNED, 2)


@pytest.mark.parametrize("state", [REJECTED, CANCELLED, ASSIGNED])
def test_a_state_that_robots_do_not_report_changes_nothing(state):
    harness = BlackboardHarness()
    harness.assign(GO)
    harness.report("robot1", GO, STARTED)
    harness.report("robot1", GO, state)

    assert harness.record(GO).state is STARTED


def test_a_report_on_an_unknown_task_adds_no_task():
    harness = BlackboardHarness()
    harness.report("robot1", GO, DONE)

    assert harness.record(GO) is None


def test_a_done_report_of_a_robot_that_lost_the_task_counts_and_the_other_robot_is_stopped():
    harness = BlackboardHarness()
    harness.assign(GO)
    harness.report("robot1", GO, WAITING)
    harness.join("robot2")
    harness.bid("robot1", T1=MAX_COST)
    harness.bid("robot2", T1=1.0)
    harness.bid("robot1", T1=MAX_COST)
    harness.bid("robot2", T1=1.0)

    harness.report("robot1", GO, DONE, assignment=1)

    assert (harness.record(GO).state, harness.record(GO).robot) == (DONE, "robot1")
    assert harness.orders(OrderKind.TAKE_BACK) == [("T1", "robot2")]


def test_a_task_that_is_handed_back_is_auctioned_again_at_once():
    harness = BlackboardHarness()
    harness.assign(GO)
    harness.report("robot1", GO, WAITING, reason="robot1: aborted: no way")

    record = harness.record(GO)
    assert (record.state, record.robot, record.tried) == (WAITING, "", ("robot1",))
    assert record.reason == "robot1: aborted: no way"
    assert len(harness.said(TASK_BROADCAST)) == 2


def test_the_next_robot_goes_on_where_a_round_was_left_and_begins_a_pick_anew():
    harness = BlackboardHarness()
    for task in (ROUND, CARRY):
        harness.assign(task)
        harness.report("robot1", task, WAITING, step=1)
        harness.bid("robot1", **{task.id: 1.0})

    steps = {
        order.task.id: order.step for order in harness.said(TASK_ASSIGN) if order.assignment == 2
    }
    assert steps == {"T3": 1, "T2": 0}


def test_a_step_beyond_the_last_counts_as_the_last():
    harness = BlackboardHarness()
    harness.assign(ROUND)
    harness.report("robot1", ROUND, WAITING, step=200)
    harness.bid("robot1", T3=1.0)

    assert harness.said(TASK_ASSIGN)[-1].step == 2


def test_a_task_that_robots_keep_handing_back_fails():
    harness = BlackboardHarness(most_hand_backs=3)
    harness.assign(GO)
    for assignment in (1, 2, 3):
        harness.report("robot1", GO, WAITING, assignment, reason="robot1: aborted: stuck")
        if assignment < 3:
            harness.bid("robot1", T1=1.0)

    record = harness.record(GO)
    assert record.state is FAILED
    assert record.reason == "given up after 3 tries, the last: robot1: aborted: stuck"
    assert harness.states(GO)[-1] == (FAILED, "robot1")


def test_a_task_whose_load_is_on_board_stays_failed():
    harness = BlackboardHarness()
    harness.assign(CARRY)
    harness.report("robot1", CARRY, FAILED, step=2, reason="its load is on board")

    assert harness.record(CARRY).state is FAILED
    assert harness.record(CARRY).reason == "its load is on board"
    assert len(harness.said(TASK_BROADCAST)) == 1


def test_a_repeated_report_is_answered_with_the_list_again():
    harness = BlackboardHarness()
    harness.assign(GO)
    harness.report("robot1", GO, DONE)
    harness.wait(1.0)
    before = len(harness.said(SYNC))
    harness.report("robot1", GO, DONE)
    harness.wait(1.0)

    assert len(harness.said(SYNC)) == before + 1
    assert harness.said(SYNC)[-1].version == harness.said(SYNC)[-2].version


def test_a_task_says_when_it_was_first_begun_and_when_it_ended():
    harness = BlackboardHarness()
    harness.assign(GO)
    harness.wait(5.0)
    harness.report("robot1", GO, STARTED)
    begun = harness.talker.date()
    harness.wait(7.0)
    harness.status("robot1", tasks=("T1",))
    harness.report("robot1", GO, STARTED, step=1)
    harness.report("robot1", GO, DONE, step=1)

    record = harness.record(GO)
    assert record.started == pytest.approx(begun, abs=0.5)
    assert record.ended == pytest.approx(begun + 7.0, abs=0.5)
