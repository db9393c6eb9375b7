# SPDX-License-Identifier: BSD-3-Clause
"""Obstacles that the laser sees: how far a robot may go, and what to plan around.

A robot must be able to stop before any visible obstacle. Obstacles of the map stand still, so the
whole distance to them may be used for braking. Anything else may be a robot of another make that
approaches and relies on the same distance: each of the two may use half of it. The limit of the
laser's range is treated like such a robot.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import lru_cache
from typing import TYPE_CHECKING

import numpy as np

from hive_common.compiled import compiled
from hive_common.geometry import Footprint
from hive_navigation.planning.clearance import Disc, as_rows

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

    from hive_common.geometry import Array
    from hive_common.pose import Pose
    from hive_navigation.planning.clearance import ClearanceField
    from hive_navigation.planning.path import Path
    from robot_description.models import Base, Laser
    from robot_description.scan import Scan

STEP = 0.1  # distance between the places on the path where the robot is checked [m]
MARGIN = 0.05  # room around the footprint that must be free of unmapped obstacles [m]

MAPPED_MARGIN = -0.03
"""The same for obstacles of the map [m]. It is negative: the planner has left room for them, and
the laser's noise must not stop the robot in a narrow door."""

GAP = 0.15  # distance at which a robot stops before an obstacle [m]
ON_MAP = 0.15  # a point within this distance of an obstacle of the map belongs to it [m]
ON_ROBOT = 0.1  # a point within this distance of a robot belongs to it [m]
CLUSTER = 0.25  # side of the squares in which points are grouped to plan around them [m]
REMEMBERED = 20.0  # how long an obstacle is remembered [s]


def points_seen(laser: Laser, scan: Scan, pose: Pose) -> Array:
    """Return the points that a scan has hit, (n, 2) array, frame map [m].

    `laser` says where it is mounted on the base, which was at `pose`, frame map.
    """
    beams = len(scan.ranges)
    directions = _directions(scan.angle_min + laser.pose.yaw, scan.angle_increment, beams)
    mount = (laser.pose[0], laser.pose[1])
    return _ends(directions, scan.ranges, mount, (pose[0], pose[1], pose[2]))


@lru_cache(maxsize=32)  # of lasers whose number of beams changes from scan to scan, too
def _directions(first: float, increment: float, beams: int) -> Array:
    """Return unit vectors along the beams (beams, 2), in the frame of the base."""
    angles = first + increment * np.arange(beams)
    return np.column_stack([np.cos(angles), np.sin(angles)])


@dataclass(frozen=True)
class VisibleObstacles:
    """What the laser sees; (n, 2) arrays of points, frame map [m]."""

    known: Array  # on obstacles of the map and on robots that announce where they are
    unknown: Array  # everything else
    range_max: float = math.inf  # how far the laser that sees them sees [m]


def sort_points(
    points: Array, field: ClearanceField, robots: Sequence[Disc], range_max: float = math.inf
) -> VisibleObstacles:
    """Sort points (n, 2), frame map [m]; `robots` are those that announce where they are."""
    known = _are_known(points, field.at_points(points), as_rows(robots))
    return VisibleObstacles(points[known], points[~known], range_max)


class ObstacleCheck:
    """Checks the path of one robot against visible obstacles."""

    def __init__(self, base: Base, laser: Laser) -> None:
        footprint = Footprint(base.footprint)
        self._radius = base.circumscribed_radius
        self._mount = math.hypot(*laser.pose[:2])
        self._range = laser.range_max - self._mount
        # A holonomic base may have any heading on the path.
        shape = np.column_stack([footprint.normals, footprint.limits])
        self._shape: Array = np.empty((0, 3)) if base.holonomic else shape

    def room_ahead(
        self, path: Path, progress: float, pose: Pose, obstacles: VisibleObstacles
    ) -> float:
        """Return how far a robot that is `progress` [m] along its path may go on [m]."""
        far = min(progress + self._range, path.length)
        places = _places(path.points, path.marks, path.headings, progress + STEP, far)
        here = np.array([[0.0, *pose]])
        known, unknown = (
            _first_touched(points, places, here, self._shape, self._radius, margin)
            for points, margin in ((obstacles.known, MAPPED_MARGIN), (obstacles.unknown, MARGIN))
        )
        known, unknown = known - progress - STEP, unknown - progress - STEP
        blank = self._room_within(min(self._range, obstacles.range_max - self._mount))
        return max(0.0, min(known - GAP / 3, (unknown - GAP) / 2, blank))

    @property
    def most_room(self) -> float:
        """How far a robot may go where the laser sees nothing [m]."""
        return self._room_within(self._range)

    def _room_within(self, reach: float) -> float:
        return max(0.0, (reach - self._radius - GAP) / 2)

    def may_turn(self, pose: Pose, obstacles: VisibleObstacles) -> bool:
        """Return whether the robot can turn on the spot and touch no unknown obstacle."""
        reach = self._radius + MARGIN / 2
        return not _any_within(obstacles.unknown, pose.x, pose.y, reach)

    def blocking(self, path: Path, progress: float, obstacles: VisibleObstacles) -> Array:
        """Return the unknown points that the robot would touch, (n, 2) array, frame map [m]."""
        far = progress + math.ceil(min(self._range, path.length - progress) / STEP) * STEP
        places = _places(path.points, path.marks, path.headings, progress, far)
        none = np.empty((0, 4))
        touched = [
            math.isfinite(
                _first_touched(point[None], places, none, self._shape, self._radius, MARGIN)
            )
            for point in obstacles.unknown
        ]
        blocking: Array = obstacles.unknown[np.array(touched, dtype=bool)]
        return blocking


@compiled(
    "float64[:, ::1](float64[:, ::1], float64[::1], UniTuple(float64, 2), UniTuple(float64, 3))"
)
def _ends(
    directions: Array,
    ranges: Array,
    laser: tuple[float, float],
    pose: tuple[float, float, float],
) -> Array:
    """Return the ends of the beams that hit something; see `points_seen`."""
    cos, sin = math.cos(pose[2]), math.sin(pose[2])
    points = np.empty((len(ranges), 2))
    count = 0
    for beam in range(len(ranges)):
        reach = ranges[beam]
        if math.isfinite(reach):
            x = laser[0] + reach * directions[beam, 0]
            y = laser[1] + reach * directions[beam, 1]
            points[count] = pose[0] + cos * x - sin * y, pose[1] + sin * x + cos * y
            count += 1
    return points[:count]


@compiled("boolean[::1](float64[:, ::1], float64[::1], float64[:, ::1])")
def _are_known(points: Array, clearance: Array, robots: Array) -> NDArray[np.bool_]:
    """Return which points with these clearances belong to the map or to robots (k, 3)."""
    known = clearance < ON_MAP
    for robot in range(len(robots)):
        x, y, radius = robots[robot]
        reach = radius + ON_ROBOT
        for point in range(len(points)):
            dx, dy = points[point, 0] - x, points[point, 1] - y
            known[point] |= dx * dx + dy * dy < reach * reach
    return known


@compiled("boolean(float64[:, ::1], float64, float64, float64)")
def _any_within(points: Array, x: float, y: float, reach: float) -> bool:
    for point in range(len(points)):
        dx, dy = points[point, 0] - x, points[point, 1] - y
        if dx * dx + dy * dy < reach * reach:
            return True
    return False


@compiled("float64[:, ::1](float64[:, ::1], float64[::1], float64[::1], float64, float64)")
def _places(points: Array, marks: Array, headings: Array, first: float, far: float) -> Array:
    """Return places on a path, one each `STEP` and one at `far` [m].

    (n, 4) array of their distance along the path, x, y [m] and the path's heading there [rad].
    """
    count = max(0, math.ceil((far - first) / STEP)) + 1
    places = np.zeros((count, 4))
    for index in range(count):
        mark = far if index == count - 1 else first + index * STEP
        leg = int(np.searchsorted(marks, mark, side="right")) - 1
        leg = min(max(leg, 0), len(headings) - 1)
        places[index, 0] = mark
        if leg < 0:
            places[index, 1:3] = points[0]
            continue
        share = min(max(mark - marks[leg], 0.0) / (marks[leg + 1] - marks[leg]), 1.0)
        places[index, 1:3] = points[leg] + share * (points[leg + 1] - points[leg])
        places[index, 3] = headings[leg]
    return places


@compiled("boolean(float64[::1], float64[:, ::1], float64, float64, float64, float64)")
def _covers(place: Array, shape: Array, radius: float, margin: float, x: float, y: float) -> bool:
    """Return whether a footprint at a place of `_places` covers a point.

    `shape` (n, 3) holds normals and limits of the footprint's edges; without any, it is a circle.
    """
    dx, dy = x - place[1], y - place[2]
    if len(shape) == 0:
        return bool(dx * dx + dy * dy < (radius + margin) * (radius + margin))
    cos, sin = math.cos(place[3]), math.sin(place[3])
    along, aside = cos * dx + sin * dy, cos * dy - sin * dx
    for edge in range(len(shape)):
        if shape[edge, 0] * along + shape[edge, 1] * aside >= shape[edge, 2] + margin:
            return False
    return True


@compiled(
    "float64(float64[:, ::1], float64[:, ::1], float64[:, ::1], float64[:, ::1], float64, float64)"
)
def _first_touched(
    points: Array, places: Array, here: Array, shape: Array, radius: float, margin: float
) -> float:
    """Return how far along its path a robot first touches a point [m]; infinite if nowhere.

    What it touches `here` (at most one place) already must not keep it there.
    """
    reach = radius + margin
    x_min, x_max = np.min(places[:, 1]) - reach, np.max(places[:, 1]) + reach
    y_min, y_max = np.min(places[:, 2]) - reach, np.max(places[:, 2]) + reach
    first = len(places)
    for point in range(len(points)):
        x, y = points[point]
        if not (x_min < x < x_max and y_min < y < y_max):
            continue
        if len(here) > 0:
            near = math.hypot(x - here[0, 1], y - here[0, 2]) < reach
            if near and _covers(here[0], shape, radius, margin, x, y):
                continue
        for place in range(first):
            if _covers(places[place], shape, radius, margin, x, y):
                first = place
                break
    return places[first, 0] if first < len(places) else np.inf


def discs_around(points: Array) -> list[Disc]:
    """Return discs that cover points, one for each square of side `CLUSTER` that holds some."""
    squares = np.floor(points / CLUSTER).astype(np.intp)
    discs = []
    for square in np.unique(squares, axis=0):
        inside = points[(squares == square).all(axis=1)]
        x, y = inside.mean(axis=0)
        radius = float(np.hypot(*(inside - (x, y)).T).max()) + 0.05
        discs.append(Disc(float(x), float(y), radius))
    return discs


class ObstacleMemory:
    """The obstacles of the last `REMEMBERED` seconds, so that the next plan avoids them."""

    def __init__(self) -> None:
        self._discs: list[tuple[float, Disc]] = []

    def add(self, now: float, points: Array) -> None:
        """Remember points of obstacles, (n, 2) array, frame map [m]."""
        self._discs += [(now, disc) for disc in discs_around(points)]

    def discs(self, now: float) -> list[Disc]:
        """Return what is still remembered, as obstacles for a planner."""
        self._discs = [(when, disc) for when, disc in self._discs if now - when < REMEMBERED]
        return [disc for _, disc in self._discs]
