# SPDX-License-Identifier: BSD-3-Clause
"""What the laser sees in the way: how far a robot may go, and what to plan around.

A robot must be able to stop before whatever it sees. What the map shows stands still, so all the
distance up to it may be used for braking. Anything else may be a robot of another make that comes
the other way and counts on the same: each of the two may use half of the distance. Where the
laser sees no farther, the same is assumed of whatever comes from there.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from hive_common.grid_map import Disc

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

    from hive_common.grid_map import ClearanceField
    from hive_common.pose import Pose
    from robot_description.models import Base, Laser
    from robot_navigation.planning.path import Way

    Array = NDArray[np.float64]

STEP = 0.1
"""Distance between the places on the way at which the robot is checked [m]."""

BESIDE = 0.05
"""Room on all sides of the footprint that must be free of what the map does not show [m]."""

MAPPED = 0.03
"""So far inside the footprint may what the map shows appear to be [m]: the planner has left room
for it, and the laser's noise must not stop the robot in a narrow door."""

GAP = 0.15
"""How far before an obstacle a robot stands [m]."""

ON_MAP = 0.15
"""What is seen within this distance of an obstacle of the map is that obstacle [m]."""

CLUSTER = 0.25
"""Side of the squares into which points are put together to plan around them [m]."""


def points_seen(laser: Laser, ranges: Array, pose: Pose) -> Array:
    """Return what a scan has hit.

    Args:
        laser: The scanner.
        ranges: (beams,) array [m]; counter-clockwise from minus half the field of view.
        pose: Where the base was, frame map.

    Returns:
        (n, 2) array, frame map [m].
    """
    hit = np.isfinite(ranges) & (ranges >= laser.range_min) & (ranges < laser.range_max)
    spread = laser.field_of_view / max(1, len(ranges))
    angles = -laser.field_of_view / 2 + spread * np.flatnonzero(hit)
    x, y, yaw = laser.pose
    cos, sin = math.cos(pose.yaw), math.sin(pose.yaw)
    angles = angles + yaw + pose.yaw
    return np.column_stack(
        [
            pose.x + cos * x - sin * y + ranges[hit] * np.cos(angles),
            pose.y + sin * x + cos * y + ranges[hit] * np.sin(angles),
        ]
    )


@dataclass(frozen=True)
class Sight:
    """What the laser sees, sorted by whose it is; (n, 2) arrays, frame map [m].

    Attributes:
        known: Obstacles of the map, and robots that tell where they are.
        unknown: Everything else.
    """

    known: Array
    unknown: Array


def sort_points(points: Array, field: ClearanceField, robots: Sequence[Disc]) -> Sight:
    """Sort what the laser sees.

    Args:
        points: (n, 2) array, frame map [m].
        field: The clearances of the map.
        robots: The robots that tell where they are.
    """
    known = field.at_points(points) < ON_MAP
    for robot in robots:
        known |= np.hypot(points[:, 0] - robot.x, points[:, 1] - robot.y) < robot.radius + 0.1
    return Sight(points[known], points[~known])


class ObstacleCheck:
    """Looks along the way of one robot."""

    def __init__(self, base: Base, laser: Laser) -> None:
        corners = np.array(base.footprint)
        edges = np.roll(corners, -1, axis=0) - corners
        # Outward normals of a counter-clockwise polygon, and how far out each edge lies.
        self._normals = np.column_stack([edges[:, 1], -edges[:, 0]])
        self._normals /= np.hypot(*edges.T)[:, None]
        self._offsets = np.einsum("ij,ij->i", self._normals, corners)
        self._radius = base.circumscribed_radius
        self._holonomic = base.holonomic
        self._sight = laser.range_max - math.hypot(*laser.pose[:2])

    @property
    def unseen(self) -> float:
        """How far a robot may go towards what it cannot see yet [m]."""
        return max(0.0, (self._sight - self._radius - GAP) / 2)

    def room_ahead(self, way: Way, progress: float, pose: Pose, sight: Sight) -> float:
        """Return how far along the way the robot may go [m].

        Args:
            way: Frame map.
            progress: How far along it the robot is [m].
            pose: Where the robot is, frame map.
            sight: What it sees.
        """
        far = min(progress + self._sight, way.length)
        marks = np.append(np.arange(progress + STEP, far, STEP), far)
        places, headings = way.at_all(marks), way.headings_at(marks)
        hits = []
        for points, beside in ((sight.known, -MAPPED), (sight.unknown, BESIDE)):
            ahead = self._not_touched(pose, points, beside)
            touched = self._inside(places, headings, ahead, beside).any(axis=1)
            first = int(np.argmax(touched))
            hits.append(marks[first] - progress - STEP if touched.any() else math.inf)
        hard, soft = hits
        return max(0.0, float(min(hard - GAP / 3, (soft - GAP) / 2, self.unseen)))

    def may_turn(self, pose: Pose, sight: Sight) -> bool:
        """Return whether the robot can turn on the spot without touching what is not mapped."""
        away = np.hypot(sight.unknown[:, 0] - pose.x, sight.unknown[:, 1] - pose.y)
        return not bool((away < self._radius + BESIDE / 2).any())

    def blocking(self, way: Way, progress: float, sight: Sight) -> Array:
        """Return the unknown points that the robot would touch, (n, 2) array, frame map [m]."""
        marks = np.arange(progress, min(progress + self._sight, way.length) + STEP, STEP)
        places, headings = way.at_all(marks), way.headings_at(marks)
        inside = self._inside(places, headings, sight.unknown, BESIDE)
        return np.asarray(sight.unknown[inside.any(axis=0)])

    def _not_touched(self, pose: Pose, points: Array, beside: float) -> Array:
        """Return the points that the robot does not touch where it is.

        What is beside the robot already must not keep it from leaving.
        """
        near = np.hypot(points[:, 0] - pose.x, points[:, 1] - pose.y) < self._radius + beside
        touched = near.copy()
        here, yaw = np.array([pose[:2]]), np.array([pose.yaw])
        touched[near] = self._inside_at(here, yaw, points[near], beside)[0]
        return points[~touched]

    def _inside(
        self, places: Array, headings: Array, points: Array, beside: float
    ) -> NDArray[np.bool_]:
        """Return which points lie in the footprint at which places, (places, points) array."""
        inside = np.zeros((len(places), len(points)), dtype=bool)
        reach = self._radius + beside
        low, high = places.min(axis=0) - reach, places.max(axis=0) + reach
        near = ((points > low) & (points < high)).all(axis=1)
        if near.any():
            inside[:, near] = self._inside_at(places, headings, points[near], beside)
        return inside

    def _inside_at(
        self, places: Array, headings: Array, points: Array, beside: float
    ) -> NDArray[np.bool_]:
        rel = points[None, :, :] - places[:, None, :]
        if self._holonomic:
            # It may turn as it likes on the way, so it needs the room for that.
            round_: NDArray[np.bool_] = np.hypot(rel[..., 0], rel[..., 1]) < self._radius + beside
            return round_
        cos, sin = np.cos(headings)[:, None], np.sin(headings)[:, None]
        x = cos * rel[..., 0] + sin * rel[..., 1]
        y = cos * rel[..., 1] - sin * rel[..., 0]
        inside = np.ones(x.shape, dtype=bool)
        for (nx, ny), offset in zip(self._normals, self._offsets, strict=True):
            inside &= nx * x + ny * y < offset + beside
        return inside


def discs_around(points: Array) -> list[Disc]:
    """Return discs that cover points, one for each square of `CLUSTER` that holds some."""
    squares = np.floor(points / CLUSTER).astype(np.intp)
    discs = []
    for square in np.unique(squares, axis=0):
        inside = points[(squares == square).all(axis=1)]
        x, y = inside.mean(axis=0)
        radius = float(np.hypot(*(inside - (x, y)).T).max()) + 0.05
        discs.append(Disc(float(x), float(y), radius))
    return discs


class Memory:
    """What was in the way a moment ago, so that the next plan does not run into it again."""

    def __init__(self, lasts: float = 20.0) -> None:
        """Start with nothing.

        Args:
            lasts: How long things are remembered [s].
        """
        self._lasts = lasts
        self._discs: list[tuple[float, Disc]] = []

    def add(self, now: float, points: Array) -> None:
        """Remember things seen, (n, 2) array of points, frame map [m]."""
        self._discs += [(now, disc) for disc in discs_around(points)]

    def discs(self, now: float) -> list[Disc]:
        """Return what is still remembered, as obstacles for a planner."""
        self._discs = [(when, disc) for when, disc in self._discs if now - when < self._lasts]
        return [disc for _, disc in self._discs]
