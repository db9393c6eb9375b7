# SPDX-License-Identifier: BSD-3-Clause
"""The window with all there is to know about one task, on a hive that says what the test says."""

from dataclasses import replace

import pytest
from python_qt_binding.QtGui import QPalette

from blackboard.auction.decision import Decision
from blackboard.consensus.task_list import TaskList
from blackboard.domain.bid import Bid
from blackboard.domain.record import TaskRecord
from blackboard.domain.task import Task, TaskState, TaskType
from fleet_manager.desk.facts import DecisionRead, ReadDecisions, TroublesRead
from fleet_manager.gui.desk import Desk
from fleet_manager.gui.task_details import TaskDetails
from hive_common.pose import Pose

WAITING = TaskRecord(Task("T1", TaskType.GA, (Pose(1.0, 2.0),)))
GIVEN = replace(WAITING, state=TaskState.ASSIGNED, robot="robot1", assignment=1)


@pytest.fixture
def details(person, link):
    """The details of T1, which is waiting."""
    desk = Desk(link)
    desk.start()
    link.say(TaskList(1, 1, (WAITING,)))
    person.wait_until(lambda: desk.hive.record("T1"))
    details = TaskDetails(desk, "T1")
    details.show()
    yield details
    desk.stop()
    details.close()


def test_the_details_ask_for_the_bids_again_when_the_task_is_given_out(person, link, details):
    assert link.sent == [ReadDecisions("T1")]
    assert details.no_bids_label.isVisible()

    link.say(TaskList(1, 2, (GIVEN,)))
    person.wait_until(lambda: "assigned" in details.stands_label.text())
    assert link.sent == [ReadDecisions("T1")] * 2


def test_the_details_show_bids_that_were_recorded_and_not_heard(person, link, details):
    link.say(TaskList(1, 2, (GIVEN,)))
    bids = (Bid("robot1", "T1", 4.0), Bid("robot2", "T1", 9.0))
    link.said.append(DecisionRead(Decision("T1", 1, 1, 1, 0.0, "robot1", bids=bids)))
    person.wait_until(lambda: details.bid_table.rowCount() == 2)

    assert details.bid_table.item(0, 0).text() == "robot1 (has it)"
    assert not details.no_bids_label.isVisible()
    assert link.sent == [ReadDecisions("T1")] * 2


def test_the_first_line_says_what_keeps_a_node_from_starting(person, link, window):
    link.said.append(TroublesRead(("robot3/robot did not start: charge is 5; allowed: 0 to 1",)))
    label = window.view.authority_label
    person.wait_until(lambda: "robot3/robot did not start: charge is 5" in label.text())
    assert "● Leader: blackboard" in label.text()
    plain = window.palette().color(QPalette.Window)
    assert label.palette().color(QPalette.Window) == plain  # red is for a hive without a leader

    link.said.append(TroublesRead(()))
    person.wait_until(lambda: "robot3" not in label.text())
