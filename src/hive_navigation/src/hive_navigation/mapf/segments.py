# SPDX-License-Identifier: BSD-3-Clause
"""Compiled: how near straight stretches come to each other, and who goes first where they do."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from hive_common.compiled import compiled

if TYPE_CHECKING:
    from hive_common.geometry import Array, Indices


@compiled("float64(float64, float64, float64, float64, float64, float64)")
def _to_segment(x: float, y: float, ax: float, ay: float, bx: float, by: float) -> float:
    """Return the distance of a point from a segment [m]."""
    dx, dy = bx - ax, by - ay
    length = dx * dx + dy * dy
    share = 0.0
    if length > 0.0:
        share = min(max(((x - ax) * dx + (y - ay) * dy) / length, 0.0), 1.0)
    return math.hypot(ax + share * dx - x, ay + share * dy - y)


@compiled("float64(float64[::1], float64[::1], float64[::1], float64[::1])")
def segments_apart(a: Array, b: Array, c: Array, d: Array) -> float:
    """Return the distance of the segments ab and cd, whose ends are (2,) arrays [m]."""
    one = (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])
    two = (b[0] - a[0]) * (d[1] - a[1]) - (b[1] - a[1]) * (d[0] - a[0])
    three = (d[0] - c[0]) * (a[1] - c[1]) - (d[1] - c[1]) * (a[0] - c[0])
    four = (d[0] - c[0]) * (b[1] - c[1]) - (d[1] - c[1]) * (b[0] - c[0])
    if one * two < 0.0 and three * four < 0.0:
        return 0.0
    return min(
        _to_segment(a[0], a[1], c[0], c[1], d[0], d[1]),
        _to_segment(b[0], b[1], c[0], c[1], d[0], d[1]),
        _to_segment(c[0], c[1], a[0], a[1], b[0], b[1]),
        _to_segment(d[0], d[1], a[0], a[1], b[0], b[1]),
    )


@compiled("int64[::1](float64[:, ::1], float64[:, ::1], float64[:, ::1], float64)")
def segments_near(begins: Array, ends: Array, points: Array, apart: float) -> Indices:
    """Return which segments come nearer than `apart` [m] to a polyline.

    Args:
        begins: (n, 2) one end of each segment.
        ends: (n, 2) the other end.
        points: (k, 2) corners of the polyline, at least one.
        apart: [m]
    """
    x_min, x_max = np.min(points[:, 0]) - apart, np.max(points[:, 0]) + apart
    y_min, y_max = np.min(points[:, 1]) - apart, np.max(points[:, 1]) + apart
    found = np.empty(len(begins), dtype=np.int64)
    count = 0
    for index in range(len(begins)):
        a, b = begins[index], ends[index]
        if (
            max(a[0], b[0]) < x_min
            or min(a[0], b[0]) > x_max
            or max(a[1], b[1]) < y_min
            or min(a[1], b[1]) > y_max
        ):
            continue
        for corner in range(max(1, len(points) - 1)):
            after = min(corner + 1, len(points) - 1)
            if segments_apart(a, b, points[corner], points[after]) < apart:
                found[count] = index
                count += 1
                break
    return found[:count]


@compiled("int64(float64[:, ::1], float64[::1], int64, int64, int64, float64, boolean)")
def _last_before(
    points: Array, begins: Array, mine: int, first: int, end: int, apart: float, yields: bool
) -> int:
    """Return the last action from `first` to `end` that goes before `mine` and is in conflict.

    -1 if there is none. Of two that begin at the same time, `mine` is the second if it `yields`.
    """
    last = -1
    a, b = points[mine], points[mine + 1]
    left, right = min(a[0], b[0]) - apart, max(a[0], b[0]) + apart
    low, high = min(a[1], b[1]) - apart, max(a[1], b[1]) + apart
    for its in range(first, end):
        if begins[its] > begins[mine] or (begins[its] == begins[mine] and not yields):
            break
        after = min(its + 1, end - 1)
        c, d = points[its], points[after]
        if max(c[0], d[0]) < left or min(c[0], d[0]) > right:
            continue
        if max(c[1], d[1]) < low or min(c[1], d[1]) > high:
            continue
        if segments_apart(points[mine], points[mine + 1], points[its], points[after]) < apart:
            last = its
    return last


@compiled("boolean(float64[::1], float64[::1], float64[::1], float64[::1], float64)")
def _boxes_meet(low: Array, high: Array, its_low: Array, its_high: Array, apart: float) -> bool:
    """Return whether two boxes come nearer to each other than `apart` along both axes [m]."""
    return bool(
        low[0] <= its_high[0] + apart
        and high[0] >= its_low[0] - apart
        and low[1] <= its_high[1] + apart
        and high[1] >= its_low[1] - apart
    )


@compiled("int64[:, ::1](float64[:, ::1], float64[::1], int64[::1], float64[::1], float64)")
def arcs(points: Array, begins: Array, first: Indices, radii: Array, gap: float) -> Indices:
    """Return the arcs of an action dependency graph; see `dependency_graph.dependencies`.

    Args:
        points: (n, 2) of all courses, frame map [m].
        begins: (n,) when a robot leaves each [s].
        first: (k + 1,) course i has the points from `first[i]` to `first[i + 1]`.
        radii: (k,) of the robots [m].
        gap: Distance between their circles [m].
    """
    robots = len(radii)
    low, high = np.empty((robots, 2)), np.empty((robots, 2))
    for robot in range(robots):
        for axis in range(2):
            low[robot, axis] = np.min(points[first[robot] : first[robot + 1], axis])
            high[robot, axis] = np.max(points[first[robot] : first[robot + 1], axis])
    found, count = np.empty((64, 4), dtype=np.int64), 0
    for me in range(robots):
        for other in range(robots):
            apart = radii[me] + radii[other] + gap
            if me == other or not _boxes_meet(low[me], high[me], low[other], high[other], apart):
                continue
            for mine in range(first[me], first[me + 1] - 1):
                last = _last_before(
                    points, begins, mine, first[other], first[other + 1], apart, other < me
                )
                if last < 0:
                    continue
                if count == len(found):
                    found = np.concatenate((found, np.empty_like(found)))
                found[count] = np.array([me, mine - first[me], other, last - first[other]])
                count += 1
    return found[:count]
