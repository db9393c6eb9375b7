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
from typing import TYPE_CHECKING

import numpy as np

from hive_common.geometry import Footprint
from hive_common.grid_map import Disc

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

    from hive_common.geometry import Array
    from hive_common.grid_map import ClearanceField
    from hive_common.pose import Pose
    from robot_description.models import Base, Laser
    from robot_navigation.planning.path import Path

STEP = 0.1  # distance between the places on the path where the robot is checked [m]
MARGIN = 0.05  # room around the footprint that must be free of unmapped obstacles [m]

MAPPED_MARGIN = -0.03
"""The same for obstacles of the map [m]. It is negative: the planner has left room for them, and
the laser's noise must not stop the robot in a narrow door."""

GAP = 0.15  # distance at which a robot stops before an obstacle [m]
ON_MAP = 0.15  # a point within this distance of an obstacle of the map belongs to it [m]
CLUSTER = 0.25  # side of the squares in which points are grouped to plan around them [m]
REMEMBERED = 20.0  # how long an obstacle is remembered [s]


def points_seen(laser: Laser, ranges: Array, pose: Pose) -> Array:
    """Return the points that a scan has hit, (n, 2) array, frame map [m].

    `ranges` (beams,) [m] go counter-clockwise from minus half the field of view; the base was at
    `pose`, frame map.
    """
    hit = np.isfinite(ranges) & (ranges >= laser.range_min) & (ranges < laser.range_max)
    spread = laser.field_of_view / max(1, len(ranges))
    angles = -laser.field_of_view / 2 + spread * np.flatnonzero(hit)
    x, y, yaw = laser.pose
    cos, sin = math.cos(pose.yaw), math.sin(pose.yaw)
    angles = angles + yaw + pose.yaw
    xs = pose.x + cos * x - sin * y + ranges[hit] * np.cos(angles)
    ys = pose.y + sin * x + cos * y + ranges[hit] * np.sin(angles)
    return np.column_stack([xs, ys])


@dataclass(frozen=True)
class VisibleObstacles:
    """What the laser sees; (n, 2) arrays of points, frame map [m]."""

    known: Array  # on obstacles of the map and on robots that announce where they are
    unknown: Array  # everything else


def sort_points(points: Array, field: ClearanceField, robots: Sequence[Disc]) -> VisibleObstacles:
    """Sort points (n, 2), frame map [m]; `robots` are those that announce where they are."""
    known = field.at_points(points) < ON_MAP
    for robot in robots:
        known |= np.hypot(points[:, 0] - robot.x, points[:, 1] - robot.y) < robot.radius + 0.1
    return VisibleObstacles(points[known], points[~known])


class ObstacleCheck:
    """Checks the path of one robot against visible obstacles."""

    def __init__(self, base: Base, laser: Laser) -> None:
        self._footprint = Footprint(base.footprint)
        self._radius = base.circumscribed_radius
        self._holonomic = base.holonomic
        self._range = laser.range_max - math.hypot(*laser.pose[:2])

    def room_ahead(
        self, path: Path, progress: float, pose: Pose, obstacles: VisibleObstacles
    ) -> float:
        """Return how far a robot that is `progress` [m] along its path may go on [m]."""
        far = min(progress + self._range, path.length)
        marks = np.append(np.arange(progress + STEP, far, STEP), far)
        places, headings = path.at_all(marks), path.headings_at(marks)
        hits = []
        for points, margin in ((obstacles.known, MAPPED_MARGIN), (obstacles.unknown, MARGIN)):
            ahead = self._not_touched(pose, points, margin)
            touched = self._inside(places, headings, ahead, margin).any(axis=1)
            first = int(np.argmax(touched))
            hits.append(marks[first] - progress - STEP if touched.any() else math.inf)
        known, unknown = hits
        unseen = max(0.0, (self._range - self._radius - GAP) / 2)
        return max(0.0, float(min(known - GAP / 3, (unknown - GAP) / 2, unseen)))

    def may_turn(self, pose: Pose, obstacles: VisibleObstacles) -> bool:
        """Return whether the robot can turn on the spot and touch no unknown obstacle."""
        unknown = obstacles.unknown
        away = np.hypot(unknown[:, 0] - pose.x, unknown[:, 1] - pose.y)
        return not bool((away < self._radius + MARGIN / 2).any())

    def blocking(self, path: Path, progress: float, obstacles: VisibleObstacles) -> Array:
        """Return the unknown points that the robot would touch, (n, 2) array, frame map [m]."""
        marks = np.arange(progress, min(progress + self._range, path.length) + STEP, STEP)
        places, headings = path.at_all(marks), path.headings_at(marks)
        inside = self._inside(places, headings, obstacles.unknown, MARGIN)
        return np.asarray(obstacles.unknown[inside.any(axis=0)])

    def _not_touched(self, pose: Pose, points: Array, margin: float) -> Array:
        """Return the points that the robot does not touch now: those must not keep it there."""
        near = np.hypot(points[:, 0] - pose.x, points[:, 1] - pose.y) < self._radius + margin
        touched = near.copy()
        here, yaw = np.array([pose[:2]]), np.array([pose.yaw])
        touched[near] = self._inside_at(here, yaw, points[near], margin)[0]
        return points[~touched]

    def _inside(
        self, places: Array, headings: Array, points: Array, margin: float
    ) -> NDArray[np.bool_]:
        """Return which points the footprint covers at which places, (places, points) array."""
        inside = np.zeros((len(places), len(points)), dtype=bool)
        reach = self._radius + margin
        low, high = places.min(axis=0) - reach, places.max(axis=0) + reach
        near = ((points > low) & (points < high)).all(axis=1)
        if near.any():
            inside[:, near] = self._inside_at(places, headings, points[near], margin)
        return inside

    def _inside_at(
        self, places: Array, headings: Array, points: Array, margin: float
    ) -> NDArray[np.bool_]:
        rel = points[None, :, :] - places[:, None, :]
        if self._holonomic:
            # It may have any heading on the path.
            round_: NDArray[np.bool_] = np.hypot(rel[..., 0], rel[..., 1]) < self._radius + margin
            return round_
        cos, sin = np.cos(headings)[:, None], np.sin(headings)[:, None]
        x = cos * rel[..., 0] + sin * rel[..., 1]
        y = cos * rel[..., 1] - sin * rel[..., 0]
        inside = np.ones(x.shape, dtype=bool)
        for (nx, ny), limit in zip(self._footprint.normals, self._footprint.limits, strict=True):
            inside &= nx * x + ny * y < limit + margin
        return inside


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
