# SPDX-License-Identifier: BSD-3-Clause
"""How tasks that have not begun change hands, with the test in the robots' place."""

import pytest

from blackboard.auction.plan_maker import MOMENT
from blackboard.domain.record import MOVES_ON, OrderKind
from blackboard.domain.talker import TASK_BROADCAST
from blackboard.domain.task import Task, TaskState, TaskType
from hive_common.pose import Pose
from hive_lab.virtual.harness import BlackboardHarness

SOUTH, MIDDLE, NORTH = Pose(1.0, 0.5), Pose(1.0, 2.0), Pose(1.0, 3.5)
ONE = Task("T1", TaskType.GA, (SOUTH,))
TWO = Task("T2", TaskType.GA, (NORTH,))
NEW = Task("T3", TaskType.GA, (MIDDLE,))
WAITING, ASSIGNED, STARTED, *_ = TaskState


@pytest.fixture
def offering():
    """Return a harness whose robots have a task each, and are asked for a better plan.

    Each has got the task where it was, and is where the other one's task is now.
    """
    harness = BlackboardHarness(decision="planned", improve_period=2.0, order_timeout=2.0)
    harness.join("robot1", "robot2")
    harness.post(ONE)
    harness.tell("robot1", SOUTH)
    harness.tell("robot2", NORTH)
    harness.wait(2 * MOMENT)
    harness.post(TWO)
    harness.tell("robot1", SOUTH, "T1")
    harness.tell("robot2", NORTH)
    harness.wait(2.0)
    return harness


@pytest.fixture
def harness(offering):
    """Return a harness whose two robots have been told to swap their tasks."""
    offering.tell("robot1", NORTH, "T1")
    offering.tell("robot2", SOUTH, "T2")
    offering.wait(2 * MOMENT)
    return offering


def given(harness):
    """Return the orders after the first two."""
    return harness.orders()[2:]


def test_tasks_that_change_hands_are_recalled(harness):
    assert harness.orders() == [("T1", "robot1"), ("T2", "robot2")]
    assert harness.orders(OrderKind.HAND_BACK_UNBEGUN) == [("T2", "robot2"), ("T1", "robot1")]


def test_a_swap_is_awarded_without_an_auction_once_both_tasks_are_back(harness):
    harness.report("robot1", ONE, WAITING)
    one_half = given(harness)
    assert harness.record(ONE).reason == f"robot1 has handed it back: {MOVES_ON}"
    asked = len(harness.said(TASK_BROADCAST))
    harness.report("robot2", TWO, WAITING)

    assert one_half == []
    assert given(harness) == [("T2", "robot1"), ("T1", "robot2")]
    assert len(harness.said(TASK_BROADCAST)) == asked
    assert harness.record(ONE).assignment == harness.record(TWO).assignment == 2
    assert harness.record(ONE).tried == ()
    reason = "exchanged: T2 from robot2 to robot1, T1 from robot1 to robot2"
    assert [(each.task_id, each.winner, each.reason) for each in harness.decisions[2:]] == [
        ("T2", "robot1", reason),
        ("T1", "robot2", reason),
    ]
    assert [bid.robot_id for bid in harness.decisions[-1].bids] == ["robot1", "robot2"]


def test_one_half_of_a_swap_is_given_out_anew_if_the_other_has_begun(harness):
    harness.report("robot1", ONE, WAITING)
    harness.report("robot2", TWO, STARTED)
    harness.wait(2.0)
    harness.tell("robot1", NORTH)
    harness.tell("robot2", SOUTH, "T2")
    harness.wait(2 * MOMENT)

    assert [task_id for task_id, _ in given(harness)] == ["T1"]
    assert harness.record(TWO).robot == "robot2"


def test_one_half_of_a_swap_is_given_out_anew_after_a_while_if_the_other_order_was_lost(harness):
    harness.report("robot1", ONE, WAITING)
    asked = len(harness.said(TASK_BROADCAST))
    harness.wait(1.5)
    kept = given(harness)
    asked_then = len(harness.said(TASK_BROADCAST))
    harness.wait(0.6)

    assert kept == []
    assert asked_then == asked
    assert len(harness.said(TASK_BROADCAST)) == asked + 1


def test_a_new_task_does_not_wait_for_a_swap(harness):
    harness.report("robot1", ONE, WAITING)
    harness.post(NEW)
    harness.tell("robot1", NORTH)
    harness.tell("robot2", SOUTH, "T2")
    harness.wait(2 * MOMENT)

    assert "T3" in dict(given(harness))


def test_one_half_of_a_swap_is_given_out_anew_if_the_other_is_cancelled(harness):
    harness.report("robot1", ONE, WAITING)
    asked = len(harness.said(TASK_BROADCAST))
    harness.cancel("T2")
    harness.wait(2.0)

    assert len(harness.said(TASK_BROADCAST)) > asked


def test_a_new_task_does_not_wait_for_an_improvement(offering):
    asked = offering.said(TASK_BROADCAST)[-1].auction

    offering.post(NEW)

    assert offering.said(TASK_BROADCAST)[-1].auction > asked


def test_late_answers_to_a_dropped_improvement_are_ignored_without_a_refusal(offering):
    dropped = offering.said(TASK_BROADCAST)[-1].auction
    offering.post(NEW)
    offering.tell("robot1", NORTH, "T1", auction=dropped)
    offering.tell("robot2", SOUTH, "T2", auction=dropped)

    assert offering.orders() == [("T1", "robot1"), ("T2", "robot2")]
    assert offering.talker.warnings == []
