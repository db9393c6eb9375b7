# SPDX-License-Identifier: BSD-3-Clause
"""One robot that is told what to do by the test, in the blackboard's place."""

import pytest

from blackboard.costing.cost import MAX_COST
from blackboard.domain.characteristics import RobotState
from blackboard.domain.talker import (
    ROBOT_STATUS,
    TASK_STATE,
)
from blackboard.domain.task import Task, TaskState, TaskType
from hive_common.pose import Pose
from hive_lab.virtual.harness import STEP, RobotRig

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


def test_a_robot_says_how_it_is_at_the_start_and_then_once_a_second():
    rig = RobotRig()
    rig.wait(3.0)

    statuses = rig.said(ROBOT_STATUS)
    assert len(statuses) == 4
    assert statuses[0].state is RobotState.IDLE
    assert statuses[0].pose == Pose(0.0, 0.0)
    assert statuses[0].charge == 1.0


def test_it_bids_on_all_that_is_broadcast_in_one_answer():
    rig = RobotRig()

    answer = rig.bids(GO, CARRY)

    assert (answer.robot_id, answer.epoch, answer.auction) == ("robot1", 1, 7)
    assert [bid.task_id for bid in answer.bids] == ["T1", "T2"]
    assert all(0.0 < bid.cost < MAX_COST for bid in answer.bids)


@pytest.mark.parametrize("word", ["defect", "charging"])
def test_out_of_service_it_bids_max_cost_and_says_why(word):
    rig = RobotRig(charge=0.5)
    rig.set_state(word)

    (bid,) = rig.bids(GO).bids

    assert (bid.cost, bid.reason) == (MAX_COST, f"{word}, set by an operator")


def test_asked_for_a_task_that_has_not_begun_it_hands_it_back():
    rig = RobotRig()
    rig.order(GO)
    rig.order(CARRY)
    rig.order(CARRY, take_back=True, hand_back=True, if_unbegun=True)

    assert rig.reports(CARRY) == [(WAITING, 0)]
    assert rig.status.tasks == ("T1",)


def test_asked_for_a_task_that_has_begun_it_keeps_it():
    rig = RobotRig()
    rig.order(GO)
    rig.order(GO, take_back=True, hand_back=True, if_unbegun=True)

    assert rig.reports(GO) == [(STARTED, 0)]
    assert rig.status.task_id == "T1"


def test_what_is_on_its_own_list_it_bids_on_for_the_list_without_it():
    rig = RobotRig()
    rig.order(GO)
    alone = rig.bids(CARRY).bids[0].eta
    rig.order(CARRY)

    offered = rig.bids(CARRY).bids[0].eta

    assert offered == pytest.approx(alone)


def test_what_it_has_begun_it_does_not_offer():
    rig = RobotRig()
    rig.order(GO)

    (bid,) = rig.bids(GO).bids

    assert (bid.cost, bid.reason) == (MAX_COST, "has begun with it")


def test_a_task_is_begun_at_once_and_reported_step_by_step():
    rig = RobotRig()
    rig.order(CARRY, assignment=3)
    rig.wait(4 * STEP)

    assert rig.reports(CARRY)[:5] == [
        (STARTED, 0),
        (STARTED, 1),
        (STARTED, 2),
        (STARTED, 3),
        (DONE, 4),
    ]
    assert {(said.steps, said.assignment, said.epoch) for said in rig.said(TASK_STATE)} == {
        (4, 3, 1)
    }


def test_every_step_promises_when_the_task_will_be_done():
    rig = RobotRig()
    rig.order(ROUND)
    rig.wait(STEP)

    # 12 m, and after the first step the 6 m that are left, at 0.6 m/s.
    etas = [said.eta for said in rig.said(TASK_STATE)]
    assert etas == pytest.approx([20.0, 10.0])


def test_the_status_shows_what_it_is_doing_and_all_that_is_on_its_list():
    rig = RobotRig()
    rig.order(GO)
    rig.order(CARRY)

    assert (rig.status.state, rig.status.task_id) == (RobotState.BUSY, "T1")
    assert rig.status.tasks == ("T1", "T2")


def test_the_next_task_is_begun_when_the_one_before_is_done():
    rig = RobotRig()
    rig.order(GO)
    rig.order(ROUND)
    before = rig.reports(ROUND)
    rig.wait(STEP)

    assert not before
    assert rig.reports(GO) == [(STARTED, 0), (DONE, 1)]
    assert rig.reports(ROUND) == [(STARTED, 0)]


def test_a_task_that_another_robot_has_begun_goes_on_where_it_was_left():
    rig = RobotRig()
    rig.order(ROUND, step=1)
    rig.wait(STEP)

    assert [step.goal for step in rig.command.started] == [B]
    assert rig.reports(ROUND) == [(STARTED, 1), (DONE, 2)]
