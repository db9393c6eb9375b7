# SPDX-License-Identifier: BSD-3-Clause
"""What RViz shows of the hive: the goals of open tasks, robots and their paths, as plain values.

`space` and `number` identify a marker. RViz keeps a marker until it is told to delete it, so
`MarkerBoard` remembers what it has shown.
"""

from __future__ import annotations

import itertools
import math
from collections import deque
from dataclasses import dataclass
from enum import Enum
from types import MappingProxyType
from typing import TYPE_CHECKING

from blackboard.domain.task import goal_name, used_goals
from fleet_manager.client import formats
from hive_common.palette import robot_color
from hive_common.pose import Pose

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator, Mapping

    from blackboard.domain.record import TaskRecord
    from fleet_manager.client.rows import RobotRow, TaskRow
    from hive_common.palette import Color

ORIGIN = Pose(0.0, 0.0)
LETTERS: Color = (0.85, 0.10, 0.45, 1.0)  # read as well on free floor as on walls
PLACE_LETTERS: Color = (0.35, 0.35, 0.35, 1.0)
PLACE_HEIGHT = 0.22  # of the letters of a place's name [m]
PLACE_BELOW = 0.35  # on the map, so that the name does not cover who stands there [m]

ARROW = (0.7, 0.16, 0.10)  # length, width, height [m]
LETTER_HEIGHT = 0.28  # [m]
PATH_WIDTH = 0.06  # [m]
DISC = (0.9, 0.9, 0.02)  # under a robot [m]
LABEL_WIDTH = 0.8  # of a short name [m]
LINE_HEIGHT = 1.3 * LETTER_HEIGHT  # from one label to the next [m]
ROBOT_TEXT_ABOVE = 0.8  # on the map, so that it does not cover the robot [m]
GOAL_HEIGHT, TEXT_HEIGHT = 0.05, 1.0  # above the floor [m]
REPEATED_DELETIONS = 10  # updates in which a marker that is gone is deleted again


class Shape(Enum):
    """What a marker looks like."""

    ARROW = "arrow"
    """Points along its heading."""
    TEXT = "text"
    """Always faces the person."""
    LINE = "line"
    """Through its points."""
    DISC = "disc"
    """Flat on the floor."""


@dataclass(frozen=True, slots=True)
class Marker:
    """One marker in RViz. A text uses only the last of its `size`, a line only the first."""

    space: str  # the namespace, which RViz can hide
    number: int  # its number in the namespace
    shape: Shape  # what it looks like
    pose: Pose = ORIGIN  # of its origin [map frame]
    height: float = 0.0  # of its origin above the floor [m]
    size: tuple[float, float, float] = (1.0, 1.0, 1.0)  # length, width, height [m]
    color: Color = LETTERS  # of the whole marker
    text: str = ""  # of a text
    points: tuple[tuple[float, float], ...] = ()  # of a line [m, map frame]

    @property
    def name(self) -> tuple[str, int]:
        """Its identity."""
        return self.space, self.number


class MarkerBoard:
    """Turns the hive's state into markers, and says which are to be deleted."""

    def __init__(self) -> None:
        self._numbers: dict[tuple[str, str], int] = {}  # of what is shown or being deleted
        self._next = itertools.count()
        self._shown: set[tuple[str, int]] = set()
        self._gone: deque[set[tuple[str, int]]] = deque(maxlen=REPEATED_DELETIONS)

    def update(
        self,
        tasks: Mapping[str, TaskRow],
        robots: Mapping[str, RobotRow],
        paths: Mapping[str, tuple[tuple[float, float], ...]],
        poses: Mapping[str, Pose] = MappingProxyType({}),
        places: Mapping[str, Pose] = MappingProxyType({}),
    ) -> tuple[list[Marker], list[tuple[str, int]]]:
        """Return all markers as they are now, and the names of those that RViz shall delete.

        A deletion is repeated for a while, because a message may be lost. Ended tasks show
        nothing. All are by id or name; `paths` are the planned ones [m, map frame], and `poses`
        [map frame] are newer than those in the robots' reports. `places` are those with a name.
        """
        labels: set[tuple[int, int]] = set()
        open_tasks = [row.record for row in tasks.values() if row.is_open]
        markers = [
            *(marker for record in open_tasks for marker in self._goals(record, labels)),
            *(
                marker
                for name, row in robots.items()
                for marker in self._robot(row, poses.get(name, row.status.pose))
            ),
            *self._paths(paths),
            *self._places(places),
        ]
        names = {marker.name for marker in markers}
        self._gone.append(self._shown - names)
        self._shown = names
        gone = set().union(*self._gone) - names
        used = {number for _, number in names | gone}
        self._numbers = {name: n for name, n in self._numbers.items() if n in used}
        return markers, sorted(gone)

    def _goals(self, record: TaskRecord, labels: set[tuple[int, int]]) -> Iterator[Marker]:
        """Give the markers of a task; `labels` are the cells that names have taken."""
        color = robot_color(record.robot)
        for place, goal in enumerate(used_goals(record.task)):
            if not goal.is_finite:
                continue
            words = f"{record.task.id} {goal_name(place)}"
            number = self._number("goals", words)
            yield Marker("goals", number, Shape.ARROW, goal, GOAL_HEIGHT, ARROW, color)
            yield _label("goal names", number, _free_place(goal, labels), words)

    def _robot(self, row: RobotRow, pose: Pose) -> Iterator[Marker]:
        status = row.status
        if not pose.is_finite:
            return
        number, color = self._number("robots", status.robot_id), robot_color(status.robot_id)
        yield Marker("robots", number, Shape.DISC, pose, 0.0, DISC, color)
        load, charge = formats.mass(status.payload), formats.percent(status.charge)
        state = row.state.name.lower()
        words = f"{status.robot_id}: {state}\nload {load}, battery {charge}"
        yield _label("robot names", number, Pose(pose.x, pose.y + ROBOT_TEXT_ABOVE), words)

    def _paths(self, paths: Mapping[str, tuple[tuple[float, float], ...]]) -> Iterable[Marker]:
        for robot, points in paths.items():
            if len(points) > 1:
                number, color = self._number("robots", robot), robot_color(robot)
                size = (PATH_WIDTH, 0.0, 0.0)
                yield Marker("paths", number, Shape.LINE, size=size, color=color, points=points)

    def _places(self, places: Mapping[str, Pose]) -> Iterable[Marker]:
        size = (0.0, 0.0, PLACE_HEIGHT)
        for name, pose in places.items():
            at = Pose(pose.x, pose.y - PLACE_BELOW)
            number = self._number("place names", name)
            yield Marker(
                *("place names", number, Shape.TEXT, at, TEXT_HEIGHT, size, PLACE_LETTERS, name)
            )

    def _number(self, space: str, name: str) -> int:
        """Return the number of a name, which it keeps until all its markers are deleted."""
        if (space, name) not in self._numbers:
            self._numbers[space, name] = next(self._next)
        return self._numbers[space, name]


def _label(space: str, number: int, pose: Pose, words: str) -> Marker:
    size = (0.0, 0.0, LETTER_HEIGHT)
    return Marker(space, number, Shape.TEXT, pose, TEXT_HEIGHT, size, LETTERS, words)


def _free_place(goal: Pose, taken: set[tuple[int, int]]) -> Pose:
    """Return the first place below a goal where no other name is, and take it.

    `taken` holds the cells of `LABEL_WIDTH` by `LINE_HEIGHT` that names have taken.
    """
    column, row = round(goal.x / LABEL_WIDTH), math.floor(goal.y / LINE_HEIGHT) - 1
    while any((column + side, row) in taken for side in (-1, 0, 1)):
        row -= 1
    taken.add((column, row))
    return Pose(goal.x, row * LINE_HEIGHT)
