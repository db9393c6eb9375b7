# SPDX-License-Identifier: BSD-3-Clause
"""Orders and task lists that come to a robot twice, late or not at all."""

import pytest

from blackboard.domain.characteristics import RobotState
from blackboard.domain.task import Task, TaskState, TaskType
from hive_common.pose import Pose
from hive_lab.virtual.harness import STEP, RobotRig

A, B = Pose(6.0, 0.0), Pose(12.0, 0.0)
GO = Task("T1", TaskType.GA, (A,))
ROUND = Task("T3", TaskType.GAB, (A, B), payload=5.0)
WAITING, STARTED, DONE, FAILED = (
    TaskState.WAITING,
    TaskState.STARTED,
    TaskState.DONE,
    TaskState.FAILED,
)


def test_another_robot_s_order_is_none_of_its_business():
    rig = RobotRig()
    rig.order(GO, robot_id="robot2")

    assert rig.status.tasks == ()


def test_an_order_that_comes_twice_is_carried_out_once():
    rig = RobotRig()
    rig.order(GO)
    rig.order(GO)
    rig.wait(STEP / 2)
    rig.order(GO)
    meanwhile = rig.status.tasks
    rig.wait(STEP)

    assert meanwhile == ("T1",)
    assert len(rig.command.started) == 1
    assert rig.status.tasks == ()


def test_an_order_that_comes_after_its_end_is_not_carried_out_though_an_old_list_came_between():
    rig = RobotRig()
    rig.order(GO)
    rig.wait(2 * STEP)
    rig.know(GO, TaskState.DONE, version=2)
    rig.know(GO, TaskState.ASSIGNED, version=1)
    rig.order(GO)

    assert len(rig.command.started) == 1
    assert rig.status.tasks == ()


def test_a_report_is_repeated_until_the_list_shows_that_it_is_known():
    rig = RobotRig()
    rig.order(GO)
    rig.wait(STEP + 3.0)
    told = len(rig.reports(GO))
    rig.know(GO, DONE)
    rig.wait(3.0)

    assert told == 5  # STARTED, DONE, and DONE once a second
    assert len(rig.reports(GO)) == told


def test_an_order_that_was_answered_already_is_answered_with_the_report():
    rig = RobotRig()
    rig.order(GO)
    rig.wait(STEP)

    rig.order(GO)

    assert rig.reports(GO) == [(STARTED, 0), (DONE, 1), (DONE, 1)]
    assert len(rig.command.started) == 1


def test_an_order_that_was_slower_than_the_task_list_begins_nothing_anew():
    rig = RobotRig()
    rig.order(GO)
    rig.wait(STEP)
    rig.know(GO, DONE)

    rig.order(GO)

    assert len(rig.command.started) == 1
    assert rig.status.tasks == ()


def test_a_task_that_was_handed_back_may_be_given_again():
    rig = RobotRig()
    rig.set_state("defect")
    rig.order(GO, assignment=1)
    rig.set_state("idle")

    rig.order(GO, assignment=2)
    rig.know(GO, STARTED, assignment=2)
    rig.wait(3.0)

    assert rig.reports(GO) == [(WAITING, 0), (STARTED, 0)]


def test_a_task_that_is_taken_back_stops_the_robot_and_the_next_one_begins():
    rig = RobotRig()
    rig.order(GO)
    rig.order(ROUND)

    rig.order(GO, take_back=True)
    rig.wait(STEP)

    assert rig.reports(GO) == [(STARTED, 0)]
    assert rig.reports(ROUND) == [(STARTED, 0), (STARTED, 1)]


def test_a_task_that_is_taken_back_before_its_turn_disturbs_nothing():
    rig = RobotRig()
    rig.order(GO)
    rig.order(ROUND)

    rig.order(ROUND, take_back=True)
    rig.wait(STEP)

    assert rig.reports(GO) == [(STARTED, 0), (DONE, 1)]
    assert rig.reports(ROUND) == []


def test_to_take_back_what_it_does_not_have_is_harmless():
    rig = RobotRig()

    rig.order(GO, take_back=True)

    assert rig.status.state is RobotState.IDLE


def test_to_take_back_an_earlier_assignment_leaves_the_later_one():
    rig = RobotRig()
    rig.order(GO, assignment=2)

    rig.order(GO, assignment=1, take_back=True)

    assert rig.status.tasks == ("T1",)


@pytest.mark.parametrize(
    ("state", "robot", "assignment"),
    [
        (TaskState.CANCELLED, "robot1", 1),
        (DONE, "robot2", 1),
        (WAITING, "", 1),
        (STARTED, "robot2", 2),
    ],
)
def test_what_the_list_shows_to_be_no_longer_its_own_is_dropped(state, robot, assignment):
    rig = RobotRig()
    rig.order(GO)

    rig.know(GO, state, robot, assignment)
    rig.wait(STEP)

    assert rig.status.tasks == ()
    assert rig.reports(GO) == [(STARTED, 0)]


@pytest.mark.parametrize(
    ("state", "robot", "assignment"), [(TaskState.ASSIGNED, "robot1", 2), (WAITING, "", 1)]
)
def test_a_list_that_agrees_or_is_older_than_the_order_changes_nothing(state, robot, assignment):
    rig = RobotRig()
    rig.order(GO, assignment=2)

    rig.know(GO, state, robot, assignment)
    rig.wait(STEP)

    assert rig.reports(GO)[:2] == [(STARTED, 0), (DONE, 1)]
