# SPDX-License-Identifier: BSD-3-Clause
"""Every field, filled in wrongly by keys; nothing of that may be sent."""

from __future__ import annotations

import pytest
from python_qt_binding.QtCore import QSettings, Qt
from python_qt_binding.QtWidgets import QApplication

from blackboard.domain.characteristics import RobotState, RobotStatus
from blackboard.domain.record import TaskUpdate
from blackboard.domain.task import TaskState, TaskType
from fleet_manager.desk.facts import Clicked, PlacesKnown, PostTask
from fleet_manager.desk.places import Place
from fleet_manager.gui.desk import Desk
from fleet_manager.gui.fleet_window import FleetWindow
from hive_common.pose import Pose

WRONG = {
    "empty": "",
    "text": "fast",
    "negative": "-99999",
    "huge": "9" * 40,
    "nan": "nan",
    "200 characters": "x" * 200,
    "emoji": "🤖",
}
ALLOWED = {("id_edit", WRONG[kind]) for kind in ("text", "negative", "huge", "nan")}
ALLOWED |= {("heading_edit", "")}
NUMBERS = ["priority_edit", "payload_edit", "x_edit", "y_edit", "heading_edit"]


def field_of(entry, name):
    return getattr(entry, name, None) or getattr(entry.goal_editors["A"], name)


def fill_in(person, entry):
    """Fill the form in rightly, and do not send it."""
    goal = entry.goal_editors["A"]
    for edit, text in ((goal.x_edit, "3"), (goal.y_edit, "4"), (goal.heading_edit, "90")):
        person.write(edit, text)


@pytest.mark.parametrize("typed", WRONG.values(), ids=WRONG)
@pytest.mark.parametrize("name", ["id_edit", *NUMBERS])
def test_what_a_field_does_not_allow_is_marked_there_and_not_sent(
    person, window, link, name, typed
):
    if (name, typed) in ALLOWED:
        pytest.skip("allowed there")
    entry = window.entry
    fill_in(person, entry)
    field = field_of(entry, name)
    person.write(field, typed)
    person.press(Qt.Key_Return)

    assert link.sent == []
    assert field.property("wrong")
    marked = [edit for edit in entry.findChildren(type(field)) if edit.property("wrong")]
    assert marked == [field]
    assert entry.message_label.isVisible()
    assert window.focusWidget() is field


def test_a_filled_form_is_sent_with_enter_and_emptied(person, window, link):
    entry = window.entry
    fill_in(person, entry)
    person.press(Qt.Key_Return)
    person.wait_until(lambda: link.sent)  # a window that was held up has to hear the hive first

    (command,) = link.sent
    assert isinstance(command, PostTask)
    assert (command.task.id, command.task.type) == ("T1", TaskType.GA)
    assert entry.goal_editors["A"].x_edit.text() == ""
    assert entry.id_edit.text() == "T2"


def test_a_task_that_will_be_split_is_asked_about_and_a_no_keeps_the_form(person, window, link):
    link.say(RobotStatus("robot1", RobotState.IDLE, Pose(1, 2), 1.0, carries=(100.0,) * 4))
    person.wait_until(lambda: window.view.robot_rows.rowCount() == 1)
    fill_in(person, window.entry)
    person.write(window.entry.payload_edit, "250")
    person.press(Qt.Key_Return)

    told = person.answer("Back to the form")
    assert "robot1 carries most: 100 kg); the hive will split T1 into 3 parts" in told
    assert window.entry.payload_edit.text() == "250"
    assert link.sent == []

    person.press(Qt.Key_Return, window.entry.payload_edit)
    person.answer("Send T1")
    person.wait_until(lambda: link.sent)


def test_escape_empties_the_form(person, window):
    entry = window.entry
    fill_in(person, entry)
    person.press(Qt.Key_Escape)

    assert entry.goal_editors["A"].typed().is_empty


@pytest.mark.parametrize("kind", TaskType)
def test_only_the_goals_that_the_type_takes_can_be_filled_in(person, window, kind):
    person.choose(window.entry.type_box, int(kind))

    usable = {name for name, editor in window.entry.goal_editors.items() if editor.isEnabled()}
    expected = {"GA": "A", "GAB": "ABC", "GPA": "A", "GPAB": "AB"}[kind.name]
    assert usable == set(expected)


def test_a_mistake_is_marked_as_soon_as_the_field_is_left(person, window):
    goal = window.entry.goal_editors["A"]
    person.write(goal.x_edit, "north")
    assert not goal.mistake_label.isVisible()

    person.press(Qt.Key_Tab)
    assert "x “north” is not a number" in goal.mistake_label.text()

    person.write(goal.x_edit, "3")
    assert not goal.mistake_label.isVisible()


def test_what_the_blackboard_refuses_shows_its_reason_and_can_be_mended(person, window, link):
    fill_in(person, window.entry)
    person.press(Qt.Key_Return)
    link.say(TaskUpdate("T1", TaskState.REJECTED, reason="goal A is in a wall", epoch=1))
    sent = window.entry.sent_list
    person.wait_until(lambda: "rejected" in sent.item(0).text())
    assert "T1: rejected: goal A is in a wall" in sent.item(0).text()

    sent.setFocus()
    sent.setCurrentRow(0)
    person.press(Qt.Key_Return, sent)
    assert window.entry.goal_editors["A"].x_edit.text() == "3"
    assert window.entry.id_edit.text() == "T1"


def test_a_place_fills_the_coordinates(person, window, link):
    link.said.append(PlacesKnown((Place("dock", Pose(1.5, 2.5, 0.0)),)))
    goal = window.entry.goal_editors["A"]
    person.wait_until(lambda: goal.place_box.count() == 2)
    person.choose(goal.place_box, 1)

    assert (goal.x_edit.text(), goal.y_edit.text()) == ("1.5", "2.5")


def test_clicks_on_the_map_fill_the_armed_goals_one_after_the_other(person, window, link):
    entry = window.entry
    person.choose(entry.type_box, int(TaskType.GAB))
    person.click(entry.goal_editors["A"].pick_button)
    link.said.append(Clicked(Pose(1.0, 2.0), "map", has_heading=False))
    person.wait_until(entry.goal_editors["B"].pick_button.isChecked)
    link.said.append(Clicked(Pose(3.0, 4.0, 1.0), "map", has_heading=True))
    person.wait_until(entry.goal_editors["B"].heading_edit.text)

    assert entry.goal_editors["A"].typed().x == "1"
    assert entry.goal_editors["B"].heading_edit.text() == "57.296"


def test_every_field_and_button_is_reached_with_the_tab_key(person, window):
    stops = [window.view.filter_edit, window.view.task_table, window.view.robot_table]

    for stop in stops:
        person.reach(stop)


def test_the_tab_key_goes_through_the_form_from_the_top_to_the_bottom(person, window, link):
    link.said.append(PlacesKnown((Place("dock", Pose(1.5, 2.5, 0.0)),)))
    entry = window.entry
    person.choose(entry.type_box, int(TaskType.GAB))
    person.wait_until(lambda: entry.goal_editors["C"].place_box.count() == 2)
    entry.payload_edit.setFocus()
    expected = [each for editor in entry.goal_editors.values() for each in editor.tab_stops]
    passed = []
    for _ in range(len(expected) + 3):
        person.press(Qt.Key_Tab)
        passed.append(QApplication.focusWidget())

    assert passed == [*expected, entry.send_button, entry.clear_button, entry.sent_list]


@pytest.mark.parametrize("field", ["x_edit", "y_edit", "heading_edit"])
def test_a_form_that_is_sent_from_any_field_is_empty_and_without_a_mistake(
    person, window, link, field
):
    fill_in(person, window.entry)
    person.reach(field_of(window.entry, field))
    person.press(Qt.Key_Return)
    person.wait_until(lambda: link.sent)

    goal = window.entry.goal_editors["A"]
    assert not goal.mistake_label.isVisible()
    assert not any(edit.property("wrong") for edit in goal.edits.values())


def test_layout_and_choices_are_kept_between_starts(person, window, link, tmp_path):
    window.view.show_box.setFocus()
    person.choose(window.view.show_box, 1)
    window.view.task_table.horizontalHeader().resizeSection(1, 321)
    window.close()

    settings = QSettings(str(tmp_path / "settings"), QSettings.IniFormat)
    assert settings.value("view/states") == "all tasks"  # by name: choices may come and go
    again = FleetWindow(Desk(link), settings)
    assert again.view.show_box.currentText() == "all tasks"
    assert again.view.task_table.columnWidth(1) == 321
    again.deleteLater()
