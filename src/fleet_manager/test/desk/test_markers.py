# SPDX-License-Identifier: BSD-3-Clause
from __future__ import annotations

import math

from blackboard.domain.characteristics import RobotState, RobotStatus
from blackboard.domain.record import TaskRecord
from blackboard.domain.task import Task, TaskState, TaskType
from fleet_manager.client.rows import RobotRow, TaskRow
from fleet_manager.desk.markers import (
    LETTER_HEIGHT,
    PLACE_BELOW,
    REPEATED_DELETIONS,
    MarkerBoard,
    Shape,
)
from hive_common.palette import NO_ROBOT, robot_color
from hive_common.pose import Pose


def tasks(state=TaskState.STARTED, robot="robot2"):
    task = Task("T1", TaskType.GAB, (Pose(1, 2, 0.5), Pose(3, 4)))
    return {"T1": TaskRow(TaskRecord(task, state, robot))}


def robots(pose=Pose(5, 6, 1)):  # noqa: B008  (a frozen value)
    status = RobotStatus("robot2", RobotState.BUSY, pose, 0.87, 12.5, "T1")
    return {"robot2": RobotRow(status, 0.0)}


def shown(board, *args):
    markers, gone = board.update(*args)
    return {marker.name: marker for marker in markers}, gone


def test_every_goal_of_an_open_task_has_an_arrow_with_its_heading_and_its_robots_colour():
    markers, _ = MarkerBoard().update(tasks(), {}, {})

    arrows = [marker for marker in markers if marker.shape is Shape.ARROW]
    assert [arrow.pose for arrow in arrows] == [Pose(1, 2, 0.5), Pose(3, 4)]
    assert {arrow.color for arrow in arrows} == {robot_color("robot2")}
    texts = [marker.text for marker in markers if marker.shape is Shape.TEXT]
    assert texts == ["T1 A", "T1 B"]


def test_a_task_without_a_robot_is_grey():
    markers, _ = MarkerBoard().update(tasks(TaskState.WAITING, ""), {}, {})

    assert markers[0].color == NO_ROBOT


def test_the_markers_of_a_task_are_deleted_when_it_is_done():
    board = MarkerBoard()
    before, _ = shown(board, tasks(), {}, {})
    after, gone = shown(board, tasks(TaskState.DONE), {}, {})

    assert after == {}
    assert set(gone) == set(before)


def test_a_deletion_is_repeated_for_a_while_and_then_forgotten():
    board = MarkerBoard()
    board.update(tasks(), {}, {})
    deletions = [len(board.update({}, {}, {})[1]) for _ in range(REPEATED_DELETIONS + 1)]

    assert deletions == [4] * REPEATED_DELETIONS + [0]


def test_what_comes_back_is_not_deleted():
    board = MarkerBoard()
    board.update(tasks(), {}, {})
    board.update({}, {}, {})

    assert board.update(tasks(), {}, {})[1] == []


def test_a_marker_keeps_its_number_while_others_come_and_go():
    board = MarkerBoard()
    before, _ = shown(board, tasks(), {}, {})
    after, _ = shown(board, tasks(), robots(), {})

    assert set(before) < set(after)


def test_a_robot_shows_its_name_state_load_and_battery():
    markers, _ = MarkerBoard().update({}, robots(), {})

    texts = [marker.text for marker in markers if marker.shape is Shape.TEXT]
    assert texts == ["robot2: busy\nload 12.5 kg, battery 87 %"]


def test_a_path_is_a_line_in_its_robots_colour_and_goes_when_it_is_empty():
    board = MarkerBoard()
    (line,), _ = board.update({}, {}, {"robot2": ((0.0, 0.0), (1.0, 1.0))})
    _, gone = board.update({}, {}, {"robot2": ()})

    assert (line.shape, line.points) == (Shape.LINE, ((0.0, 0.0), (1.0, 1.0)))
    assert line.color == robot_color("robot2")
    assert gone == [line.name]


def test_what_has_no_place_is_not_shown():
    markers, _ = MarkerBoard().update({}, robots(Pose(math.nan, 0)), {})

    assert markers == []


def test_robots_of_the_default_fleet_have_different_colours():
    colors = {robot_color(f"robot{number}") for number in range(1, 5)}

    assert len(colors) == 4
    assert robot_color("forklift") == robot_color("forklift")


def test_the_labels_of_goals_at_the_same_place_stand_below_each_other():
    one = TaskRecord(Task("T1", TaskType.GA, (Pose(1, 2),)))
    other = TaskRecord(Task("T2", TaskType.GA, (Pose(1, 2),)))
    markers, _ = MarkerBoard().update({"T1": TaskRow(one), "T2": TaskRow(other)}, {}, {})

    first, second = (marker.pose for marker in markers if marker.shape is Shape.TEXT)
    assert first.y - second.y >= LETTER_HEIGHT


def test_a_robot_that_tells_its_place_oftener_than_it_reports_is_shown_there():
    markers, _ = MarkerBoard().update({}, robots(), {}, {"robot2": Pose(8, 9)})

    assert markers[0].pose == Pose(8, 9)


def test_nothing_is_kept_of_names_whose_markers_are_deleted_and_no_number_is_used_twice():
    board, numbers = MarkerBoard(), []
    for _ in range(3):
        markers, _ = board.update({}, robots(), {})
        numbers += {marker.number for marker in markers}
        for _ in range(REPEATED_DELETIONS + 1):
            board.update({}, {}, {})

        assert board._numbers == {}  # noqa: SLF001  (what it keeps)

    assert numbers == [0, 1, 2]


def test_the_places_of_the_building_have_their_names():
    markers, _ = MarkerBoard().update({}, {}, {}, places={"dock": Pose(3.0, 4.0, 1.0)})

    (name,) = markers
    assert (name.space, name.text) == ("place names", "dock")
    assert (name.pose.x, name.pose.y) == (3.0, 4.0 - PLACE_BELOW)
