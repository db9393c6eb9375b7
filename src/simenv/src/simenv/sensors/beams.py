# SPDX-License-Identifier: BSD-3-Clause
"""What the beams of scanners hit: the beams of many scanners and all that is near them at once.

Each segment hides a range of neighbouring beams from what is behind it. So no beam is tried with
every segment: the bearings of a segment's ends say which beams meet it, and only those are cut
with it. The cuts are exact, there is no raster.
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
"""By what share of the angle between two beams a segment counts as wider, lest a beam slips
through between it and its neighbour."""

EDGE_ON = -1e-12
"""The least that the cross product of a beam and a segment facing it is taken for [m]."""


class Fan:
    """The directions of a scanner's beams, evenly spread.

    Attributes:
        angles: (n,) counter-clockwise from the scanner's heading [rad].
        directions: (2, n) of unit vectors that way, x and y.
        spread: (3,) the first angle, from one to the next [rad], how many.
    """

    def __init__(self, first: float, increment: float, number: int) -> None:
        """Spread `number` beams from the angle `first` on, each `increment` further [rad]."""
        self.angles: Array = first + np.arange(number) * increment
        self.spread: Array = np.array([first, increment, number])
        self.directions: Array = np.array([np.cos(self.angles), np.sin(self.angles)])


def cast(
    fans: Sequence[Fan], origins: Array, segments: Array, owners: Indices
) -> tuple[Array, Indices]:
    """Return how far beams reach before they hit a segment.

    A beam `r d` meets the line through `a` and `a + e` where `r = (a x e) / (d x e)`, with `x` the
    cross product and everything counted from the scanner.

    Args:
        fans: Of m scanners.
        origins: (m, 3) where the scanners are, frame map [m, m, rad].
        segments: (k, 2, 2) what can be hit, frame map [m]; each with the solid on its left, so
            that those at the far side of things are left out at once.
        owners: (k,) which scanner each segment is near to, an index of `fans`.

    Returns:
        The distances [m] of all beams, those of one scanner after those of the other, infinity
        for a beam that hits nothing; and (m + 1,) where those of each scanner begin.
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
    # Of a beam that meets several segments, the cuts are laid beside each other.
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
    """Return what ranges of beams meet segments that face their scanner.

    The solid is on the left of a segment, so as the scanner sees it, it runs clockwise from its
    first end to its second. One that lies across the seam of a fan has a range at both ends.

    Args:
        fans: Of all scanners.
        owners: (k,) the scanner of each segment.
        bearings: (k, 2) of their ends in the scanner's frame [rad].

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
