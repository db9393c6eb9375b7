# SPDX-License-Identifier: BSD-3-Clause
"""The windows on the running hive of the lab, used by keys and mouse."""

from __future__ import annotations

import contextlib
import os
import re
import signal

import pytest
from python_qt_binding.QtCore import Qt

from blackboard.domain.task import TaskType
from fleet_manager.gui.task_details import TaskDetails
from hive_lab.runner.limits import CASE

pytestmark = [
    # rospy leaves sockets to be closed by the garbage collector.
    pytest.mark.filterwarnings("ignore::pytest.PytestUnraisableExceptionWarning"),
    pytest.mark.timeout(CASE),  # the first test waits for the whole hive to come up
]

HERE, FAR = ("4.5", "3"), ("14", "3")


@pytest.fixture
def entry(hive_window):
    return hive_window.entry


@pytest.fixture
def view(hive_window):
    return hive_window.view


def answer(entry):
    """Return what became of the task that was sent last."""
    return entry.sent_list.item(0).text()


def cell(table, name, column):
    """Return a cell of the row whose first cell has this text."""
    model = table.model()
    for row in range(model.rowCount()):
        if model.index(row, 0).data().strip() == name:
            return model.index(row, column).data()
    return ""


def started(person, view, task):
    """Wait until a robot is on its way."""
    person.wait_until(
        lambda: person.state_of(view, task) == "started", telling=lambda: log_of(view)[:9]
    )


def log_of(view):
    return [view.log.index(row).data() for row in range(view.log.rowCount())]


def test_a_task_typed_by_a_person_is_taken_in_assigned_started_and_done(person, entry, view):
    task = person.give_task(entry, TaskType.GA, HERE, priority="5")
    person.wait_until(lambda: answer(entry) == f"✔ {task}: accepted")
    person.wait_until(lambda: person.state_of(view, task) == "done")

    told = " ".join(reversed(log_of(view)))
    for words in (
        f"task {task} is on the list of robot",
        f"task {task} is under way by robot",
        f"task {task} is done by robot",
    ):
        assert words in told
    assert cell(view.task_table, task, 5) == "100 %"


def test_a_goal_in_a_wall_is_refused_with_its_reason_beside_the_form(person, entry, view):
    task = person.give_task(entry, TaskType.GA, ("0", "0"))
    person.wait_until(lambda: "rejected" in answer(entry))

    assert "goal A" in answer(entry)
    person.wait_until(lambda: person.state_of(view, task) == "rejected")


def test_the_details_show_the_bids_that_decided_it(person, entry, view, hive_window):
    def opened(task):
        """Try until a click has met the row, which moves while tasks come and go."""
        if not hive_window.findChildren(TaskDetails):
            person.select_row(view.task_table, task)
            person.click(view.details_button)
        return hive_window.findChildren(TaskDetails)

    def decided_by(task):
        """Return whose bids the details of a task show."""
        person.wait_until(lambda: person.state_of(view, task) not in {None, "waiting"})
        person.wait_until(lambda: opened(task))
        (details,) = hive_window.findChildren(TaskDetails)
        table = details.bid_table
        person.wait_until(table.rowCount)
        robots = [table.item(row, 0).text() for row in range(table.rowCount())]
        details.close()
        person.wait_until(lambda: not hive_window.findChildren(TaskDetails))
        return robots

    robots = decided_by(person.give_task(entry, TaskType.GA, HERE))

    assert len(robots) == 4
    assert any(robot.endswith("(has it)") for robot in robots)


def test_a_task_is_cancelled_with_the_delete_key(person, entry, view, slowly):
    with slowly():
        task = person.give_task(entry, TaskType.GAB, FAR, HERE)
        started(person, view, task)
        person.select_row(view.task_table, task)
        person.press(Qt.Key_Delete, view.task_table)
        person.answer(f"Cancel {task}")

        person.wait_until(lambda: person.state_of(view, task) == "cancelled")


def test_the_task_of_a_robot_that_is_set_defect_moves_on_to_another(person, entry, view, slowly):
    with slowly():
        task = person.give_task(entry, TaskType.GAB, FAR, HERE)
        started(person, view, task)
        robot = cell(view.task_table, task, 3)
        person.select_row(view.robot_table, robot)
        person.click(view.defect_button)
        person.answer("out of service")
        person.wait_until(lambda: "defect" in cell(view.robot_table, robot, 1))

        person.wait_until(lambda: cell(view.task_table, task, 3) not in {robot, "–"})
    person.click(view.service_button)
    person.wait_until(lambda: "defect" not in cell(view.robot_table, robot, 1))
    person.wait_until(lambda: person.state_of(view, task) == "done")


def test_the_same_is_sent_again_under_a_new_id(person, entry, view):
    task = person.give_task(entry, TaskType.GA, HERE)
    person.wait_until(lambda: person.state_of(view, task) is not None)
    person.select_row(view.task_table, task)
    before = view.task_rows.rowCount()
    person.click(view.again_button)

    person.wait_until(lambda: view.task_rows.rowCount() == before + 1)


@contextlib.contextmanager
def frozen(processes):
    """Stop processes for a while; they do not know it."""
    for process in processes:
        os.kill(process, signal.SIGSTOP)
    try:
        yield
    finally:
        for process in processes:
            os.kill(process, signal.SIGCONT)


def test_the_sign_comes_and_goes_with_the_blackboards_and_a_kept_task_is_sent(
    person, entry, view, hive
):
    members = ["/blackboard", *(f"/robot{number}/robot" for number in range(1, 5))]
    with frozen([hive.process_of(member) for member in members]):
        person.wait_until(lambda: "No leader" in view.authority_label.text())
        task = person.give_task(entry, TaskType.GA, HERE)
        # Heartbeats that came while this program was held up may be heard first.
        person.wait_until(lambda: "kept here" in answer(entry))

    person.wait_until(lambda: "● Leader: " in view.authority_label.text())
    person.wait_until(lambda: answer(entry) == f"✔ {task}: accepted")


def carrier(person, view):
    """Return who carries the blackboard, once a backup stands by."""

    def named():
        return re.search(r"Leader: (\S+).*Backup: (?!none\b)", view.authority_label.text())

    person.wait_until(named)
    return named()[1]


def test_the_view_goes_on_when_the_blackboard_is_killed_and_a_robot_takes_over(
    person, entry, view, hive
):
    carrier(person, view)
    before = person.give_task(entry, TaskType.GAB, FAR, HERE)
    person.wait_until(lambda: answer(entry) == f"✔ {before}: accepted")
    name = carrier(person, view)
    os.kill(hive.process_of(f"/{name}"), signal.SIGKILL)
    after = person.give_task(entry, TaskType.GA, HERE)

    person.wait_until(lambda: answer(entry) == f"✔ {after}: accepted")
    person.wait_until(lambda: f"Leader: {name} " not in view.authority_label.text())
    leads = "is the leader, epoch"
    person.wait_until(
        lambda: any(leads in line and f" {name} " not in line for line in log_of(view))
    )
    for task in (before, after):
        person.wait_until(lambda task=task: person.state_of(view, task) == "done")


@pytest.mark.usefixtures("hive_window")
def test_after_all_that_the_event_loop_has_not_waited_for_the_network(person):
    assert person.connections == ()
