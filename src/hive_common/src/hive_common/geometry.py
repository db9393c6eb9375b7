# SPDX-License-Identifier: BSD-3-Clause
"""What a planar simulator asks: where is a corner, do two things touch, what is near.

Everything solid is a set of segments: the outline of the world's walls and the footprints of the
robots alike. The answers are exact, there is no raster between the world and the robots.

Points are arrays (n, 2) [m]; segments are arrays (k, 2, 2): k segments, their two ends, x and y
[m], with the solid on the left as one goes from the first end to the second; all in one frame.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, TypeAlias

import numpy as np
from numpy.typing import ArrayLike, NDArray

if TYPE_CHECKING:
    from hive_common.pose import Pose

Array: TypeAlias = NDArray[np.float64]
"""Any array of numbers; its shape is said where it is used."""

Indices: TypeAlias = NDArray[np.intp]
"""Any array of rows of another one."""

NO_SEGMENTS: Array = np.empty((0, 2, 2))


def wrap(angle: float) -> float:
    """Return an angle [rad] in -pi..pi."""
    return math.remainder(angle, math.tau)


def cos_and_sin(angles: Array) -> tuple[Array, Array]:
    """Return the cosines and sines of angles [rad], to the last bit the same in every batch.

    With AVX-512, numpy 1.24 takes different ways through an array that is a column of another one,
    which differ in the last bit, depending on how many numbers there are.
    """
    compact = np.ascontiguousarray(angles)
    return np.cos(compact), np.sin(compact)


def outline(corners: Array) -> Array:
    """Return the edges (n, 2, 2) of the closed polygon with these corners (n, 2)."""
    return np.stack([corners, np.roll(corners, -1, axis=0)], axis=1)


def pass_through(ends: Array) -> NDArray[np.bool_]:
    """Say which segments pass through a convex polygon (Cyrus and Beck's clipping, 1978).

    A segment that only runs along an edge does not count.

    Args:
        ends: (k, 2, c) how far both ends of each of k segments are outside of the line through
            each of the c edges [m].

    Returns:
        (k,)
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


def distances(points: Array, segments: Array) -> Array:
    """Return how far points (k, 2) are from segments (k, 2, 2), each from its own: (k,) [m]."""
    start = segments[:, 0]
    along, off = segments[:, 1] - start, points - start
    length = np.einsum("ij,ij->i", along, along)
    share = np.einsum("ij,ij->i", along, off) / np.where(length > 0, length, 1.0)
    x, y = (off - along * np.clip(share, 0.0, 1.0)[:, None]).T
    found: Array = np.hypot(x, y)
    return found


class Footprint:
    """A convex polygon that can be put down anywhere.

    Attributes:
        corners: (n, 2) counter-clockwise, around the origin of its own frame [m].
        radius: Of the circle around the origin that holds it [m].
        normals: (n, 2) of the edge from each corner to the next, outwards.
        limits: (n,) how far each edge is from the origin [m].
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
        """Return the corners (n, 2) when it stands at `pose`, in the frame of that pose."""
        cos, sin = math.cos(pose.yaw), math.sin(pose.yaw)
        corners: Array = self.corners @ np.array([[cos, sin], [-sin, cos]]) + pose[:2]
        return corners

    def touched(self, pose: Pose, segments: Array, margin: float = 0.0) -> NDArray[np.bool_]:
        """Say which segments pass through it; see `pass_through`.

        Args:
            pose: Where it stands.
            segments: (k, 2, 2) what may be in the way, in the frame of that pose.
            margin: By how much its edges are moved outwards first [m].

        Returns:
            (k,)
        """
        cos, sin = math.cos(pose.yaw), math.sin(pose.yaw)
        normals = self.normals @ np.array([[cos, sin], [-sin, cos]])
        return pass_through((segments - pose[:2]) @ normals.T - (self.limits + margin))

    def touches(self, pose: Pose, segments: Array, margin: float = 0.0) -> bool:
        """Say whether any segment passes through it; see `touched`."""
        return bool(self.touched(pose, segments, margin).any())


FINENESS = 0.25
"""See `Nearby` [m]."""


class Nearby:
    """Finds the segments near a place without looking at all of them.

    The plane is cut into squares of 1 m; the segments that matter to a square are sought when a
    robot first comes there, and kept.

    Reaches are rounded up to whole `FINENESS`, so that few kinds of them are kept.
    """

    def __init__(self, segments: Array) -> None:
        """Take the segments (k, 2, 2) that stand still, frame map [m]."""
        self._low = segments.min(axis=1)
        self._high = segments.max(axis=1)
        self._segments = segments
        self._found: dict[tuple[int, int, int], Array] = {}

    def at(self, x: float, y: float, reach: float) -> Array:
        """Return the segments (k, 2, 2) within `reach` [m] of (x, y), and some more."""
        square = (math.floor(x), math.floor(y))
        steps = math.ceil(reach / FINENESS)
        key = (*square, steps)
        if key not in self._found:
            reach = steps * FINENESS
            near = (self._low <= np.add(square, 1 + reach)) & (
                self._high >= np.subtract(square, reach)
            )
            self._found[key] = self._segments[near.all(axis=1)]
        return self._found[key]
