# SPDX-License-Identifier: BSD-3-Clause
"""Planar geometry: where is a corner, do two bodies touch.

Every solid is a set of segments, walls and footprints of robots alike, so the answers are exact.

Points are arrays (n, 2) [m]. Segments are arrays (k, 2, 2) of k segments, their two ends, x and y
[m]; seen from the first end, the solid is on the left. All are in one frame.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, TypeAlias

import numpy as np
from numpy.typing import ArrayLike, NDArray

if TYPE_CHECKING:
    from hive_common.pose import Pose

Array: TypeAlias = NDArray[np.float64]  # numbers; each use states the shape
Indices: TypeAlias = NDArray[np.intp]  # row numbers of another array

NO_SEGMENTS: Array = np.empty((0, 2, 2))


def outline(corners: Array) -> Array:
    """Return the edges (n, 2, 2) of a polygon with corners (n, 2)."""
    return np.stack([corners, np.roll(corners, -1, axis=0)], axis=1)


def pass_through(ends: Array) -> NDArray[np.bool_]:
    """Return which of k segments pass through a convex polygon (Cyrus and Beck's clipping, 1978).

    A segment along an edge does not.

    Args:
        ends: (k, 2, c) distances of both ends of each segment from the lines through the c edges,
            positive outside [m].
    """
    start = ends[:, 0]
    along = ends[:, 1] - start
    level = along == 0
    crossing = -start / np.where(level, 1.0, along)
    enter = np.where(along < 0, crossing, 0.0).max(axis=1)
    leave = np.where(along > 0, crossing, 1.0).min(axis=1)
    beside = (level & (start >= 0)).any(axis=1)
    through: NDArray[np.bool_] = (np.maximum(enter, 0.0) < np.minimum(leave, 1.0)) & ~beside
    return through


class Footprint:
    """A convex polygon that can be placed anywhere.

    Attributes:
        corners: (n, 2) counter-clockwise around the origin of its own frame [m].
        radius: Radius of the circle around the origin that holds it [m].
        normals: (n, 2) outward normals of the edges; each starts at the corner of its row.
        limits: (n,) distances of the edges from the origin [m].
    """

    def __init__(self, corners: ArrayLike) -> None:
        """Take the corners (n, 2) of a convex polygon, counter-clockwise [m]."""
        self.corners: Array = np.asarray(corners, dtype=float)
        self.radius = float(np.hypot(self.corners[:, 0], self.corners[:, 1]).max())
        edges = np.roll(self.corners, -1, axis=0) - self.corners
        normals = np.stack([edges[:, 1], -edges[:, 0]], axis=1)
        self.normals: Array = normals / np.hypot(edges[:, 0], edges[:, 1])[:, None]
        self.limits: Array = (self.normals * self.corners).sum(axis=1)

    def at(self, pose: Pose) -> Array:
        """Return the corners (n, 2) of the polygon at `pose`, in the frame of that pose."""
        cos, sin = math.cos(pose.yaw), math.sin(pose.yaw)
        corners: Array = self.corners @ np.array([[cos, sin], [-sin, cos]]) + pose[:2]
        return corners

    def touched(self, pose: Pose, segments: Array, margin: float = 0.0) -> NDArray[np.bool_]:
        """Return which segments (k, 2, 2) pass through the polygon at `pose`; see `pass_through`.

        `margin` moves its edges outwards [m].
        """
        cos, sin = math.cos(pose.yaw), math.sin(pose.yaw)
        normals = self.normals @ np.array([[cos, sin], [-sin, cos]])
        return pass_through((segments - pose[:2]) @ normals.T - (self.limits + margin))

    def touches(self, pose: Pose, segments: Array, margin: float = 0.0) -> bool:
        """Return whether any segment passes through the polygon; see `touched`."""
        return bool(self.touched(pose, segments, margin).any())
