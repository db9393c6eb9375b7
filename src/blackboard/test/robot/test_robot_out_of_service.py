# SPDX-License-Identifier: BSD-3-Clause
"""Steps that fail, robots that leave service, and what becomes of their loads."""

import pytest

from blackboard.domain.bid import MAX_COST
from blackboard.domain.characteristics import RobotState
from blackboard.domain.record import OrderKind
from blackboard.domain.talker import (
    TASK_STATE,
)
from blackboard.domain.task import Task, TaskState, TaskType
from blackboard.robot.executor import CommandResult, CommandState
from hive_common.pose import Pose
from hive_lab.virtual.harness import STEP, RobotHarness

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
    harness = RobotHarness()
    failure = CommandResult(CommandState.ABORTED, "no way")
    harness.command.results = [failure, failure]
    harness.order(GO)
    harness.wait(2 * STEP + 1.0)

    report = harness.said(TASK_STATE)[-1]
    assert (report.state, report.robot_id, report.step) == (WAITING, "robot1", 0)
    assert report.reason == "robot1: aborted: no way"
    assert harness.status.state is RobotState.IDLE


def test_a_robot_whose_action_server_has_ended_hands_back_and_takes_nothing_until_it_is_there():
    harness = RobotHarness()
    ended = CommandResult(CommandState.GONE, "the action server move_base has ended")
    harness.command.results = [ended]
    harness.order(GO)
    harness.wait(STEP / 2)
    harness.missing = ended.text
    harness.wait(STEP)
    report, refused, reason = (
        harness.said(TASK_STATE)[-1],
        harness.bids(ROUND).bids[0],
        harness.status.reason,
    )
    harness.missing = ""

    assert (report.state, report.reason) == (WAITING, f"robot1: gone: {ended.text}")
    assert (refused.cost, refused.reason) == (MAX_COST, ended.text)
    assert reason == ended.text
    assert harness.bids(ROUND).bids[0].cost < MAX_COST


def test_a_robot_that_is_set_defect_stops_and_hands_all_its_tasks_back():
    harness = RobotHarness()
    harness.order(ROUND)
    harness.order(GO)
    harness.wait(STEP)

    harness.set_state("defect")
    harness.wait(STEP)

    assert (WAITING, 1) in harness.reports(ROUND)
    assert (WAITING, 0) in harness.reports(GO)
    assert len(harness.command.started) == 2
    assert harness.status.state is RobotState.DEFECT
    assert harness.status.tasks == ()
    assert harness.status.reason == "defect, set by an operator"


def test_a_task_given_to_a_robot_out_of_service_is_handed_back():
    harness = RobotHarness()
    harness.set_state("defect")

    harness.order(GO)

    assert harness.reports(GO) == [(WAITING, 0)]
    assert not harness.command.started


def test_a_task_whose_load_is_on_board_has_failed_and_a_person_is_told_where_it_is():
    harness = RobotHarness()
    harness.order(CARRY)
    harness.wait(2 * STEP)

    harness.set_state("defect")

    report = harness.said(TASK_STATE)[-1]
    assert (report.state, report.step) == (FAILED, 2)
    assert "its load of 5 kg is on board at (6.00, 0.00): take it off" in report.reason
    assert harness.status.reason == (
        "the load of T2 (5 kg) is on board: send the robot to put it down, or take it off, "
        "then set the robot idle"
    )
    assert harness.status.payload == 5.0


def test_before_the_pick_nothing_is_on_board_and_the_task_is_handed_back():
    harness = RobotHarness()
    harness.order(CARRY)
    harness.wait(STEP / 2)

    harness.set_state("defect")

    assert harness.reports(CARRY)[-1] == (WAITING, 0)
    assert harness.status.payload == 0.0


def test_a_robot_that_is_stopped_while_its_arm_picks_does_not_know_what_is_on_board():
    harness = RobotHarness()
    harness.order(CARRY)
    harness.wait(STEP)

    harness.set_state("defect")

    report = harness.said(TASK_STATE)[-1]
    assert (report.state, report.step) == (FAILED, 1)
    assert "its load of 5 kg may be on board at (6.00, 0.00): take it off" in report.reason
    assert harness.status.payload == 5.0


def test_a_robot_that_fails_with_a_load_on_board_leaves_service_and_hands_back_the_rest():
    harness = RobotHarness()
    harness.order(CARRY)
    harness.order(GO)
    harness.wait(2 * STEP)
    lost = CommandResult(CommandState.LOST, "no answer")
    harness.command.results = [lost, lost]
    harness.wait(4 * STEP)

    assert (FAILED, 3) in harness.reports(CARRY)
    assert (WAITING, 0) in harness.reports(GO)
    assert harness.status.state is RobotState.DEFECT


def test_a_cancelled_task_whose_load_is_on_board_takes_the_robot_out_of_service():
    harness = RobotHarness()
    harness.order(CARRY)
    harness.wait(2 * STEP)

    harness.order(CARRY, kind=OrderKind.TAKE_BACK)

    assert harness.status.state is RobotState.DEFECT
    assert harness.status.payload == 5.0
    assert "take it off" in harness.status.reason


def test_a_robot_set_idle_is_in_service_and_empty():
    harness = RobotHarness()
    harness.order(CARRY)
    harness.wait(2 * STEP)
    harness.set_state("defect")

    harness.set_state("idle")

    assert harness.status.state is RobotState.IDLE
    assert (harness.status.payload, harness.status.reason) == (0.0, "")
    assert harness.bids(GO).bids[0].is_able


def test_setting_a_robot_idle_that_is_at_work_disturbs_nothing():
    harness = RobotHarness()
    harness.order(GO)
    harness.wait(STEP / 2)

    harness.set_state("idle")
    harness.wait(STEP / 2)

    assert harness.reports(GO) == [(STARTED, 0), (DONE, 1)]


def test_an_unknown_state_is_refused_and_the_known_ones_are_named():
    harness = RobotHarness()

    harness.set_state("sleepy")

    (warning,) = harness.talker.warnings
    assert warning.endswith(
        "'sleepy' is unknown; allowed: idle, defect, charging, charge, forget, put_down X Y YAW"
    )
    assert harness.status.state is RobotState.IDLE


def test_charging_takes_its_time_and_ends_in_service():
    harness = RobotHarness(charge=0.5)
    harness.set_state("charging")
    harness.wait(1700.0)
    before = harness.status
    harness.wait(200.0)

    # Half of 3600 s, and a little more because 20 W are drawn meanwhile.
    assert before.state is RobotState.CHARGING
    assert harness.status.state is RobotState.IDLE
    assert harness.status.charge > 0.99


@pytest.mark.parametrize("words", [["charging"], ["defect", "charging"]])
def test_a_charged_robot_stays_out_of_service_while_a_load_was_left_on_board(words):
    harness = RobotHarness(charge=0.9)
    harness.order(CARRY)
    harness.wait(2 * STEP)
    for word in words:
        harness.set_state(word)

    harness.wait(600.0)

    assert harness.status.state is RobotState.DEFECT
    assert harness.status.payload == 5.0
    assert "take it off" in harness.status.reason


def test_a_robot_that_tells_a_trouble_leaves_service_and_comes_back_without_it():
    harness = RobotHarness()
    harness.order(GO)
    harness.wait(STEP)
    for _ in range(2):  # it is told again and again
        harness.robot.note_trouble("a person controls it")
    assert harness.status.state is RobotState.DEFECT
    assert harness.status.reason == "a person controls it"
    assert harness.status.tasks == ()

    harness.robot.note_trouble("")
    assert harness.status.state is RobotState.IDLE


def test_a_trouble_that_is_over_does_not_end_what_an_operator_said():
    harness = RobotHarness()
    harness.robot.note_trouble("a person controls it")
    harness.set_state("defect")
    harness.robot.note_trouble("a person controls it")  # it is told again and again
    harness.robot.note_trouble("")

    assert harness.status.state is RobotState.DEFECT
    assert harness.status.reason == "defect, set by an operator"


def test_a_trouble_lasts_until_the_robot_says_that_it_is_over_whatever_an_operator_says():
    harness = RobotHarness()
    harness.robot.note_trouble("a person controls it")
    harness.set_state("idle")

    assert harness.status.state is RobotState.DEFECT
    assert harness.status.reason == "a person controls it"


def test_a_robot_that_was_set_charging_charges_again_when_its_trouble_is_over():
    harness = RobotHarness(charge=0.5)
    harness.set_state("charging")
    harness.robot.note_trouble("a person controls it")
    during = harness.status.state
    harness.robot.note_trouble("")

    assert (during, harness.status.state) == (RobotState.DEFECT, RobotState.CHARGING)
    assert harness.status.reason == "charging, set by an operator"
