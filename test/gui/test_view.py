# SPDX-License-Identifier: BSD-3-Clause
"""The task view, on a hive that says what the test says."""

from dataclasses import replace

import pytest
from python_qt_binding.QtCore import Qt
from python_qt_binding.QtGui import QPalette
from python_qt_binding.QtWidgets import QApplication

from blackboard.consensus.task_list import TaskList
from blackboard.domain.characteristics import RobotState, RobotStatus
from blackboard.domain.record import TaskRecord
from blackboard.domain.task import Task, TaskState, TaskType
from fleet_manager.desk.facts import CancelTask, PlacesKnown, SetRobotState
from fleet_manager.desk.places import Place
from fleet_manager.gui.look import Appearance, Tone, color
from fleet_manager.gui.rows_model import SHARE_ROLE
from hive_common.pose import Pose

WAITS = TaskRecord(Task("T1", TaskType.GA, (Pose(1.0, 2.0),)))
LOADED = replace(
    WAITS,
    task=Task("T2", TaskType.GPAB, (Pose(1.0, 2.0), Pose(3.0, 4.0)), 0, 2.0),
    state=TaskState.STARTED,
    robot="robot3",
    step=2,
)
ROBOT = RobotStatus("robot3", RobotState.BUSY, Pose(1.0, 2.0), 0.5, 2.0, "T2", tasks=("T2",))


@pytest.fixture
def view(person, window, link):
    """The view of two tasks and a robot."""
    link.time = 100.0
    link.say(TaskList(1, 1, (WAITS, LOADED)))
    link.say(ROBOT)
    view = window.view
    person.wait_until(lambda: view.task_rows.rowCount() == 2 and view.robot_rows.rowCount() == 1)
    return view


def test_cancelling_is_asked_about_and_a_no_keeps_the_task(person, view, link):
    person.select_row(view.task_table, "T1")
    person.press(Qt.Key_Delete, view.task_table)
    person.answer("Keep")
    assert not [each for each in link.sent if isinstance(each, CancelTask)]

    person.click(view.cancel_button)
    person.answer("Cancel T1")
    person.wait_until(lambda: CancelTask("T1") in link.sent)


def test_cancelling_a_task_with_its_load_on_board_says_what_becomes_of_it(person, view, link):
    person.select_row(view.task_table, "T2")
    person.click(view.cancel_button)

    told = person.answer("Keep")

    assert "robot3 carries the load of T2 (2 kg): it stops where it is" in told
    assert link.sent == []


def test_taking_a_robot_out_of_service_is_asked_about(person, view, link):
    person.select_row(view.robot_table, "robot3")
    person.click(view.defect_button)
    told = person.answer("Take out of service")

    assert "robot3 carries the load of T2" in told
    assert SetRobotState("robot3", "defect") in link.sent


def test_what_needs_a_person_stands_at_the_top(person, view, link):
    label = view.needs_label
    person.wait_until(lambda: label.text() == "✔ Nothing needs you.")

    link.say(replace(ROBOT, state=RobotState.DEFECT, reason="blocked"))
    link.say(TaskList(1, 2, (replace(WAITS, reason="too heavy"), LOADED)))

    person.wait_until(lambda: label.text() == "✖ robot3 defect   ⚠ T1 waits: too heavy")


def test_open_tasks_are_shown_the_most_urgent_first(person, view, link):
    urgent = replace(WAITS, task=replace(WAITS.task, id="T3", priority=9))
    done = replace(WAITS, task=replace(WAITS.task, id="T4", priority=10), state=TaskState.DONE)
    link.say(TaskList(1, 2, (WAITS, LOADED, urgent, done)))
    person.wait_until(lambda: view.task_rows.rowCount() == 4)

    shown = [view.shown_tasks.index(row, 0).data() for row in range(view.shown_tasks.rowCount())]
    assert shown == ["T3", "T1", "T2"]
    assert view.count_label.text() == "3 of 4 tasks"


def test_the_battery_bar_of_a_selected_robot_keeps_its_colour(person, view):
    person.select_row(view.robot_table, "robot3")
    index = view.shown_robots.index(0, 2)
    assert index.data(SHARE_ROLE) == 0.5
    picture = view.robot_table.viewport().grab(view.robot_table.visualRect(index)).toImage()
    shades = {
        picture.pixelColor(x, y).name()
        for x in range(0, picture.width(), 2)
        for y in range(0, picture.height(), 2)
    }

    assert color(Tone.CALM, view.palette()).name() in shades


def test_a_load_that_was_left_on_board_is_sent_to_a_place(person, view, link):
    link.said.append(PlacesKnown((Place("dock", Pose(1.5, 2.5, 0.0)),)))
    link.say(replace(ROBOT, state=RobotState.DEFECT, task_id="", tasks=()))
    person.select_row(view.robot_table, "robot3")
    person.wait_until(view.unload_button.isEnabled)
    person.click(view.unload_button)
    person.wait_until(QApplication.activeModalWidget)
    QApplication.activeModalWidget().accept()
    person.wait_until(lambda: view.window().isActiveWindow() or view.window().activateWindow())

    person.wait_until(lambda: SetRobotState("robot3", "put_down 1.500 2.500 0.0000") in link.sent)


def test_only_a_robot_with_a_load_left_on_board_is_sent_to_put_it_down(person, view, link):
    link.said.append(PlacesKnown((Place("dock", Pose(1.5, 2.5, 0.0)),)))
    person.wait_until(lambda: view._desk.places)  # noqa: SLF001  (without places it is off anyway)
    person.select_row(view.robot_table, "robot3")

    assert not view.unload_button.isEnabled()


def test_the_line_of_needs_is_readable_after_the_appearance_has_changed(person, window, view):
    person.wait_until(view.needs_label.text)
    shades = []
    for appearance in (Appearance.LIGHT, Appearance.DARK):
        window.appear(appearance)
        person.look()
        ink = view.needs_label.palette().color(QPalette.WindowText)
        shades.append((ink.name(), color(Tone.GOOD, view.palette()).name()))
    window.appear(Appearance.LIGHT)

    assert all(shown == wanted for shown, wanted in shades)
    assert shades[0] != shades[1]
