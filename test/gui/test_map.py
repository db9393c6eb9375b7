# SPDX-License-Identifier: BSD-3-Clause
"""The map in the window, on a hive that says what the test says."""

import statistics
import time
from dataclasses import replace

import numpy as np
import pytest
from python_qt_binding.QtCore import QPoint, QPointF, QSettings, Qt
from python_qt_binding.QtGui import QColor, QHelpEvent, QImage, QPalette, QWheelEvent
from python_qt_binding.QtTest import QTest
from python_qt_binding.QtWidgets import QToolTip

from blackboard.consensus.task_list import TaskList
from blackboard.domain.characteristics import RobotState, RobotStatus
from blackboard.domain.record import TaskRecord
from blackboard.domain.task import Task, TaskState, TaskType
from fleet_manager.client.traffic import TrafficState
from fleet_manager.desk.chart import levels_of
from fleet_manager.desk.facts import (
    MapKnown,
    PlacesKnown,
    PlannedPath,
    RobotPose,
    ZonesKnown,
)
from fleet_manager.desk.places import Place
from fleet_manager.gui.desk import Desk
from fleet_manager.gui.fleet_map import REPAINT_PERIOD
from fleet_manager.gui.fleet_window import FleetWindow
from hive_common.grid_map import GridMap
from hive_common.palette import robot_color
from hive_common.pose import Pose
from hive_common.zone import Zone

ROBOT = RobotStatus("robot3", RobotState.BUSY, Pose(5.0, 3.0), 0.5, 2.0, "T2", tasks=("T2",))
DEFECT = replace(ROBOT, robot_id="robot4", state=RobotState.DEFECT, pose=Pose(15.0, 9.0, 1.0))
TASK = TaskRecord(
    Task("T2", TaskType.GAB, (Pose(9.0, 2.0), Pose(12.0, 10.0, 1.0))),
    state=TaskState.STARTED,
    robot="robot3",
)
SIZE = (900, 571)  # of the map [pixel]
DOOR = Zone(name="door", kind="keep-out", corners=((1, 8), (4, 8), (4, 11), (1, 11)))


def processor_time(act):
    """Return how long this thread has a processor for something [s]."""
    begun = time.thread_time()
    act()
    return time.thread_time() - begun


def hall(resolution=0.05):
    """Return the map of a hall of 20 m x 12 m, with a wall around it."""
    cells = np.zeros((round(12 / resolution), round(20 / resolution)), np.int8)
    cells[:4], cells[-4:], cells[:, :4], cells[:, -4:] = 100, 100, 100, 100
    return MapKnown(levels_of(GridMap(cells, resolution)))


@pytest.fixture
def canvas(person, window, link):
    """The map of a hall, brought to the front."""
    link.said.append(hall())
    link.said.append(PlacesKnown((Place("dock", Pose(18.0, 1.0)),)))
    link.said.append(ZonesKnown((DOOR,)))
    link.said.append(PlannedPath("robot3", ((5.0, 3.0), (9.0, 3.0), (9.0, 2.0))))
    link.say(TaskList(1, 1, (TASK,)))
    link.say(ROBOT)
    link.say(DEFECT)
    dock = window.map.parentWidget()
    dock.raise_()
    canvas = window.map.canvas
    person.wait_until(lambda: canvas.view and len(canvas.chart.robots) == 2 and canvas.paints)
    # The form takes the width that it needs whenever it learns of something.
    canvas.setFixedSize(*SIZE)
    person.wait_until(lambda: (canvas.width(), canvas.height()) == SIZE)
    person.wait_until(lambda: (canvas.view.width, canvas.view.height) == SIZE)
    person.wait_until(lambda: canvas.view.shows(*canvas.view.pixel(0.0, 0.0)))
    return canvas


def at(canvas, x, y):
    """Return the place of the widget at which a point [m] is seen."""
    return QPoint(*map(round, canvas.view.pixel(x, y)))


def shade(canvas, x, y):
    return canvas.grab().toImage().pixelColor(at(canvas, x, y))


def drag(person, canvas, start, end):
    QTest.mousePress(canvas, Qt.LeftButton, Qt.NoModifier, start)
    for step in range(1, 5):
        QTest.mouseMove(canvas, start + (end - start) * step / 4)
        person.look()
    QTest.mouseRelease(canvas, Qt.LeftButton, Qt.NoModifier, end)
    person.look()


def turn_wheel(canvas, place, notches):
    here = QPointF(place)
    event = QWheelEvent(
        here,
        QPointF(canvas.mapToGlobal(place)),
        QPoint(),
        QPoint(0, 120 * notches),
        Qt.NoButton,
        Qt.NoModifier,
        Qt.NoScrollPhase,
        False,
    )
    canvas.wheelEvent(event)


def entry_of(window, text):
    """Return an entry of the menu View."""
    (menu,) = (action for action in window.menuBar().actions() if action.text() == "&View")
    (entry,) = (action for action in menu.menu().actions() if action.text() == text)
    return entry


def texts(editor):
    return [edit.text() for edit in editor.edits.values()]


def test_without_a_map_the_window_says_so(person, window):
    window.map.parentWidget().raise_()
    person.wait_until(lambda: window.map.canvas.paints)

    assert window.map.canvas.view is None


def test_walls_robots_paths_and_places_are_where_they_are(canvas):
    assert shade(canvas, 10.0, 6.0) == QColor("#ffffff")  # free
    assert shade(canvas, 0.1, 6.0).lightnessF() < 0.4  # a wall
    green = QColor.fromRgbF(*robot_color("robot3")).name()
    assert shade(canvas, 5.0, 3.3).name() == green  # the robot
    assert shade(canvas, 7.5, 3.0).name() == green  # its path
    assert shade(canvas, 18.0, 1.0).name() != "#ffffff"  # the dock


def test_a_zone_turns_red_when_it_is_closed(person, canvas, link):
    before = shade(canvas, 1.4, 8.4)
    link.say(TrafficState(1, 0.0, zones=("door",), closed=("door",)))
    person.wait_until(lambda: shade(canvas, 1.4, 8.4) != before)
    now = shade(canvas, 1.4, 8.4)

    assert now.red() > now.green() + 30
    assert now.red() > now.blue() + 30


def test_clicks_fill_goal_a_then_b(person, window, canvas):
    entry = window.entry
    person.choose(entry.type_box, int(TaskType.GAB))
    person.click(entry.goal_editors["A"].pick_button)
    assert canvas.cursor().shape() == Qt.CrossCursor
    pixel = 1.5 / canvas.view.scale

    person.click(canvas, at(canvas, 4.0, 5.0))
    person.click(canvas, at(canvas, 14.0, 6.0))

    for name, (x, y) in {"A": (4.0, 5.0), "B": (14.0, 6.0)}.items():
        filled = texts(entry.goal_editors[name])
        assert float(filled[0]) == pytest.approx(x, abs=pixel)
        assert float(filled[1]) == pytest.approx(y, abs=pixel)
        assert not filled[2]
    assert canvas.cursor().shape() == Qt.ArrowCursor
    assert shade(canvas, 4.0, 5.0) == canvas.palette().color(QPalette.Highlight)
    assert shade(canvas, 14.0, 6.0) == canvas.palette().color(QPalette.Highlight)


def test_a_drag_fills_a_goal_with_its_heading_and_moves_nothing(person, window, canvas):
    editor, view = window.entry.goal_editors["A"], canvas.view
    person.click(editor.pick_button)

    drag(person, canvas, at(canvas, 4.0, 5.0), at(canvas, 4.0, 8.0))

    assert float(texts(editor)[1]) == pytest.approx(5.0, abs=1.5 / view.scale)
    assert float(texts(editor)[2]) == pytest.approx(90.0, abs=1.0)
    assert canvas.view == view


def test_a_drag_from_the_goal_that_was_clicked_last_turns_it(person, window, canvas):
    editor = window.entry.goal_editors["A"]
    person.choose(window.entry.type_box, int(TaskType.GA))
    person.click(editor.pick_button)
    person.click(canvas, at(canvas, 4.0, 5.0))
    before = texts(editor)

    drag(person, canvas, at(canvas, 4.1, 5.1), at(canvas, 1.1, 5.1))

    assert texts(editor)[:2] == before[:2]
    assert abs(float(texts(editor)[2])) == pytest.approx(180.0, abs=1.0)


def test_picking_a_goal_brings_the_map_to_the_front(person, window, canvas):
    window.view.parentWidget().raise_()
    person.wait_until(lambda: canvas.visibleRegion().isEmpty())

    person.click(window.entry.goal_editors["A"].pick_button)

    person.wait_until(lambda: not canvas.visibleRegion().isEmpty())


def test_a_click_on_a_robot_selects_its_row_and_one_on_a_goal_that_of_its_task(
    person, window, canvas
):
    person.click(canvas, at(canvas, 15.0, 9.0))
    assert window.view.chosen_robots() == ["robot4"]

    person.click(canvas, at(canvas, 12.0, 10.0))
    assert window.view.chosen_tasks() == ["T2"]


def test_who_points_at_a_robot_reads_its_state(person, canvas):
    here = at(canvas, 15.0, 9.0)
    person.wait_until(lambda: not QToolTip.isVisible())
    canvas.event(QHelpEvent(QHelpEvent.ToolTip, here, canvas.mapToGlobal(here)))

    assert QToolTip.text().startswith("robot4: defect")
    QToolTip.hideText()


def test_the_wheel_zooms_a_drag_moves_and_a_double_click_shows_the_whole_map(
    person, window, canvas
):
    whole = canvas.view
    point = at(canvas, 4.0, 5.0)

    turn_wheel(canvas, point, 3)
    assert canvas.view.scale > 1.5 * whole.scale
    assert canvas.view.pixel(4.0, 5.0) == pytest.approx((point.x(), point.y()), abs=1.0)

    drag(person, canvas, point, point + QPoint(60, 30))
    assert canvas.view.pixel(4.0, 5.0) == pytest.approx((point.x() + 60, point.y() + 30), abs=1.5)

    QTest.mouseDClick(canvas, Qt.LeftButton, Qt.NoModifier, at(canvas, 5.0, 6.0))
    assert canvas.view == whole

    turn_wheel(canvas, point, 3)
    person.click(window.map.fit_button)
    assert canvas.view == whole


def test_the_second_click_of_a_double_click_on_a_goal_fills_and_moves_nothing(
    person, window, canvas
):
    turn_wheel(canvas, at(canvas, 4.0, 5.0), 1)
    editors = window.entry.goal_editors
    person.choose(window.entry.type_box, int(TaskType.GAB))
    person.click(editors["A"].pick_button)
    here = at(canvas, 4.0, 5.0)

    person.click(canvas, here)
    before = canvas.view
    QTest.mouseDClick(canvas, Qt.LeftButton, Qt.NoModifier, here)

    assert texts(editors["A"])[0]
    after = canvas.view
    # The window may still lay itself out, so that the canvas gets wider.
    assert (after.x, after.y, after.scale) == (before.x, before.y, before.scale)


def test_what_the_mouse_points_at_is_told_in_metres(person, window, canvas):
    x, y = canvas.view.point(at(canvas, 4.0, 5.0).x(), at(canvas, 4.0, 5.0).y())
    here, label = at(canvas, 4.0, 5.0), window.map.position_label

    def is_told():
        """Move there until it is told: the pointer of the screen may stand on the map, too."""
        QTest.mouseMove(canvas, here + QPoint(9, 9))
        QTest.mouseMove(canvas, here)
        return label.text() == f"x {x:.2f} m, y {y:.2f} m"

    person.wait_until(is_told)


def test_the_map_is_painted_only_for_changes_and_at_most_ten_times_a_second(person, canvas, link):
    link.said.append(RobotPose("robot3", Pose(6.0, 3.0)))
    person.wait_until(lambda: canvas.chart.robots["robot3"].pose.x == 6.0)
    beats, paints = link.beats, canvas.paints
    person.wait_until(lambda: link.beats > beats + 5)
    assert canvas.paints <= paints + 1  # that of the last change may not have been made

    begin, paints = time.monotonic(), canvas.paints
    for step in range(1, 20):
        link.said.append(RobotPose("robot3", Pose(6.0 + step / 100, 3.0)))
        beats = link.beats
        person.wait_until(lambda beats=beats: link.beats > beats)
    turns = (time.monotonic() - begin) * 1000 / REPAINT_PERIOD
    assert 2 <= canvas.paints - paints <= turns + 1


def test_a_hidden_map_follows_nothing_and_catches_up_when_it_is_shown(
    person, window, canvas, link
):
    window.map.parentWidget().hide()
    link.said.append(RobotPose("robot3", Pose(8.0, 3.0)))
    beats = link.beats
    person.wait_until(lambda: link.beats > beats + 3)
    assert canvas.chart.robots["robot3"].pose.x == 5.0

    window.map.parentWidget().show()
    person.wait_until(lambda: canvas.chart.robots["robot3"].pose.x == 8.0)


def test_a_map_of_sixteen_million_cells_does_not_stall_the_window(person, canvas, link):
    """No turn of the event loop takes as long as it takes to go through all cells once."""
    cells = np.zeros((4000, 4000), np.int8)
    cells[2000, :] = 100  # a wall of one cell
    large = MapKnown(levels_of(GridMap(cells, 0.05)))

    def shows(known):
        return canvas._shown_bounds == known.bounds  # noqa: SLF001  (nothing else tells it)

    def longest_turn():
        """Let the map come, zoom in, and return the longest time of a turn [s, processor]."""
        link.said.append(hall())
        person.wait_until(lambda: shows(hall()))
        link.said.append(large)
        paints, longest = canvas.paints, 0.0
        while canvas.paints < paints + 5 or not shows(large):
            longest = max(longest, processor_time(person.look))
            if canvas.paints > paints:
                turn_wheel(canvas, canvas.rect().center(), 1)
        canvas.fit()
        return longest

    turns = [longest_turn() for _ in range(5)]
    image = QImage(cells.data, 4000, 4000, 4000, QImage.Format_Indexed8)
    image.setColorTable([0] * 256)
    all_cells = min(
        processor_time(lambda: image.convertToFormat(QImage.Format_RGB32)) for _ in turns
    )

    assert shade(canvas, 60.0, 60.0).name() == "#ffffff"
    wall = at(canvas, 150.0, 100.025)
    column = [canvas.grab().toImage().pixelColor(wall + QPoint(0, off)) for off in (-1, 0, 1)]
    assert min(each.lightnessF() for each in column) < 0.4
    assert statistics.median(turns) < all_cells


def test_the_layout_is_reset_with_the_map_and_kept(person, window, link, tmp_path):
    dock = window.map.parentWidget()
    entry_of(window, "Map").trigger()
    assert dock.isHidden()
    window.close()
    settings = QSettings(str(tmp_path / "settings"), QSettings.IniFormat)

    again = FleetWindow(Desk(link), settings)
    assert again.map.parentWidget().isHidden()
    entry_of(again, "&Reset the layout").trigger()
    assert not again.map.parentWidget().isHidden()

    again.deleteLater()
    person.look()
