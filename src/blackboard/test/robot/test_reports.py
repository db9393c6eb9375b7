# SPDX-License-Identifier: BSD-3-Clause
"""Reports, repeated until the blackboard knows, and orders that come too late."""

from dataclasses import replace

import pytest

from blackboard.consensus.journal import MemoryJournal
from blackboard.consensus.task_list import TaskList
from blackboard.domain.record import ANY_ASSIGNMENT, Order, TaskRecord, TaskUpdate
from blackboard.domain.talker import TASK_STATE
from blackboard.domain.task import Task, TaskState, TaskType
from blackboard.robot.reports import Reports
from hive_common.pose import Pose
from hive_lab.virtual.network import Network, NetworkTalker

TASK = Task("T1", TaskType.GA, (Pose(1.0, 1.0),))
DONE = TaskUpdate("T1", TaskState.DONE, "robot1", assignment=2)
BACK = replace(DONE, state=TaskState.WAITING)
FAILED = replace(DONE, state=TaskState.FAILED)
ORDER = Order(TASK, "robot1", assignment=2)
MINE = TaskRecord(TASK, TaskState.STARTED, robot="robot1", assignment=2)
RELEASED = replace(MINE, state=TaskState.WAITING, robot="")
ANOTHER_S = replace(MINE, robot="robot2", assignment=3)
MINE_AGAIN = replace(MINE, assignment=3)
FINISHED = replace(MINE, state=TaskState.DONE)
CANCELLED = replace(MINE, state=TaskState.CANCELLED)


class Desk:
    """The reports of robot1, and what was said."""

    def __init__(self):
        self.network = Network()
        self.reports = Reports(NetworkTalker(self.network, "robot1"), "robot1", MemoryJournal())

    def know(self, record):
        self.reports.acknowledge(TaskList(1, 1, (record,)))

    def said(self):
        return [message for topic, message in self.network.heard if topic == TASK_STATE]


def repeated(report, record):
    """Return whether a report is still repeated when the list shows a record."""
    desk = Desk()
    desk.reports.add(report)
    desk.know(record)
    desk.reports.repeat()
    return len(desk.said()) == 2


def test_a_report_is_sent_at_once_and_again_until_it_is_known():
    desk = Desk()
    desk.reports.add(DONE)
    desk.reports.repeat()
    desk.reports.repeat()

    assert desk.said() == [DONE] * 3


@pytest.mark.parametrize("record", [FINISHED, CANCELLED])
@pytest.mark.parametrize("report", [DONE, BACK, FAILED])
def test_no_report_is_repeated_on_a_task_that_has_ended(report, record):
    assert not repeated(report, record)


@pytest.mark.parametrize("report", [DONE, BACK, FAILED])
def test_every_report_is_repeated_while_the_list_still_shows_the_robot_at_work(report):
    assert repeated(report, MINE)


@pytest.mark.parametrize("record", [RELEASED, ANOTHER_S, MINE_AGAIN])
def test_a_report_of_done_is_repeated_whoever_has_the_task_by_now(record):
    assert repeated(DONE, record)


@pytest.mark.parametrize("record", [RELEASED, ANOTHER_S, MINE_AGAIN])
def test_a_report_of_a_handback_is_known_once_the_assignment_is_over(record):
    assert not repeated(BACK, record)


def test_a_list_from_before_the_assignment_acknowledges_nothing():
    assert repeated(BACK, replace(MINE, robot="robot2", assignment=1))


def test_a_list_without_the_task_acknowledges_nothing():
    other = replace(FINISHED, task=replace(TASK, id="T2"))

    assert repeated(DONE, other)


def test_an_order_that_was_answered_already_is_answered_with_the_report():
    desk = Desk()
    desk.reports.add(DONE)

    assert desk.reports.answer(ORDER)
    assert desk.said() == [DONE, DONE]


def test_an_order_of_a_later_assignment_has_not_been_answered():
    desk = Desk()
    desk.reports.add(BACK)

    assert not desk.reports.answer(replace(ORDER, assignment=3))
    assert desk.said() == [BACK]


@pytest.mark.parametrize("record", [FINISHED, CANCELLED, RELEASED, ANOTHER_S, MINE_AGAIN])
def test_an_order_that_the_task_list_has_overtaken_is_answered_by_silence(record):
    desk = Desk()
    desk.know(record)

    assert desk.reports.answer(ORDER)
    assert not desk.said()


def test_an_order_for_a_task_that_the_list_has_forgotten_is_answered_by_silence():
    desk = Desk()
    desk.reports.acknowledge(TaskList(1, 1, (), earlier=2))

    assert desk.reports.answer(ORDER)
    assert not desk.reports.answer(replace(ORDER, assignment=3))
    assert not desk.said()


@pytest.mark.parametrize("record", [MINE, replace(RELEASED, assignment=1)])
def test_an_order_that_the_task_list_agrees_with_or_does_not_know_yet_stands(record):
    desk = Desk()
    desk.know(record)

    assert not desk.reports.answer(ORDER)


def test_another_hive_hears_only_what_is_done():
    desk = Desk()
    desk.reports.add(DONE)
    desk.reports.add(replace(BACK, task_id="T2"))
    desk.reports.acknowledge(TaskList(1, 1, (), "hive1"))
    desk.reports.acknowledge(TaskList(1, 1, (), "hive2"))
    said = len(desk.said())
    desk.reports.repeat()

    assert desk.said()[said:] == [replace(DONE, assignment=ANY_ASSIGNMENT)]
