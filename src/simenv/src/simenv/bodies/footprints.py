# SPDX-License-Identifier: BSD-3-Clause
"""The footprints of all robots in arrays, so that one call handles all of them.

Footprints with fewer corners than others repeat their last one: the edge between it and itself has
no length, and its normal is that of the edge before, so neither beams nor clipping notice.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from hive_common.geometry import cos_and_sin, pass_through

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

    from hive_common.geometry import Array, Footprint, Indices


class Footprints:
    """The footprints of n robots; row i of every array belongs to robot i.

    Attributes:
        corners: Corners of each footprint, with repetitions.
        radii: (n,) of the circles around the bases that hold the footprints [m].
    """

    def __init__(self, footprints: Sequence[Footprint]) -> None:
        """Put the footprints into arrays."""
        self.corners = max((len(each.corners) for each in footprints), default=0)
        self.radii = np.array([each.radius for each in footprints])
        self._points = self._even([each.corners for each in footprints])
        self._normals = self._even([each.normals for each in footprints])
        self._limits = (self._normals * self._points).sum(axis=2)

    def _even(self, arrays: Sequence[Array]) -> Array:
        """Return arrays (c, 2) as one (n, corners, 2), the last rows repeated."""
        rows = [np.concatenate([a, a[[-1] * (self.corners - len(a))]]) for a in arrays]
        return np.array(rows).reshape(len(rows), self.corners, 2)

    def outlines(self, rows: Indices, poses: Array) -> Array:
        """Return the edges (k, corners, 2, 2) [m] of the robots `rows` (k,) at `poses` (k, 3).

        Everything is in the frame map; the robot is on the left of each edge.
        """
        edges = np.empty((len(rows), self.corners, 2, 2))
        edges[:, :, 0] = _turned(self._points[rows], poses[:, 2]) + poses[:, None, :2]
        edges[:, :-1, 1] = edges[:, 1:, 0]
        edges[:, -1, 1] = edges[:, 0, 0]
        return edges

    def touched(
        self, rows: Indices, poses: Array, segments: Array, margins: Array
    ) -> NDArray[np.bool_]:
        """Return (k,) in which pairs of a robot and a segment the segment crosses the robot.

        Args:
            rows: (k,) the robot of each pair.
            poses: (k, 3) where it stands, frame map [m, m, rad].
            segments: (k, 2, 2) the segment of each pair, frame map [m].
            margins: (k,) by how much the robot's edges are moved outwards first [m].
        """
        normals = _turned(self._normals[rows], poses[:, 2])
        ends = (segments - poses[:, None, :2]) @ normals.transpose(0, 2, 1)
        ends -= (self._limits[rows] + margins[:, None])[:, None]
        return pass_through(ends)


def _turned(points: Array, angles: Array) -> Array:
    """Return points (k, c, 2) turned by angles (k,) [rad] around the origin."""
    cos, sin = cos_and_sin(angles[:, None])
    x, y = points[:, :, 0], points[:, :, 1]
    turned = np.empty_like(points)
    turned[:, :, 0] = cos * x - sin * y
    turned[:, :, 1] = sin * x + cos * y
    return turned
