# SPDX-License-Identifier: BSD-3-Clause
from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from blackboard.domain.characteristics import RobotState, RobotStatus
from blackboard.domain.record import TaskRecord
from blackboard.domain.task import Task, TaskState, TaskType
from fleet_manager.client.rows import RobotRow, TaskRow
from fleet_manager.client.traffic import TrafficState
from fleet_manager.desk.chart import (
    MARGIN,
    SMALLEST,
    Chart,
    GoalMark,
    Labels,
    RobotMark,
    View,
    closed_zones,
    heading,
    level_for,
    levels_of,
)
from fleet_manager.desk.facts import MapBounds, MapKnown
from hive_common.grid_map import FREE, OCCUPIED, UNKNOWN, GridMap
from hive_common.palette import NO_ROBOT, robot_color
from hive_common.pose import Pose
from hive_common.zone import Zone

VIEW = View(10.0, 6.0, 50.0, 800, 600)


def task(name="T1", *goals, state=TaskState.STARTED, robot="robot2"):
    goals = goals or (Pose(1, 2, 0.5), Pose(3, 4))
    record = TaskRecord(Task(name, TaskType.GAB, goals), state, robot)
    return {name: TaskRow(record)}


def robots(state=RobotState.BUSY, **changes):
    status = RobotStatus("robot2", state, Pose(5, 6, 1), 0.87, 12.5, "T1")
    return {"robot2": replace(RobotRow(status, 0.0), **changes)}


def chart_of(tasks, rows=None, poses=None):
    chart = Chart()
    chart.take_tasks(tasks, tasks)
    chart.take_robots(rows or {}, poses or {})
    return chart


def test_the_middle_of_the_view_is_in_the_middle_of_the_widget_and_y_points_up():
    assert VIEW.pixel(10.0, 6.0) == (400.0, 300.0)
    assert VIEW.pixel(11.0, 7.0) == (450.0, 250.0)


@pytest.mark.parametrize("place", [(0.0, 0.0), (123.0, 456.0), (800.0, 600.0)])
def test_a_place_on_the_screen_is_a_point_of_the_map_and_back(place):
    assert VIEW.pixel(*VIEW.point(*place)) == pytest.approx(place)


@pytest.mark.parametrize(("width", "height"), [(800, 600), (100, 900), (900, 100)])
def test_a_map_that_is_shown_whole_touches_the_margin_of_one_side(width, height):
    view = View.fitting(MapBounds(-2.0, 0.0, 18.0, 12.0), width, height)
    left, bottom = view.pixel(-2.0, 0.0)
    right, top = view.pixel(18.0, 12.0)

    assert (left + right) / 2 == pytest.approx(width / 2)
    assert (top + bottom) / 2 == pytest.approx(height / 2)
    assert min(left, top) == pytest.approx(MARGIN)


def test_the_point_under_the_mouse_stays_there_when_the_view_is_zoomed():
    zoomed = VIEW.zoomed(1.7, 123.0, 456.0)

    assert zoomed.scale == pytest.approx(1.7 * VIEW.scale)
    assert zoomed.point(123.0, 456.0) == pytest.approx(VIEW.point(123.0, 456.0))


def test_zooming_ends_where_nothing_could_be_seen():
    for factor in (1e-9, 1e9):
        zoomed = VIEW.zoomed(factor, 0.0, 0.0)
        assert zoomed == zoomed.zoomed(factor, 0.0, 0.0)


def test_a_dragged_map_moves_with_the_mouse():
    moved = VIEW.moved(30.0, -20.0)

    assert moved.pixel(10.0, 6.0) == pytest.approx((430.0, 280.0))


def test_a_drag_upwards_heads_along_the_y_axis():
    assert heading((10.0, 50.0), (10.0, 20.0)) == pytest.approx(math.pi / 2)
    assert heading((10.0, 50.0), (40.0, 50.0)) == 0.0


def test_coarser_levels_keep_thin_walls_and_prefer_free_to_unknown():
    cells = np.full((SMALLEST + 1, 2 * SMALLEST), UNKNOWN, dtype=np.int8)
    cells[0, 0], cells[1, 3], cells[0, 2] = FREE, OCCUPIED, FREE

    fine, coarse = levels_of(GridMap(cells, 0.05, Pose(1, 2)))

    assert fine.bounds == MapKnown((fine, coarse)).levels[0].bounds
    assert coarse.cells.shape == (SMALLEST // 2 + 1, SMALLEST)
    assert coarse.resolution == pytest.approx(0.1)
    assert coarse.origin == fine.origin
    assert coarse.cells[0, :3].tolist() == [FREE, OCCUPIED, UNKNOWN]


def test_the_bounds_of_the_form_are_those_of_the_map():
    known = MapKnown(levels_of(GridMap(np.zeros((40, 60), np.int8), 0.5, Pose(1, 2))))

    assert known.bounds == MapBounds(1.0, 2.0, 31.0, 22.0)


@pytest.mark.parametrize(("scale", "number"), [(20.0, 0), (19.0, 1), (10.0, 1), (1.0, 2)])
def test_the_level_is_drawn_whose_cells_are_not_smaller_than_a_pixel(scale, number):
    levels = levels_of(GridMap(np.zeros((4 * SMALLEST, 1), np.int8), 0.05))

    assert level_for(levels, scale) == number


def test_every_goal_of_an_open_task_is_shown_with_its_letter_and_its_robots_colour():
    goals = list(chart_of(task()).goals)

    assert [goal.label for goal in goals] == ["T1 A", "T1 B"]
    assert [goal.pose for goal in goals] == [Pose(1, 2, 0.5), Pose(3, 4)]
    assert {goal.color for goal in goals} == {robot_color("robot2")}
    assert goals[0].words == "T1, goal A: started, robot2"


def test_the_goals_of_a_task_that_ended_or_went_are_gone():
    chart = chart_of(task())
    assert chart.take_tasks(["T1"], task(state=TaskState.DONE))
    assert not list(chart.goals)

    chart = chart_of(task())
    assert chart.take_tasks(["T1"], {})
    assert not list(chart.goals)


def test_what_changes_nothing_that_is_shown_is_told():
    chart = chart_of(task(), robots())

    assert not chart.take_tasks(["T1"], task())
    assert not chart.take_robots(robots(), {})
    assert chart.take_robots(robots(), {"robot2": Pose(5.1, 6)})


def test_a_robot_is_where_it_was_heard_of_last():
    chart = chart_of({}, robots(), {"robot2": Pose(7, 8, 2)})

    assert chart.robots["robot2"].pose == Pose(7, 8, 2)


@pytest.mark.parametrize("state", list(RobotState))
def test_robots_that_are_defect_or_offline_are_grey(state):
    (mark,) = chart_of({}, robots(state)).robots.values()
    is_out = state in {RobotState.DEFECT, RobotState.OFFLINE}

    assert mark.is_out is is_out
    assert mark.color == (NO_ROBOT if is_out else robot_color("robot2"))


def test_a_robot_that_is_silent_is_out():
    (mark,) = chart_of({}, robots(is_silent=True)).robots.values()

    assert mark.is_out
    assert mark.words.startswith("robot2: offline")


def test_who_points_at_a_robot_reads_its_state_load_charge_and_task():
    (mark,) = chart_of({}, robots()).robots.values()

    assert mark.words == "robot2: busy\nload 12.5 kg, battery 87 %\ntask T1"


def test_poses_that_are_no_place_are_not_shown():
    chart = chart_of(
        task("T1", Pose(math.nan, 2), Pose(3, 4)), robots(), {"robot2": Pose(1, math.inf)}
    )

    assert [goal.label for goal in chart.goals] == ["T1 B"]
    assert not chart.robots


def test_what_is_under_the_mouse_is_a_robot_before_a_goal():
    chart = chart_of(task("T1", Pose(5, 6), Pose(9, 6)), robots())

    assert isinstance(chart.mark_at(VIEW, *VIEW.pixel(5.3, 6.2)), RobotMark)
    goal = chart.mark_at(VIEW, *VIEW.pixel(9.1, 6.1))
    assert isinstance(goal, GoalMark)
    assert goal.letter == "B"
    assert chart.mark_at(VIEW, *VIEW.pixel(7, 6)) is None


def test_goals_that_are_close_together_on_the_screen_share_a_label():
    tasks = {}
    for number in range(1, 6):
        tasks |= task(f"T{number}", Pose(5, 6), Pose(9 + number, 6))
    chart = chart_of(tasks)

    (shared,) = (group for group in chart.goal_groups(VIEW) if len(group.goals) > 1)
    assert shared.label == "T1 A, T2 A, T3 A +2"
    assert (shared.column, shared.row) == VIEW.pixel(5, 6)
    assert len(chart.goal_groups(VIEW)) == 6


def test_goals_outside_the_view_are_not_painted():
    assert not chart_of(task("T1", Pose(100, 6), Pose(5, -90))).goal_groups(VIEW)


def test_without_a_map_the_view_holds_all_robots_and_goals():
    assert Chart().bounds() is None
    assert chart_of(task(), robots()).bounds() == MapBounds(-1.0, 0.0, 7.0, 8.0)


def test_labels_do_not_cover_each_other_and_are_left_out_where_there_is_no_room():
    labels = Labels()
    size = (60.0, 14.0)

    corners = [labels.place(100.0, 100.0, 16.0, size) for _ in range(4)]

    assert None not in corners
    assert len(set(corners)) == 4
    assert labels.place(100.0, 100.0, 16.0, size) is None
    assert labels.place(300.0, 100.0, 16.0, size) == (270.0, 116.0)


def test_labels_stay_within_the_width():
    labels = Labels(200.0)

    assert labels.place(5.0, 100.0, 16.0, (60.0, 14.0)) == (0.0, 116.0)
    assert labels.place(198.0, 100.0, 16.0, (60.0, 14.0)) == (140.0, 116.0)


def test_zones_are_closed_as_the_planner_tells_or_as_at_the_start():
    corners = ((0.0, 0.0), (1.0, 0.0), (1.0, 1.0))
    zones = (
        Zone(name="door", kind="keep-out", corners=corners, closed=True),
        Zone(name="hall", kind="keep-out", corners=corners),
    )

    assert closed_zones(zones, None) == {"door"}
    assert closed_zones(zones, TrafficState(1, 0.0, closed=("hall",))) == {"hall"}
