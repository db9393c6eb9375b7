# SPDX-License-Identifier: BSD-3-Clause
"""A path: a polyline whose points are addressed by their distance from its start."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, TypeAlias

import numpy as np

if TYPE_CHECKING:
    from collections.abc import Sequence

    from hive_common.geometry import Array

Point: TypeAlias = tuple[float, float]  # x and y, frame map [m]
SAME = 1e-6  # points nearer to each other than this are one [m]


def angle_between(a: float, b: float) -> float:
    """Return the turn from heading a to heading b, in (-pi, pi] [rad]."""
    return math.pi - (math.pi - (b - a)) % (2 * math.pi)


class Path:
    """A polyline.

    Attributes:
        points: (n, 2) array, frame map [m]; at least one point, none twice in a row.
        marks: (n,) array, distance of each point from the start [m].
    """

    def __init__(self, points: Sequence[Point]) -> None:
        all_points = np.array(points, dtype=float).reshape(-1, 2)
        lengths = np.hypot(*np.diff(all_points, axis=0).T) if len(all_points) > 1 else np.empty(0)
        kept = np.concatenate([[True], lengths > SAME])
        self.points: Array = all_points[kept]
        self.marks: Array = np.concatenate([[0.0], np.cumsum(lengths[lengths > SAME])])
        steps = np.diff(self.points, axis=0)
        self._headings: Array = np.arctan2(steps[:, 1], steps[:, 0])

    @property
    def length(self) -> float:
        """Length [m]."""
        return float(self.marks[-1])

    @property
    def end(self) -> Point:
        """The last point."""
        return float(self.points[-1, 0]), float(self.points[-1, 1])

    def at(self, distance: float) -> Point:
        """Return the point at a distance from the start [m]; the last leg goes on past the end."""
        beyond = distance - self.length
        if beyond > 0 and len(self._headings):
            x, y = self.end
            heading = float(self._headings[-1])
            return x + beyond * math.cos(heading), y + beyond * math.sin(heading)
        x, y = self.at_all(np.array([distance]))[0]
        return float(x), float(y)

    def at_all(self, distances: Array) -> Array:
        """Return the points at (n,) distances [m] as an (n, 2) array, clipped to the path."""
        columns = [np.interp(distances, self.marks, self.points[:, axis]) for axis in (0, 1)]
        return np.column_stack(columns)

    def headings_at(self, distances: Array) -> Array:
        """Return the headings of the path at (n,) distances [rad]."""
        if not len(self._headings):
            return np.zeros(len(distances))
        index = np.searchsorted(self.marks, distances, side="right") - 1
        return self._headings[np.clip(index, 0, len(self._headings) - 1)]

    def nearest(self, point: Point, low: float, high: float) -> float:
        """Return where between `low` and `high` along the path it comes nearest to a point [m]."""
        if not len(self._headings):
            return 0.0
        steps = np.diff(self.points, axis=0)
        lengths = np.diff(self.marks)
        along = np.einsum("ij,ij->i", np.array(point) - self.points[:-1], steps) / lengths
        marks = np.clip(self.marks[:-1] + np.clip(along, 0.0, lengths), low, high)
        away = np.hypot(*(self.at_all(marks) - np.array(point)).T)
        return float(marks[np.argmin(away)])

    def bends(self) -> tuple[Array, Array]:
        """Return where the inner corners are [m], and by how much each turns [rad]."""
        turns = np.diff(self._headings)
        return self.marks[1:-1], np.abs((turns + math.pi) % (2 * math.pi) - math.pi)

    def section(self, low: float, high: float) -> list[Point]:
        """Return the points from one distance to another [m], both included."""
        inner = self.points[(self.marks > low + SAME) & (self.marks < high - SAME)]
        ends = self.at_all(np.array([low, high]))
        return [(float(x), float(y)) for x, y in np.vstack([ends[:1], inner, ends[1:]])]


def sampled(points: Sequence[Point], step: float) -> tuple[Array, Array]:
    """Return points (n, 2) at most `step` apart on a polyline, and their distances (n,) [m]."""
    path = Path(points)
    distances = np.linspace(0.0, path.length, 1 + math.ceil(path.length / step))
    return path.at_all(distances), distances
