# SPDX-License-Identifier: BSD-3-Clause
"""What laser beams hit, for many scanners at once.

Each segment meets a range of neighbouring beams. So no beam is tried with every segment: the
bearings of a segment's ends tell which beams meet it, and only those are cut with it. The cuts are
exact, without a raster.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from hive_common.geometry import cos_and_sin

if TYPE_CHECKING:
    from collections.abc import Sequence

    from hive_common.geometry import Array, Indices

CORNER = 1e-6
"""Share of the angle between two beams by which a segment counts as wider, so that no beam slips
through between it and its neighbour."""

EDGE_ON = -1e-12  # limit of the cross product of a beam and a segment that faces it [m]


class Fan:
    """The directions of a scanner's beams, evenly spaced.

    Attributes:
        angles: (n,) counter-clockwise from the scanner's heading [rad].
        directions: (2, n) unit vectors of these directions.
        spread: (3,) first angle, increment [rad], number.
    """

    def __init__(self, first: float, increment: float, number: int) -> None:
        """Spread `number` beams from the angle `first` on, each `increment` further [rad]."""
        self.angles: Array = first + np.arange(number) * increment
        self.spread: Array = np.array([first, increment, number])
        self.directions: Array = np.array([np.cos(self.angles), np.sin(self.angles)])


def cast(
    fans: Sequence[Fan], origins: Array, segments: Array, owners: Indices
) -> tuple[Array, Indices]:
    """Return how far beams reach until they hit a segment.

    A beam `r d` meets the line through `a` and `a + e` where `r = (a x e) / (d x e)`, with `x` the
    cross product and everything counted from the scanner.

    Args:
        fans: Beams of m scanners.
        origins: (m, 3) poses of the scanners, frame map [m, m, rad].
        segments: (k, 2, 2) frame map [m]; each with the solid on its left, so that those on the
            far side of things drop out at once.
        owners: (k,) the scanner that each segment is near, an index of `fans`.

    Returns:
        The distances [m] of all beams, scanner by scanner, infinite for a beam that hits nothing;
        and (m + 1,) where those of each scanner begin.
    """
    starts = np.cumsum([0, *(len(fan.angles) for fan in fans)])
    nearest: Array = np.full(starts[-1], np.inf)
    x, y = _seen_from(origins[owners], segments)
    area = x[:, 0] * y[:, 1] - y[:, 0] * x[:, 1]
    facing = area < 0
    x, y, area, owners = x[facing], y[facing], area[facing], owners[facing]
    which, low, count = _hidden(fans, owners, np.arctan2(y, x))
    if not len(which):
        return nearest, starts
    ends = count.cumsum()
    beams = np.arange(ends[-1]) + (starts[owners[which]] + low - ends + count).repeat(count)
    x, y, area = x[which], y[which], area[which]
    cos, sin = np.concatenate([fan.directions for fan in fans], axis=1)
    cross = cos[beams] * (y[:, 1] - y[:, 0]).repeat(count)
    cross -= sin[beams] * (x[:, 1] - x[:, 0]).repeat(count)
    reach = area.repeat(count) / np.minimum(cross, EDGE_ON)
    # Sort the cuts of each beam next to each other.
    met = np.bincount(beams, minlength=len(nearest))
    hit = met.nonzero()[0]
    order = beams.astype(np.min_scalar_type(len(nearest))).argsort(kind="stable")
    nearest[hit] = np.minimum.reduceat(reach[order], (met.cumsum() - met)[hit])
    return nearest, starts


def _seen_from(origins: Array, segments: Array) -> tuple[Array, Array]:
    """Return x and y (k, 2) of the ends of segments, each in the frame of its scanner."""
    x = segments[:, :, 0] - origins[:, 0:1]
    y = segments[:, :, 1] - origins[:, 1:2]
    cos, sin = cos_and_sin(origins[:, 2:])
    return cos * x + sin * y, cos * y - sin * x


def _hidden(
    fans: Sequence[Fan], owners: Indices, bearings: Array
) -> tuple[Indices, Indices, Indices]:
    """Return the ranges of beams that meet segments which face their scanner.

    The solid is on the left of a segment, so the scanner sees it run clockwise from its first end
    to its second. A segment across the seam of a fan has a range at both ends of the fan.

    Args:
        fans: Beams of all scanners.
        owners: (k,) the scanner of each segment.
        bearings: (k, 2) of the segments' ends in the scanner's frame [rad].

    Returns:
        For each range: the segment, the first beam, how many beams.
    """
    begin, increment, number = np.array([fan.spread for fan in fans])[owners].T
    second = bearings[:, 1]
    right = np.remainder(second - begin, math.tau) - [[0.0], [math.tau]]
    left = right + np.remainder(bearings[:, 0] - second, math.tau)
    low = np.ceil(right / increment - CORNER)
    high = np.floor(left / increment + CORNER)
    low = np.maximum(low, 0.0).astype(int)
    count = np.minimum(high, number - 1.0).astype(int) - low + 1
    seam, which = (count > 0).nonzero()
    return which, low[seam, which], count[seam, which]
