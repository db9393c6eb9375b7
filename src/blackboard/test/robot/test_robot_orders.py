# SPDX-License-Identifier: BSD-3-Clause
"""Orders and task lists that come to a robot twice, late or not at all."""

import pytest

from blackboard.domain.characteristics import RobotState
from blackboard.domain.record import OrderKind
from blackboard.domain.talker import TASK_STATE
from blackboard.domain.task import Task, TaskState, TaskType
from hive_common.pose import Pose
from hive_lab.virtual.harness import STEP, RobotHarness

A, B = Pose(6.0, 0.0), Pose(12.0, 0.0)
GO = Task("T1", TaskType.GA, (A,))
ROUND = Task("T3", TaskType.GAB, (A, B), payload=5.0)
WAITING, STARTED, DONE, FAILED = (
    TaskState.WAITING,
    TaskState.STARTED,
    TaskState.DONE,
    TaskState.FAILED,
)


def test_a_robot_ignores_another_robot_s_order():
    harness = RobotHarness()
    harness.order(GO, robot_id="robot2")

    assert harness.status.tasks == ()


def test_an_order_that_comes_twice_is_carried_out_once():
    harness = RobotHarness()
    harness.order(GO)
    harness.order(GO)
    harness.wait(STEP / 2)
    harness.order(GO)
    meanwhile = harness.status.tasks
    harness.wait(STEP)

    assert meanwhile == ("T1",)
    assert len(harness.command.started) == 1
    assert harness.status.tasks == ()


def test_an_order_for_a_finished_task_is_ignored_even_after_an_old_task_list():
    harness = RobotHarness()
    harness.order(GO)
    harness.wait(2 * STEP)
    harness.know(GO, TaskState.DONE, version=2)
    harness.know(GO, TaskState.ASSIGNED, version=1)
    harness.order(GO)

    assert len(harness.command.started) == 1
    assert harness.status.tasks == ()


def test_a_report_is_repeated_until_the_list_shows_that_it_is_known():
    harness = RobotHarness()
    harness.order(GO)
    harness.wait(STEP + 3.0)
    told = len(harness.reports(GO))
    harness.know(GO, DONE)
    harness.wait(3.0)

    assert told == 5  # STARTED, DONE, and DONE once a second
    assert len(harness.reports(GO)) == told


def test_an_order_that_was_answered_already_is_answered_with_the_report():
    harness = RobotHarness()
    harness.order(GO)
    harness.wait(STEP)

    harness.order(GO)

    assert harness.reports(GO) == [(STARTED, 0), (DONE, 1), (DONE, 1)]
    assert len(harness.command.started) == 1


def test_an_order_slower_than_the_task_list_begins_nothing():
    harness = RobotHarness()
    harness.order(GO)
    harness.wait(STEP)
    harness.know(GO, DONE)

    harness.order(GO)

    assert len(harness.command.started) == 1
    assert harness.status.tasks == ()


def test_a_task_that_was_handed_back_may_be_given_again():
    harness = RobotHarness()
    harness.set_state("defect")
    harness.order(GO, assignment=1)
    harness.set_state("idle")

    harness.order(GO, assignment=2)
    harness.know(GO, STARTED, assignment=2)
    harness.wait(3.0)

    assert harness.reports(GO) == [(WAITING, 0), (STARTED, 0)]


def test_a_task_that_is_taken_back_stops_the_robot_and_the_next_one_begins():
    harness = RobotHarness()
    harness.order(GO)
    harness.order(ROUND)

    harness.order(GO, kind=OrderKind.TAKE_BACK)
    harness.wait(STEP)

    assert harness.reports(GO) == [(STARTED, 0)]
    assert harness.reports(ROUND) == [(STARTED, 0), (STARTED, 1)]


def test_a_task_that_is_taken_back_before_its_turn_disturbs_nothing():
    harness = RobotHarness()
    harness.order(GO)
    harness.order(ROUND)

    harness.order(ROUND, kind=OrderKind.TAKE_BACK)
    harness.wait(STEP)

    assert harness.reports(GO) == [(STARTED, 0), (DONE, 1)]
    assert harness.reports(ROUND) == []


def test_taking_back_what_it_does_not_have_is_harmless():
    harness = RobotHarness()

    harness.order(GO, kind=OrderKind.TAKE_BACK)

    assert harness.status.state is RobotState.IDLE


def test_taking_back_an_earlier_assignment_leaves_the_later_one():
    harness = RobotHarness()
    harness.order(GO, assignment=2)

    harness.order(GO, assignment=1, kind=OrderKind.TAKE_BACK)

    assert harness.status.tasks == ("T1",)


@pytest.mark.parametrize(
    ("state", "robot", "assignment"),
    [
        (TaskState.CANCELLED, "robot1", 1),
        (DONE, "robot2", 1),
        (WAITING, "", 1),
        (STARTED, "robot2", 2),
    ],
)
def test_a_task_that_the_list_no_longer_shows_as_its_own_is_dropped(state, robot, assignment):
    harness = RobotHarness()
    harness.order(GO)

    harness.know(GO, state, robot, assignment)
    harness.wait(STEP)

    assert harness.status.tasks == ()
    assert harness.reports(GO) == [(STARTED, 0)]


@pytest.mark.parametrize(
    ("state", "robot", "assignment"), [(TaskState.ASSIGNED, "robot1", 2), (WAITING, "", 1)]
)
def test_a_list_that_agrees_or_is_older_than_the_order_changes_nothing(state, robot, assignment):
    harness = RobotHarness()
    harness.order(GO, assignment=2)

    harness.know(GO, state, robot, assignment)
    harness.wait(STEP)

    assert harness.reports(GO)[:2] == [(STARTED, 0), (DONE, 1)]


def test_a_robot_drops_what_a_hive_gave_it_that_it_has_left():
    harness = RobotHarness()
    harness.order(GO, assignment=5, hive="first")
    harness.order(GO, assignment=1, hive="second", kind=OrderKind.TAKE_BACK)

    assert harness.status.tasks == ()


def test_a_robot_reports_to_the_hive_that_gave_it_the_task_last():
    harness = RobotHarness()
    harness.order(GO, assignment=5, hive="first")
    harness.order(GO, assignment=1, hive="second")
    harness.wait(2 * STEP)

    last = harness.said(TASK_STATE)[-1]
    assert (last.state, last.assignment) == (DONE, 1)
