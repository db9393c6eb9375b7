# SPDX-License-Identifier: BSD-3-Clause
"""How the blackboard auctions tasks, with the test in the robots' place."""

from dataclasses import replace

import pytest

from blackboard.domain.bid import MAX_COST
from blackboard.domain.characteristics import RobotState
from blackboard.domain.talker import (
    TASK_ASSIGN,
    TASK_BROADCAST,
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


def test_a_call_offers_every_waiting_task_with_its_first_open_step():
    harness = BlackboardHarness()
    harness.join("robot1")
    harness.post(GO)
    harness.post(CARRY, ROUND)
    harness.bid("robot1", T1=5.0)

    assert harness.offered == ["T2", "T3"]
    assert [step for _, step in harness.said(TASK_BROADCAST)[-1].tasks] == [0, 0]


def test_a_round_closes_as_soon_as_every_robot_in_service_has_answered():
    harness = BlackboardHarness()
    harness.join("robot1", "robot2")
    harness.status("robot3", RobotState.DEFECT)
    harness.post(GO)
    harness.bid("robot1", T1=5.0)
    before = harness.orders()
    harness.bid("robot2", T1=4.0)

    assert before == []
    assert harness.orders() == [("T1", "robot2")]
    assert harness.network.now < 0.2


def test_a_repeated_report_does_not_withdraw_a_bid():
    harness = BlackboardHarness()
    harness.assign(GO, "robot2")
    harness.join("robot1", "robot2")
    harness.report("robot2", GO, DONE)
    harness.post(ROUND)
    harness.bid("robot2", T3=4.0)
    harness.report("robot2", GO, DONE)
    harness.bid("robot1", T3=5.0)

    assert harness.orders()[-1] == ("T3", "robot2")


def test_a_round_closes_at_the_bid_timeout_at_the_latest():
    harness = BlackboardHarness(bid_timeout=2.0)
    harness.join("robot1", "robot2")
    harness.post(GO)
    harness.bid("robot1", T1=5.0)
    harness.wait(1.9)
    before = harness.orders()
    harness.wait(0.2)

    assert before == []
    assert harness.orders() == [("T1", "robot1")]


def test_an_assignment_is_told_with_robot_number_and_predicted_time():
    harness = BlackboardHarness()
    harness.assign(GO)

    update, order = harness.said(TASK_STATE)[-1], harness.said(TASK_ASSIGN)[-1]
    assert (update.state, update.robot_id, update.assignment) == (ASSIGNED, "robot1", 1)
    assert update.eta == 10.0
    assert harness.record(GO).predicted_at == pytest.approx(harness.talker.date(), abs=1.0)
    assert (order.task.id, order.robot_id, order.assignment) == (GO.id, "robot1", 1)
    assert order.task.asks_the_same_as(GO)


def test_a_robot_that_was_too_slow_is_not_waited_for_again():
    harness = BlackboardHarness(bid_timeout=2.0)
    harness.join("robot1", "slow")
    harness.post(GO)
    harness.bid("robot1", T1=5.0)
    harness.wait(2.1)
    harness.post(CARRY)
    harness.bid("robot1", T2=5.0)

    assert harness.orders() == [("T1", "robot1"), ("T2", "robot1")]


def test_a_robot_that_was_slow_once_is_waited_for_again_when_it_has_answered():
    harness = BlackboardHarness(bid_timeout=2.0)
    harness.join("robot1", "slow")
    harness.post(GO)
    harness.bid("robot1", T1=5.0)
    harness.wait(2.1)
    harness.bid("slow", T1=1.0)
    harness.post(CARRY)
    harness.bid("robot1", T2=5.0)
    harness.bid("slow", T2=1.0)

    assert harness.orders() == [("T1", "robot1"), ("T2", "slow")]


def test_slow_robots_are_waited_for_if_all_are_slow():
    harness = BlackboardHarness(bid_timeout=2.0)
    harness.join("slow", "slower")
    harness.post(GO)
    harness.wait(2.1)
    harness.post(CARRY)
    harness.bid("slow", T2=3.0)
    harness.bid("slower", T2=1.0)

    assert harness.orders() == [("T2", "slower")]


def test_each_robot_wins_one_task_a_round():
    harness = BlackboardHarness()
    harness.join("robot1", "robot2")
    harness.post(GO)
    harness.post(CARRY, ROUND)
    harness.bid("robot1", T1=1.0)
    harness.bid("robot2", T1=2.0)
    harness.bid("robot1", T2=1.0, T3=2.0)
    harness.bid("robot2", T2=2.0, T3=1.0)

    assert harness.orders() == [("T1", "robot1"), ("T2", "robot1"), ("T3", "robot2")]


def test_only_the_winner_is_asked_again_and_told_what_it_has_won():
    harness = BlackboardHarness()
    harness.join("robot1", "robot2")
    harness.post(GO)
    harness.post(CARRY, ROUND)
    harness.bid("robot1", T1=1.0)
    harness.bid("robot2", T1=2.0)
    harness.bid("robot1", T2=1.0, T3=1.0)
    harness.bid("robot2", T2=2.0, T3=2.0)

    asked = harness.said(TASK_BROADCAST)[-1]
    assert asked.asked == {"robot1": "T2"}
    assert harness.offered == ["T3"]
    assert (asked.auction, asked.round) == (harness.said(TASK_BROADCAST)[-2].auction, 3)


def test_a_robot_that_finishes_a_task_meanwhile_is_asked_again():
    harness = BlackboardHarness()
    harness.join("robot1", "robot2")
    harness.post(GO)
    harness.post(CARRY, ROUND)
    harness.bid("robot1", T1=2.0)
    harness.bid("robot2", T1=1.0)
    harness.bid("robot2", T2=2.0, T3=9.0)
    harness.report("robot2", GO, DONE, steps=1, step=1)
    harness.bid("robot1", T2=1.0, T3=1.0)

    assert harness.said(TASK_BROADCAST)[-1].asked == {"robot1": "T2", "robot2": ""}


def test_bids_of_a_robot_out_of_service_do_not_count():
    harness = BlackboardHarness()
    harness.join("robot1")
    harness.status("robot2", RobotState.DEFECT)
    harness.post(GO)
    harness.bid("robot2", T1=1.0)
    harness.bid("robot1", T1=5.0)

    assert harness.orders() == [("T1", "robot1")]
    assert "is not in service" in harness.talker.warnings[0]


def test_a_robot_that_breaks_down_after_its_bid_wins_nothing():
    harness = BlackboardHarness()
    harness.join("robot1", "robot2")
    harness.post(GO)
    harness.bid("robot2", T1=1.0)
    harness.status("robot2", RobotState.DEFECT)
    harness.bid("robot1", T1=5.0)

    assert harness.orders() == [("T1", "robot1")]


def test_the_most_urgent_task_is_awarded_first():
    harness = BlackboardHarness()
    harness.post(GO, replace(CARRY, priority=9))
    harness.join("robot1")
    harness.bid("robot1", T1=1.0, T2=500.0)

    assert harness.orders() == [("T2", "robot1")]


def test_without_a_robot_a_task_waits_and_says_so():
    harness = BlackboardHarness()
    harness.post(GO)

    assert harness.record(GO).reason == "no robot is in service"
    assert not harness.said(TASK_BROADCAST)


def test_a_task_that_nobody_can_take_waits_with_the_reason_of_each_robot():
    harness = BlackboardHarness()
    harness.join("robot1", "robot2")
    harness.post(GO)
    harness.bid("robot1", T1=MAX_COST)
    harness.bid("robot2", T1=MAX_COST)

    assert harness.states(GO) == [(WAITING, ""), (WAITING, "")]
    assert harness.record(GO).reason == "nobody can take it now: robot1: cannot; robot2: cannot"
