# SPDX-License-Identifier: BSD-3-Clause
"""A path: a polyline whose points are addressed by their distance from its start."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, TypeAlias

import numpy as np

from hive_common.compiled import compiled

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
        headings: (n - 1,) array, directions of the legs [rad].
        length: [m].
        end: The last point.
    """

    def __init__(self, points: Sequence[Point]) -> None:
        all_points = np.array(points, dtype=float).reshape(-1, 2)
        lengths = np.hypot(*np.diff(all_points, axis=0).T) if len(all_points) > 1 else np.empty(0)
        kept = np.concatenate([[True], lengths > SAME])
        self.points: Array = all_points[kept]
        self.marks: Array = np.concatenate([[0.0], np.cumsum(lengths[lengths > SAME])])
        steps = np.diff(self.points, axis=0)
        self.headings: Array = np.arctan2(steps[:, 1], steps[:, 0])
        self.length = float(self.marks[-1])
        self.end: Point = (float(self.points[-1, 0]), float(self.points[-1, 1]))
        turns = np.diff(self.headings)
        turned = np.abs((turns + math.pi) % (2 * math.pi) - math.pi)
        self._bends = list(zip(self.marks[1:-1].tolist(), turned.tolist(), strict=True))
        self._corners = list(zip(self.marks.tolist(), self.points.tolist(), strict=True))

    def at(self, distance: float) -> Point:
        """Return the point at a distance from the start [m]; the last leg goes on past the end."""
        beyond = distance - self.length
        if beyond > 0 and len(self.headings):
            x, y = self.end
            heading = float(self.headings[-1])
            return x + beyond * math.cos(heading), y + beyond * math.sin(heading)
        return _at(self.points, self.marks, distance)

    def nearest(self, point: Point, low: float, high: float) -> float:
        """Return where between `low` and `high` along the path it comes nearest to a point [m]."""
        return _nearest(self.points, self.marks, point[0], point[1], low, high)

    def bends(self, low: float, high: float) -> list[tuple[float, float]]:
        """Return where the corners from `low` to `high` are [m], and by how much each turns [rad].

        The start and the end are no corners.
        """
        return [(mark, turn) for mark, turn in self._bends if low <= mark <= high]

    def section(self, low: float, high: float) -> list[Point]:
        """Return the points from one distance to another [m], both included."""
        inner = [(x, y) for mark, (x, y) in self._corners if low + SAME < mark < high - SAME]
        ends = (_at(self.points, self.marks, mark) for mark in (low, high))
        return [next(ends), *inner, *ends]


def sampled(points: Sequence[Point], step: float) -> tuple[Array, Array]:
    """Return points (n, 2) at most `step` apart on a polyline, and their distances (n,) [m]."""
    return _sampled(np.array(points, dtype=float), step)


@compiled("UniTuple(float64, 2)(float64[:, ::1], float64[::1], float64)")
def _at(points: Array, marks: Array, distance: float) -> Point:
    """Return the point at a distance from the start, clipped to the path."""
    last = len(marks) - 1
    if not distance > marks[0]:
        return points[0, 0], points[0, 1]
    if distance >= marks[last]:
        return points[last, 0], points[last, 1]
    leg = np.searchsorted(marks, distance, side="right") - 1
    share = distance - marks[leg]
    length = marks[leg + 1] - marks[leg]
    return (
        (points[leg + 1, 0] - points[leg, 0]) / length * share + points[leg, 0],
        (points[leg + 1, 1] - points[leg, 1]) / length * share + points[leg, 1],
    )


@compiled("float64(float64[:, ::1], float64[::1], float64, float64, float64, float64)")
def _nearest(points: Array, marks: Array, x: float, y: float, low: float, high: float) -> float:
    """See `Path.nearest`."""
    best, least = 0.0, np.inf
    for leg in range(len(marks) - 1):
        length = marks[leg + 1] - marks[leg]
        dx, dy = points[leg + 1, 0] - points[leg, 0], points[leg + 1, 1] - points[leg, 1]
        along = ((x - points[leg, 0]) * dx + (y - points[leg, 1]) * dy) / length
        mark = min(max(marks[leg] + min(max(along, 0.0), length), low), high)
        there_x, there_y = _at(points, marks, mark)
        away = math.hypot(there_x - x, there_y - y)
        if away < least:
            best, least = mark, away
    return best


@compiled("Tuple((float64[:, ::1], float64[::1]))(float64[:, ::1], float64)")
def _sampled(corners: Array, step: float) -> tuple[Array, Array]:
    """See `sampled`."""
    points, marks = np.empty_like(corners), np.zeros(len(corners))
    points[0], kept = corners[0], 1
    for corner in range(1, len(corners)):
        before, here = corners[corner - 1], corners[corner]
        length = math.hypot(here[0] - before[0], here[1] - before[1])
        if length > SAME:
            points[kept], marks[kept] = here, marks[kept - 1] + length
            kept += 1
    points, marks = points[:kept], marks[:kept]
    distances = np.linspace(0.0, marks[-1], 1 + math.ceil(marks[-1] / step))
    found = np.empty((len(distances), 2))
    for index, distance in enumerate(distances):
        found[index] = _at(points, marks, distance)
    return found, distances
