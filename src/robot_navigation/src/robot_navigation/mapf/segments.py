# SPDX-License-Identifier: BSD-3-Clause
"""How near straight stretches come to each other."""

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
