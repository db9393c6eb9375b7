# SPDX-License-Identifier: BSD-3-Clause
"""Steps that fail, robots that leave service, and what becomes of their loads."""

import pytest

from blackboard.domain.characteristics import RobotState
from blackboard.domain.talker import (
    TASK_STATE,
)
from blackboard.domain.task import Task, TaskState, TaskType
from blackboard.robot.controller import CommandResult, CommandState
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


def test_a_step_that_keeps_failing_hands_the_task_back_with_the_reason():
    rig = RobotRig()
    failure = CommandResult(CommandState.ABORTED, "no way")
    rig.command.results = [failure, failure]
    rig.order(GO)
    rig.wait(2 * STEP + 1.0)

    report = rig.said(TASK_STATE)[-1]
    assert (report.state, report.robot_id, report.step) == (WAITING, "robot1", 0)
    assert report.reason == "robot1: aborted: no way"
    assert rig.status.state is RobotState.IDLE


def test_a_robot_that_is_set_defect_stops_and_hands_all_its_tasks_back():
    rig = RobotRig()
    rig.order(ROUND)
    rig.order(GO)
    rig.wait(STEP)

    rig.set_state("defect")
    rig.wait(STEP)

    assert (WAITING, 1) in rig.reports(ROUND)
    assert (WAITING, 0) in rig.reports(GO)
    assert len(rig.command.started) == 2
    assert rig.status.state is RobotState.DEFECT
    assert rig.status.tasks == ()
    assert rig.status.reason == "defect, set by an operator"


def test_what_it_is_given_while_out_of_service_it_hands_back():
    rig = RobotRig()
    rig.set_state("defect")

    rig.order(GO)

    assert rig.reports(GO) == [(WAITING, 0)]
    assert not rig.command.started


def test_a_task_whose_load_is_on_board_has_failed_and_a_person_is_told_where_it_is():
    rig = RobotRig()
    rig.order(CARRY)
    rig.wait(2 * STEP)

    rig.set_state("defect")

    report = rig.said(TASK_STATE)[-1]
    assert (report.state, report.step) == (FAILED, 2)
    assert "its load of 5 kg is on board at (6.00, 0.00): take it off" in report.reason
    assert rig.status.reason == (
        "the load of T2 (5 kg) is on board: take it off, then set the robot idle"
    )
    assert rig.status.payload == 5.0


def test_before_the_pick_nothing_is_on_board_and_the_task_is_handed_back():
    rig = RobotRig()
    rig.order(CARRY)
    rig.wait(STEP)

    rig.set_state("defect")

    assert rig.reports(CARRY)[-1] == (WAITING, 1)
    assert rig.status.payload == 0.0


def test_a_robot_that_fails_with_a_load_on_board_leaves_service_and_hands_back_the_rest():
    rig = RobotRig()
    rig.order(CARRY)
    rig.order(GO)
    rig.wait(2 * STEP)
    lost = CommandResult(CommandState.LOST, "no answer")
    rig.command.results = [lost, lost]
    rig.wait(4 * STEP)

    assert (FAILED, 3) in rig.reports(CARRY)
    assert (WAITING, 0) in rig.reports(GO)
    assert rig.status.state is RobotState.DEFECT


def test_a_cancelled_task_whose_load_is_on_board_takes_the_robot_out_of_service():
    rig = RobotRig()
    rig.order(CARRY)
    rig.wait(2 * STEP)

    rig.order(CARRY, take_back=True)

    assert rig.status.state is RobotState.DEFECT
    assert rig.status.payload == 5.0
    assert "take it off" in rig.status.reason


def test_set_idle_it_is_in_service_again_and_empty():
    rig = RobotRig()
    rig.order(CARRY)
    rig.wait(2 * STEP)
    rig.set_state("defect")

    rig.set_state("idle")

    assert rig.status.state is RobotState.IDLE
    assert (rig.status.payload, rig.status.reason) == (0.0, "")
    assert rig.bids(GO).bids[0].is_able


def test_to_set_a_robot_idle_that_is_at_work_disturbs_nothing():
    rig = RobotRig()
    rig.order(GO)
    rig.wait(STEP / 2)

    rig.set_state("idle")
    rig.wait(STEP / 2)

    assert rig.reports(GO) == [(STARTED, 0), (DONE, 1)]


def test_an_unknown_state_is_refused_with_those_there_are():
    rig = RobotRig()

    rig.set_state("sleepy")

    assert rig.talker.warnings == [
        "a message on set_state is refused: 'sleepy' is unknown; allowed: idle, defect, charging"
    ]
    assert rig.status.state is RobotState.IDLE


def test_charging_takes_its_time_and_ends_in_service():
    rig = RobotRig(charge=0.5)
    rig.set_state("charging")
    rig.wait(1700.0)
    before = rig.status
    rig.wait(200.0)

    # Half of 3600 s, and a little more because 20 W are drawn meanwhile.
    assert before.state is RobotState.CHARGING
    assert rig.status.state is RobotState.IDLE
    assert rig.status.charge > 0.99


@pytest.mark.parametrize("words", [["charging"], ["defect", "charging"]])
def test_a_charged_robot_stays_out_of_service_while_a_load_was_left_on_board(words):
    rig = RobotRig(charge=0.9)
    rig.order(CARRY)
    rig.wait(2 * STEP)
    for word in words:
        rig.set_state(word)

    rig.wait(600.0)

    assert rig.status.state is RobotState.DEFECT
    assert rig.status.payload == 5.0
    assert "take it off" in rig.status.reason
