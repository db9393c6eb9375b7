# SPDX-License-Identifier: BSD-3-Clause
"""What the map in the window shows, and where on the screen.

Pixels count from the upper left corner of the widget, to the right and down.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from blackboard.domain.characteristics import RobotState
from blackboard.domain.task import goal_name, used_goals
from fleet_manager.client import formats
from fleet_manager.desk.facts import MapBounds
from hive_common.grid_map import UNKNOWN, GridMap
from hive_common.palette import NO_ROBOT, robot_color

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator, Mapping, Sequence

    from fleet_manager.client.rows import RobotRow, TaskRow
    from fleet_manager.client.traffic import TrafficState
    from hive_common.palette import Color
    from hive_common.pose import Pose
    from hive_common.zone import Zone

SMALLEST = 512  # cells of a side, below which a map is not made coarser
MARGIN = 12  # around a map that is shown whole [pixel]
NARROWEST, WIDEST = 0.02, 2000.0  # scales of a view [pixel/m]
AROUND = 2.0  # shown around things where no map is known [m]

ROBOT_RADIUS = 0.45  # as in RViz [m]
SMALLEST_ROBOT = 7.0  # radius [pixel]
REACH = 10.0  # how far from a goal a click still means it [pixel]
TOGETHER = 14  # goals in one square of this side share an arrow and a label [pixel]
NAMED = 3  # of the goals that share a label
LABEL_CELL = 6  # width of the cells in which labels are kept apart [pixel]

_OUT = (RobotState.DEFECT, RobotState.OFFLINE)


def levels_of(grid: GridMap) -> tuple[GridMap, ...]:
    """Return a map and its coarser levels, each with half the cells a side, for quick drawing.

    A coarse cell is occupied where any of its four is, so that thin walls stay.
    """
    cells = np.ascontiguousarray(grid.cells)
    levels = [GridMap(cells, grid.resolution, grid.origin)]
    while max(levels[-1].cells.shape) > SMALLEST:
        levels.append(_halved(levels[-1]))
    return tuple(levels)


def _halved(grid: GridMap) -> GridMap:
    rows, columns = grid.cells.shape
    edge = ((0, rows % 2), (0, columns % 2))
    cells = (
        np.pad(grid.cells, edge, constant_values=UNKNOWN)
        if rows % 2 or columns % 2
        else (grid.cells)
    )
    pairs = np.maximum(cells[::2], cells[1::2])
    return GridMap(np.maximum(pairs[:, ::2], pairs[:, 1::2]), 2 * grid.resolution, grid.origin)


def level_for(levels: Sequence[GridMap], scale: float) -> int:
    """Return the number of the finest level whose cells are not smaller than a pixel.

    Args:
        levels: Those of `levels_of`.
        scale: Of the view [pixel/m].
    """
    fits = (n for n, level in enumerate(levels) if level.resolution * scale >= 1.0)
    return next(fits, len(levels) - 1)


@dataclass(frozen=True, slots=True)
class View:
    """The part of the map that a widget shows."""

    x: float  # of the middle [m, map frame]
    y: float  # of the middle [m, map frame]
    scale: float  # [pixel/m]
    width: int  # of the widget [pixel]
    height: int  # of the widget [pixel]

    @classmethod
    def fitting(cls, bounds: MapBounds, width: int, height: int) -> View:
        """Return the view of a widget, width and height [pixel], in which all can be seen."""
        x, y = (bounds.x_min + bounds.x_max) / 2, (bounds.y_min + bounds.y_max) / 2
        across = max(width - 2 * MARGIN, 1) / max(bounds.x_max - bounds.x_min, 1e-3)
        up = max(height - 2 * MARGIN, 1) / max(bounds.y_max - bounds.y_min, 1e-3)
        return cls(x, y, _scale(min(across, up)), width, height)

    def pixel(self, x: float, y: float) -> tuple[float, float]:
        """Return where a point [m, map frame] is seen."""
        return (
            self.width / 2 + (x - self.x) * self.scale,
            self.height / 2 - (y - self.y) * self.scale,
        )

    def point(self, column: float, row: float) -> tuple[float, float]:
        """Return which point [m, map frame] is seen at a place [pixel]."""
        return (
            self.x + (column - self.width / 2) / self.scale,
            self.y - (row - self.height / 2) / self.scale,
        )

    def shows(self, column: float, row: float, margin: float = 0.0) -> bool:
        """Return whether a place [pixel] is in the widget, or within a margin [pixel] of it."""
        return -margin <= column <= self.width + margin and -margin <= row <= self.height + margin

    def zoomed(self, factor: float, column: float, row: float) -> View:
        """Return the view enlarged by a factor; the point at a place [pixel] stays there."""
        x, y = self.point(column, row)
        scale = _scale(self.scale * factor)
        share = self.scale / scale
        return replace(self, x=x + (self.x - x) * share, y=y + (self.y - y) * share, scale=scale)

    def moved(self, columns: float, rows: float) -> View:
        """Return the view after the map was dragged to the right and down [pixel]."""
        return replace(self, x=self.x - columns / self.scale, y=self.y + rows / self.scale)

    def resized(self, width: int, height: int) -> View:
        """Return the view of a widget of another size [pixel], around the same middle."""
        return replace(self, width=width, height=height)


def _scale(wanted: float) -> float:
    return min(max(wanted, NARROWEST), WIDEST)


def heading(start: tuple[float, float], end: tuple[float, float]) -> float:
    """Return the heading [rad, map frame] of a drag from one place [pixel] to another."""
    return math.atan2(start[1] - end[1], end[0] - start[0])


@dataclass(frozen=True, slots=True)
class RobotMark:
    """A robot as the map shows it."""

    name: str
    pose: Pose  # [map frame]
    color: Color  # grey where the robot is out
    is_out: bool  # defect or offline
    words: str  # its state, for a person who points at it


@dataclass(frozen=True, slots=True)
class GoalMark:
    """A goal of an open task as the map shows it."""

    task_id: str
    letter: str
    pose: Pose  # [map frame]
    color: Color  # of the robot that has the task
    words: str  # its task's state, for a person who points at it

    @property
    def label(self) -> str:
        """The task's id and the goal's letter."""
        return f"{self.task_id} {self.letter}"


@dataclass(frozen=True, slots=True)
class GoalGroup:
    """Goals that are drawn as one, because they are that close together on the screen."""

    column: float  # where it is [pixel]
    row: float  # where it is [pixel]
    goals: tuple[GoalMark, ...]  # at least one

    @property
    def label(self) -> str:
        """The names of the first goals, and how many more there are."""
        more = len(self.goals) - NAMED
        names = ", ".join(goal.label for goal in self.goals[:NAMED])
        return f"{names} +{more}" if more > 0 else names


class Chart:
    """The robots, and the goals of open tasks, that the map shows."""

    def __init__(self) -> None:
        self.robots: dict[str, RobotMark] = {}  # by name
        self._goals: dict[str, tuple[GoalMark, ...]] = {}  # by task

    @property
    def goals(self) -> Iterator[GoalMark]:
        """The goals of all open tasks."""
        return (goal for goals in self._goals.values() for goal in goals)

    def take_tasks(self, names: Iterable[str], rows: Mapping[str, TaskRow]) -> bool:
        """Take in tasks that came, changed or went, and return whether the map shows it."""
        changed = False
        for name in names:
            row = rows.get(name)
            goals = _goal_marks(row) if row is not None and row.is_open else ()
            changed |= goals != self._goals.get(name, ())
            if goals:
                self._goals[name] = goals
            else:
                self._goals.pop(name, None)
        return changed

    def take_robots(self, rows: Mapping[str, RobotRow], poses: Mapping[str, Pose]) -> bool:
        """Take in all robots as they are now, and return whether the map shows a change.

        `poses` [map frame] are newer than those in the robots' reports.
        """
        marks = (_robot_mark(row, poses.get(name, row.status.pose)) for name, row in rows.items())
        robots = {mark.name: mark for mark in marks if mark.pose.is_finite}
        changed = robots != self.robots
        self.robots = robots
        return changed

    def bounds(self) -> MapBounds | None:
        """Return the edges of what is there, with a margin; None if nothing is."""
        poses = [robot.pose for robot in self.robots.values()]
        poses += [goal.pose for goal in self.goals]
        if not poses:
            return None
        x, y = [pose.x for pose in poses], [pose.y for pose in poses]
        return MapBounds(min(x) - AROUND, min(y) - AROUND, max(x) + AROUND, max(y) + AROUND)

    def goal_groups(self, view: View) -> list[GoalGroup]:
        """Return the goals that a view shows; those that are close together are one group."""
        found: dict[tuple[int, int], list[GoalMark]] = {}
        for goal in self.goals:
            column, row = view.pixel(goal.pose.x, goal.pose.y)
            if view.shows(column, row, TOGETHER):
                square = (round(column / TOGETHER), round(row / TOGETHER))
                found.setdefault(square, []).append(goal)
        return [
            GoalGroup(*view.pixel(goals[0].pose.x, goals[0].pose.y), tuple(goals))
            for goals in (sorted(each, key=_urgency) for each in found.values())
        ]

    def mark_at(self, view: View, column: float, row: float) -> RobotMark | GoalMark | None:
        """Return the robot, else the goal, that is seen at a place [pixel]; None for neither."""
        here = (column, row)
        nearest = _nearest(self.robots.values(), view, here, robot_radius(view))
        return nearest or _nearest(self.goals, view, here, REACH)


def closed_zones(zones: Iterable[Zone], traffic: TrafficState | None) -> frozenset[str]:
    """Return the names of the closed zones: as the traffic planner tells, else as at the start."""
    if traffic is not None:
        return frozenset(traffic.closed)
    return frozenset(zone.name for zone in zones if zone.closed)


def robot_radius(view: View) -> float:
    """Return the radius of a robot's disc [pixel]."""
    return max(ROBOT_RADIUS * view.scale, SMALLEST_ROBOT)


def _urgency(goal: GoalMark) -> tuple[bool, int, str]:
    """Return what goals of a group are sorted by: those that a robot has first, then by name."""
    return goal.color == NO_ROBOT, len(goal.label), goal.label


def _nearest(
    marks: Iterable[RobotMark | GoalMark], view: View, here: tuple[float, float], within: float
) -> RobotMark | GoalMark | None:
    found, least = None, within
    for mark in marks:
        away = math.dist(here, view.pixel(mark.pose.x, mark.pose.y))
        if away <= least:
            found, least = mark, away
    return found


def _robot_mark(row: RobotRow, pose: Pose) -> RobotMark:
    status, is_out = row.status, row.state in _OUT
    load, charge = formats.mass(status.payload), formats.percent(status.charge)
    lines = [f"{status.robot_id}: {row.state.name.lower()}", f"load {load}, battery {charge}"]
    lines += [f"task {status.task_id}"] if status.task_id else []
    lines += [row.reason] if row.reason else []
    color = NO_ROBOT if is_out else robot_color(status.robot_id)
    return RobotMark(status.robot_id, pose, color, is_out, "\n".join(lines))


def _goal_marks(row: TaskRow) -> tuple[GoalMark, ...]:
    record, color = row.record, robot_color(row.record.robot)
    state = record.state.name.lower()
    words = f"{state}, {record.robot}" if record.robot else state
    words += f"\n{record.reason}" if record.reason else ""
    task_id = record.task.id
    named = ((goal_name(place), goal) for place, goal in enumerate(used_goals(record.task)))
    return tuple(
        GoalMark(task_id, name, goal, color, f"{task_id}, goal {name}: {words}")
        for name, goal in named
        if goal.is_finite
    )


class Labels:
    """Finds places for labels where they cover no other one and stay in a width [pixel]."""

    def __init__(self, width: float = math.inf) -> None:
        self._width = width
        self._taken: set[tuple[int, int]] = set()

    def place(
        self, column: float, row: float, away: float, size: tuple[float, float]
    ) -> tuple[float, float] | None:
        """Take a free place for a label beside a mark, and return its upper left corner [pixel].

        Args:
            column: Of the middle of the mark [pixel].
            row: Of the middle of the mark [pixel].
            away: The radius of the mark [pixel].
            size: Width and height of the label [pixel].

        Returns:
            The corner; None where every place beside the mark is taken.
        """
        width, height = size
        corners = (
            (column - width / 2, row + away),
            (column - width / 2, row - away - height),
            (column + away, row - height / 2),
            (column - away - width, row - height / 2),
        )
        for corner, top in corners:
            left = max(0.0, min(corner, self._width - width))
            cells = {
                (across, down)
                for across in range(int(left // LABEL_CELL), int((left + width) // LABEL_CELL) + 1)
                for down in range(int(top // LABEL_CELL), int((top + height) // LABEL_CELL) + 1)
            }
            if self._taken.isdisjoint(cells):
                self._taken |= cells
                return left, top
        return None
