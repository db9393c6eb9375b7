# SPDX-License-Identifier: BSD-3-Clause
"""One robot that is told what to do by the test, in the blackboard's place."""

from dataclasses import replace

import pytest

from blackboard.domain.bid import MAX_COST, Exclusion
from blackboard.domain.characteristics import RobotState
from blackboard.domain.record import OrderKind
from blackboard.domain.talker import (
    ROBOT_STATUS,
    TASK_STATE,
)
from blackboard.domain.task import Task, TaskState, TaskType, split_task
from hive_common.pose import Pose
from hive_lab.virtual.harness import STEP, RobotHarness
from hive_lab.virtual.hive import SMALL_ROBOT

A, B = Pose(6.0, 0.0), Pose(12.0, 0.0)
GO = Task("T1", TaskType.GA, (A,))
CARRY = Task("T2", TaskType.GPAB, (A, B), payload=5.0)
ROUND = Task("T3", TaskType.GAB, (A, B), payload=5.0)
WAITING, STARTED, DONE, FAILED = (
    TaskState.WAITING,
    TaskState.STARTED,
    TaskState.DONE,
    TaskState.FAILED,
)


def test_a_robot_publishes_its_status_at_the_start_and_then_once_a_second():
    harness = RobotHarness()
    harness.wait(3.0)

    statuses = harness.said(ROBOT_STATUS)
    assert len(statuses) == 4
    assert statuses[0].state is RobotState.IDLE
    assert statuses[0].pose == Pose(0.0, 0.0)
    assert statuses[0].charge == 1.0
    assert statuses[0].carries == SMALL_ROBOT.carries


def test_it_bids_on_everything_that_is_broadcast_in_one_answer():
    harness = RobotHarness()

    answer = harness.bids(GO, CARRY)

    assert (answer.robot_id, answer.epoch, answer.auction) == ("robot1", 1, 7)
    assert [bid.task_id for bid in answer.bids] == ["T1", "T2"]
    assert all(0.0 < bid.cost < MAX_COST for bid in answer.bids)


@pytest.mark.parametrize("word", ["defect", "charging"])
def test_out_of_service_it_bids_max_cost_and_says_why(word):
    harness = RobotHarness(charge=0.5)
    harness.set_state(word)

    (bid,) = harness.bids(GO).bids

    assert (bid.cost, bid.reason) == (MAX_COST, f"{word}, set by an operator")
    assert bid.exclusion == Exclusion.SERVICE


@pytest.mark.parametrize("word", ["defect", "charging"])
def test_out_of_service_it_says_of_what_it_can_never_do_that_it_never_can(word):
    harness = RobotHarness(charge=0.5)
    harness.set_state(word)

    (bid,) = harness.bids(replace(CARRY, payload=99.0)).bids

    assert bid.exclusion == Exclusion.PAYLOAD
    assert bid.reason.startswith("carries at most ")


def test_asked_for_a_task_that_has_not_begun_it_hands_it_back():
    harness = RobotHarness()
    harness.order(GO)
    harness.order(CARRY)
    harness.order(CARRY, kind=OrderKind.HAND_BACK_UNBEGUN)

    assert harness.reports(CARRY) == [(WAITING, 0)]
    assert harness.status.tasks == ("T1",)


def test_asked_for_a_task_that_its_process_did_not_know_it_stops_its_base_first():
    harness = RobotHarness()
    (drive,) = split_task(GO)
    harness.command.start(drive, lambda _: None)  # as an earlier process has done

    harness.order(GO, kind=OrderKind.HAND_BACK_UNBEGUN)

    assert harness.command.running is None
    assert harness.reports(GO) == [(WAITING, 0)]


def test_asked_for_a_task_that_has_begun_it_keeps_it():
    harness = RobotHarness()
    harness.order(GO)
    harness.order(GO, kind=OrderKind.HAND_BACK_UNBEGUN)

    assert harness.reports(GO) == [(STARTED, 0)]
    assert harness.status.task_id == "T1"


def test_on_a_task_of_its_own_schedule_it_bids_as_if_it_did_not_have_it():
    harness = RobotHarness()
    harness.order(GO)
    alone = harness.bids(CARRY).bids[0].eta
    harness.order(CARRY)

    offered = harness.bids(CARRY).bids[0].eta

    assert offered == pytest.approx(alone)


def test_it_does_not_bid_on_what_it_has_begun():
    harness = RobotHarness()
    harness.order(GO)

    (bid,) = harness.bids(GO).bids

    assert (bid.cost, bid.reason) == (MAX_COST, "has begun it already")


def test_a_task_is_begun_at_once_and_reported_step_by_step():
    harness = RobotHarness()
    harness.order(CARRY, assignment=3)
    harness.wait(4 * STEP)

    assert harness.reports(CARRY)[:5] == [
        (STARTED, 0),
        (STARTED, 1),
        (STARTED, 2),
        (STARTED, 3),
        (DONE, 4),
    ]
    assert {(said.steps, said.assignment, said.epoch) for said in harness.said(TASK_STATE)} == {
        (4, 3, 1)
    }


def test_every_step_promises_when_the_task_will_be_done():
    harness = RobotHarness()
    harness.order(ROUND)
    harness.wait(STEP)

    # 12 m, and after the first step the 6 m that are left, at 0.6 m/s.
    etas = [said.eta for said in harness.said(TASK_STATE)]
    assert etas == pytest.approx([20.0, 10.0])


def test_the_status_shows_the_current_task_and_the_whole_schedule():
    harness = RobotHarness()
    harness.order(GO)
    harness.order(CARRY)

    assert (harness.status.state, harness.status.task_id) == (RobotState.BUSY, "T1")
    assert harness.status.tasks == ("T1", "T2")


def test_the_next_task_is_begun_when_the_one_before_is_done():
    harness = RobotHarness()
    harness.order(GO)
    harness.order(ROUND)
    before = harness.reports(ROUND)
    harness.wait(STEP)

    assert not before
    assert harness.reports(GO) == [(STARTED, 0), (DONE, 1)]
    assert harness.reports(ROUND) == [(STARTED, 0)]


def test_a_task_that_another_robot_has_begun_continues_where_it_was_left():
    harness = RobotHarness()
    harness.order(ROUND, step=1)
    harness.wait(STEP)

    assert [step.goal for step in harness.command.started] == [B]
    assert harness.reports(ROUND) == [(STARTED, 1), (DONE, 2)]
