# SPDX-License-Identifier: BSD-3-Clause
"""A robot whose body is out of reach, such as an AGV that has lost its connection."""

import pytest

from blackboard.domain.characteristics import RobotState
from blackboard.domain.record import OrderKind
from blackboard.domain.talker import ROBOT_STATUS, TASK_STATE
from blackboard.domain.task import Task, TaskState, TaskType
from blackboard.robot.contact import Contact
from hive_common.pose import Pose
from hive_lab.virtual.harness import STEP, RobotHarness

A, B = Pose(6.0, 0.0), Pose(12.0, 0.0)
ROUND = Task("T1", TaskType.GAB, (A, B), payload=5.0)
OTHER = Task("T2", TaskType.GA, (A,))
STARTED, WAITING = TaskState.STARTED, TaskState.WAITING


@pytest.fixture
def harness():
    """A robot under way, whose body was just cut off."""
    harness = RobotHarness()
    harness.order(ROUND)
    harness.wait(STEP / 2)
    harness.robot.note_contact(Contact.BROKEN)
    return harness


def test_it_keeps_its_task_until_it_is_lost_whatever_it_is_told(harness):
    harness.order(ROUND, kind=OrderKind.HAND_BACK)
    harness.set_state("defect")
    harness.wait(STEP / 4)

    assert harness.status.tasks == ("T1",)
    assert {state for state, _ in harness.reports(ROUND)} == {STARTED}


def test_it_does_what_it_was_told_meanwhile_once_its_body_is_back(harness):
    harness.set_state("defect")
    harness.robot.note_contact(Contact.KEPT)

    assert harness.reports(ROUND)[-1][0] is WAITING
    assert harness.status.tasks == ()


def test_it_says_how_it_is_until_it_is_lost_and_nothing_then(harness):
    known = len(harness.said(ROBOT_STATUS))
    harness.wait(2.0)
    until_lost = len(harness.said(ROBOT_STATUS))
    harness.robot.note_contact(Contact.LOST)
    harness.wait(20.0)

    assert until_lost > known
    assert len(harness.said(ROBOT_STATUS)) == until_lost
    assert harness.said(TASK_STATE)[-1].state is STARTED


def test_it_is_heard_again_when_its_body_is_found(harness):
    harness.robot.note_contact(Contact.LOST)
    harness.wait(5.0)
    known = len(harness.said(ROBOT_STATUS))
    harness.robot.note_contact(Contact.KEPT)

    assert len(harness.said(ROBOT_STATUS)) > known
    assert harness.status.state is RobotState.BUSY
