# SPDX-License-Identifier: BSD-3-Clause
"""How the blackboard gives tasks out, with the test in the robots' place."""

from dataclasses import replace

from blackboard.costing.cost import MAX_COST
from blackboard.domain.characteristics import RobotState
from blackboard.domain.talker import (
    TASK_ASSIGN,
    TASK_BROADCAST,
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


def test_all_that_waits_is_broadcast_with_the_step_to_begin_at():
    rig = BlackboardRig()
    rig.join("robot1")
    rig.post(GO)
    rig.post(CARRY, ROUND)
    rig.bid("robot1", T1=5.0)

    assert rig.offered == ["T2", "T3"]
    assert [step for _, step in rig.said(TASK_BROADCAST)[-1].tasks] == [0, 0]


def test_the_auction_ends_as_soon_as_everyone_in_service_has_answered():
    rig = BlackboardRig()
    rig.join("robot1", "robot2")
    rig.status("robot3", RobotState.DEFECT)
    rig.post(GO)
    rig.bid("robot1", T1=5.0)
    before = rig.orders()
    rig.bid("robot2", T1=4.0)

    assert before == []
    assert rig.orders() == [("T1", "robot2")]
    assert rig.network.now < 0.2


def test_a_report_that_is_repeated_takes_no_bid_back():
    rig = BlackboardRig()
    rig.assign(GO, "robot2")
    rig.join("robot1", "robot2")
    rig.report("robot2", GO, DONE)
    rig.post(ROUND)
    rig.bid("robot2", T3=4.0)
    rig.report("robot2", GO, DONE)
    rig.bid("robot1", T3=5.0)

    assert rig.orders()[-1] == ("T3", "robot2")


def test_the_auction_ends_at_the_bid_timeout_at_the_latest():
    rig = BlackboardRig(bid_timeout=2.0)
    rig.join("robot1", "robot2")
    rig.post(GO)
    rig.bid("robot1", T1=5.0)
    rig.wait(1.9)
    before = rig.orders()
    rig.wait(0.2)

    assert before == []
    assert rig.orders() == [("T1", "robot1")]


def test_an_assignment_is_said_with_robot_number_and_promise():
    rig = BlackboardRig()
    rig.assign(GO)

    update, order = rig.said(TASK_STATE)[-1], rig.said(TASK_ASSIGN)[-1]
    assert (update.state, update.robot_id, update.assignment) == (ASSIGNED, "robot1", 1)
    assert update.eta == 10.0
    assert (order.task, order.robot_id, order.assignment) == (GO, "robot1", 1)


def test_a_robot_that_was_too_slow_is_not_waited_for_again():
    rig = BlackboardRig(bid_timeout=2.0)
    rig.join("robot1", "slow")
    rig.post(GO)
    rig.bid("robot1", T1=5.0)
    rig.wait(2.1)
    rig.post(CARRY)
    rig.bid("robot1", T2=5.0)

    assert rig.orders() == [("T1", "robot1"), ("T2", "robot1")]


def test_a_robot_that_was_slow_once_is_waited_for_again_when_it_has_answered():
    rig = BlackboardRig(bid_timeout=2.0)
    rig.join("robot1", "slow")
    rig.post(GO)
    rig.bid("robot1", T1=5.0)
    rig.wait(2.1)
    rig.bid("slow", T1=1.0)
    rig.post(CARRY)
    rig.bid("robot1", T2=5.0)
    rig.bid("slow", T2=1.0)

    assert rig.orders() == [("T1", "robot1"), ("T2", "slow")]


def test_if_all_are_slow_they_are_waited_for():
    rig = BlackboardRig(bid_timeout=2.0)
    rig.join("slow", "slower")
    rig.post(GO)
    rig.wait(2.1)
    rig.post(CARRY)
    rig.bid("slow", T2=3.0)
    rig.bid("slower", T2=1.0)

    assert rig.orders() == [("T2", "slower")]


def test_several_tasks_are_spread_over_the_robots_one_in_each_round():
    rig = BlackboardRig()
    rig.join("robot1", "robot2")
    rig.post(GO)
    rig.post(CARRY, ROUND)
    rig.bid("robot1", T1=1.0)
    rig.bid("robot2", T1=2.0)
    rig.bid("robot1", T2=1.0, T3=2.0)
    rig.bid("robot2", T2=2.0, T3=1.0)

    assert rig.orders() == [("T1", "robot1"), ("T2", "robot1"), ("T3", "robot2")]


def test_only_the_winner_is_asked_again_and_told_what_it_has_won():
    rig = BlackboardRig()
    rig.join("robot1", "robot2")
    rig.post(GO)
    rig.post(CARRY, ROUND)
    rig.bid("robot1", T1=1.0)
    rig.bid("robot2", T1=2.0)
    rig.bid("robot1", T2=1.0, T3=1.0)
    rig.bid("robot2", T2=2.0, T3=2.0)

    asked = rig.said(TASK_BROADCAST)[-1]
    assert asked.asked == {"robot1": "T2"}
    assert rig.offered == ["T3"]
    assert (asked.auction, asked.round) == (rig.said(TASK_BROADCAST)[-2].auction, 3)


def test_a_robot_that_has_finished_a_task_meanwhile_is_asked_again():
    rig = BlackboardRig()
    rig.join("robot1", "robot2")
    rig.post(GO)
    rig.post(CARRY, ROUND)
    rig.bid("robot1", T1=2.0)
    rig.bid("robot2", T1=1.0)
    rig.bid("robot2", T2=2.0, T3=9.0)
    rig.report("robot2", GO, DONE, steps=1, step=1)
    rig.bid("robot1", T2=1.0, T3=1.0)

    assert rig.said(TASK_BROADCAST)[-1].asked == {"robot1": "T2", "robot2": ""}


def test_a_robot_that_is_out_of_service_gives_no_bid_that_counts():
    rig = BlackboardRig()
    rig.join("robot1")
    rig.status("robot2", RobotState.DEFECT)
    rig.post(GO)
    rig.bid("robot2", T1=1.0)
    rig.bid("robot1", T1=5.0)

    assert rig.orders() == [("T1", "robot1")]
    assert "is not in service" in rig.talker.warnings[0]


def test_a_robot_that_breaks_down_after_its_bid_is_given_nothing():
    rig = BlackboardRig()
    rig.join("robot1", "robot2")
    rig.post(GO)
    rig.bid("robot2", T1=1.0)
    rig.status("robot2", RobotState.DEFECT)
    rig.bid("robot1", T1=5.0)

    assert rig.orders() == [("T1", "robot1")]


def test_the_most_urgent_task_is_given_first():
    rig = BlackboardRig()
    rig.post(GO, replace(CARRY, priority=9))
    rig.join("robot1")
    rig.bid("robot1", T1=1.0, T2=500.0)

    assert rig.orders() == [("T2", "robot1")]


def test_without_a_robot_a_task_waits_and_says_so():
    rig = BlackboardRig()
    rig.post(GO)

    assert rig.record(GO).reason == "no robot is in service"
    assert not rig.said(TASK_BROADCAST)


def test_a_task_nobody_can_take_waits_with_every_robot_s_reason():
    rig = BlackboardRig()
    rig.join("robot1", "robot2")
    rig.post(GO)
    rig.bid("robot1", T1=MAX_COST)
    rig.bid("robot2", T1=MAX_COST)

    assert rig.states(GO) == [(WAITING, ""), (WAITING, "")]
    assert rig.record(GO).reason == "nobody can take it now: robot1: cannot; robot2: cannot"
