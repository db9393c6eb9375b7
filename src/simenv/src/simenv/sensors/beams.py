# SPDX-License-Identifier: BSD-3-Clause
"""What laser beams hit, for many scanners at once.

Each segment meets a range of neighbouring beams. So no beam is tried with every segment: the
bearings of a segment's ends tell which beams meet it, and only those are cut with it. The cuts are
exact, without a raster.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from hive_common.compiled import compiled

if TYPE_CHECKING:
    from collections.abc import Sequence

    from hive_common.geometry import Array, Indices

CORNER = 1e-6
"""Share of the angle between two beams by which a segment counts as wider, so that no beam slips
through between it and its neighbour."""

EDGE_ON = -1e-12  # limit of the cross product of a beam and a segment that faces it [m]


class Fan(NamedTuple):
    """The directions of a scanner's beams, evenly spaced."""

    first: float  # counter-clockwise from the scanner's heading [rad]
    increment: float  # [rad]
    number: int

    @property
    def angles(self) -> Array:
        """The directions (number,) of the beams, counter-clockwise from the heading [rad]."""
        angles: Array = self.first + np.arange(self.number) * self.increment
        return angles


class Fans:
    """The beams of n scanners; row i of every array belongs to scanner i.

    Attributes:
        spreads: (n, 2) first angle and increment [rad].
        places: (n,) where the beams of each begin in `directions`; equal fans share them.
        directions: (2, k) unit vectors.
    """

    def __init__(self, fans: Sequence[Fan]) -> None:
        """Put the fans into arrays."""
        begins: dict[Fan, int] = {}
        angles: list[Array] = [np.zeros(0)]
        for fan in fans:
            if fan not in begins:
                begins[fan] = sum(map(len, angles))
                angles.append(fan.angles)
        self.spreads: Array = np.array([fan[:2] for fan in fans]).reshape(-1, 2)
        self.places: Indices = np.array([begins[fan] for fan in fans], dtype=np.int64)
        every = np.concatenate(angles)
        self.directions: Array = np.array([np.cos(every), np.sin(every)])


@compiled()
def _cut(
    nearest: Array, spread: Array, directions: Array, ax: float, ay: float, bx: float, by: float
) -> None:
    """Shorten beams (n,) to where they meet a segment a-b, given in the scanner's frame [m].

    A beam `r d` meets the line through `a` and `b` where `r = (a x b) / (d x (b - a))`, with `x`
    the cross product. The solid is on the left of a segment, so a scanner that sees it sees it run
    clockwise. A segment across the seam of a fan meets beams at both ends of the fan.
    """
    area = ax * by - ay * bx
    if area >= 0:
        return
    ex, ey = bx - ax, by - ay
    begin, increment, last = spread[0], spread[1], len(nearest) - 1
    second = math.atan2(by, bx)
    width = math.atan2(ay, ax) - second
    width -= math.tau * math.floor(width / math.tau)
    right = second - begin
    right -= math.tau * math.floor(right / math.tau)
    for _ in range(2):
        low = max(math.ceil(right / increment - CORNER), 0)
        high = min(math.floor((right + width) / increment + CORNER), last)
        for beam in range(low, high + 1):
            cross = directions[0, beam] * ey - directions[1, beam] * ex
            nearest[beam] = min(nearest[beam], area / min(cross, EDGE_ON))
        right -= math.tau


@compiled(
    "float64[::1](float64[:, ::1], int64[::1], int64[::1],"
    " float64[:, ::1], int64[::1], float64[:, ::1], float64[:, :, ::1], int64[::1],"
    " float64[:, ::1], float64[:, :, ::1], float64[::1], float64[::1])"
)
def cast(
    origins: Array,
    rows: Indices,
    starts: Indices,
    spreads: Array,
    places: Indices,
    directions: Array,
    segments: Array,
    firsts: Indices,
    poses: Array,
    points: Array,
    radii: Array,
    ranges: Array,
) -> Array:
    """Return how far beams reach until they hit a segment or a robot.

    Args:
        origins: (m, 3) poses of m scanners, frame map [m, m, rad].
        rows: (m,) the robot of each scanner, which it does not see.
        starts: (m + 1,) where the beams of each begin in the result.
        spreads: See `Fans`; one row for each robot.
        places: See `Fans`.
        directions: See `Fans`.
        segments: (k, 2, 2) each with the solid on its left, frame map [m].
        firsts: (m + 1,) where the segments near each scanner begin.
        poses: (n, 3) of all robots, frame map.
        points: See `Footprints`.
        radii: See `Footprints`.
        ranges: (n,) how far the robots' scanners look [m].

    Returns:
        The distances [m] of all beams, scanner by scanner, infinite for a beam that hits nothing.
    """
    nearest = np.full(starts[-1], np.inf)
    for i in range(len(origins)):
        row, x, y = rows[i], origins[i, 0], origins[i, 1]
        cos, sin = math.cos(origins[i, 2]), math.sin(origins[i, 2])
        mine = nearest[starts[i] : starts[i + 1]]
        beams = directions[:, places[row] :]
        for k in range(firsts[i], firsts[i + 1]):
            ax, ay = segments[k, 0, 0] - x, segments[k, 0, 1] - y
            bx, by = segments[k, 1, 0] - x, segments[k, 1, 1] - y
            ax, ay = cos * ax + sin * ay, cos * ay - sin * ax
            bx, by = cos * bx + sin * by, cos * by - sin * bx
            _cut(mine, spreads[row], beams, ax, ay, bx, by)
        for other in range(len(poses)):
            dx, dy = poses[other, 0] - x, poses[other, 1] - y
            reach = ranges[row] + radii[other]
            if other == row or dx * dx + dy * dy > reach * reach:
                continue
            ahead, left = cos * dx + sin * dy, cos * dy - sin * dx
            turned = poses[other, 2] - origins[i, 2]
            cos_turned, sin_turned = math.cos(turned), math.sin(turned)
            bx = by = 0.0
            for corner in range(-1, points.shape[1]):
                px, py = points[other, corner, 0], points[other, corner, 1]
                ax, ay = bx, by
                bx = ahead + cos_turned * px - sin_turned * py
                by = left + sin_turned * px + cos_turned * py
                if corner >= 0:
                    _cut(mine, spreads[row], beams, ax, ay, bx, by)
    return nearest
