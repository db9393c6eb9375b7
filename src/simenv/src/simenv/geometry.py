# SPDX-License-Identifier: BSD-3-Clause
"""What a planar simulator asks: where is a corner, what does a beam hit, do two things touch.

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
    from robot_description.follower import Pose

Array: TypeAlias = NDArray[np.float64]
"""Any array of numbers; its shape is said where it is used."""

CORNER = 1e-9
"""By what share a segment is taken to be longer, lest a beam slips through between two."""

NO_SEGMENTS: Array = np.empty((0, 2, 2))


def wrap(angle: float) -> float:
    """Return an angle [rad] in -pi..pi."""
    return math.remainder(angle, math.tau)


def outline(corners: Array) -> Array:
    """Return the edges (n, 2, 2) of the closed polygon with these corners (n, 2)."""
    return np.stack([corners, np.roll(corners, -1, axis=0)], axis=1)


def ranges(origin: Pose, angles: Array, segments: Array) -> Array:
    """Return how far beams reach before they hit a segment.

    A beam `o + r d` meets the segment `a + u e` where `r = (a x e) / (d x e)` and
    `u = (a x d) / (d x e)`, with a counted from o and `x` the cross product; it counts if r >= 0
    and 0 <= u <= 1.

    Args:
        origin: Where the beams start.
        angles: (n,) directions of the beams from the heading of `origin` [rad].
        segments: (k, 2, 2) what can be hit; each with the solid on its left, so that those at
            the far side of things are left out at once.

    Returns:
        (n,) distances [m]; infinity for a beam that hits nothing.
    """
    start = segments[:, 0] - origin[:2]
    along = segments[:, 1] - segments[:, 0]
    area = start[:, 0] * along[:, 1] - start[:, 1] * along[:, 0]
    facing = area < 0
    if not facing.any():
        return np.full(len(angles), np.inf)
    start, along, area = start[facing], along[facing], area[facing]
    heading = angles + origin.yaw
    dx, dy = np.cos(heading)[:, None], np.sin(heading)[:, None]
    with np.errstate(divide="ignore", invalid="ignore"):
        scale = 1.0 / (dx * along[:, 1] - dy * along[:, 0])
        u = (dy * start[:, 0] - dx * start[:, 1]) * scale
        r = area * scale
    r[~((r >= 0) & (u >= -CORNER) & (u <= 1 + CORNER))] = np.inf
    nearest: Array = r.min(axis=1)
    return nearest


class Footprint:
    """A convex polygon that can be put down anywhere.

    Attributes:
        corners: (n, 2) counter-clockwise, around the origin of its own frame [m].
        radius: Of the circle around the origin that holds it [m].
    """

    def __init__(self, corners: ArrayLike) -> None:
        """Take the corners (n, 2) of a convex polygon, counter-clockwise [m]."""
        self.corners: Array = np.asarray(corners, dtype=float)
        self.radius = float(np.hypot(self.corners[:, 0], self.corners[:, 1]).max())
        edges = np.roll(self.corners, -1, axis=0) - self.corners
        normals = np.stack([edges[:, 1], -edges[:, 0]], axis=1)
        self._normals: Array = normals / np.hypot(edges[:, 0], edges[:, 1])[:, None]
        self._limits: Array = (self._normals * self.corners).sum(axis=1)

    def at(self, pose: Pose) -> Array:
        """Return the corners (n, 2) when it stands at `pose`, in the frame of that pose."""
        cos, sin = math.cos(pose.yaw), math.sin(pose.yaw)
        corners: Array = self.corners @ np.array([[cos, sin], [-sin, cos]]) + pose[:2]
        return corners

    def touches(self, pose: Pose, segments: Array, margin: float = 0.0) -> bool:
        """Say whether any segment passes through it (Cyrus and Beck's clipping, 1978).

        A segment that only runs along an edge does not count.

        Args:
            pose: Where it stands.
            segments: (k, 2, 2) what may be in the way, in the frame of that pose.
            margin: By how much its edges are moved outwards first [m].
        """
        if not len(segments):
            return False
        cos, sin = math.cos(pose.yaw), math.sin(pose.yaw)
        normals = self._normals @ np.array([[cos, sin], [-sin, cos]])
        ends = (segments - pose[:2]) @ normals.T - (self._limits + margin)
        start = ends[:, 0]
        along = ends[:, 1] - start
        with np.errstate(divide="ignore", invalid="ignore"):
            crossing = -start / along
        enter = np.where(along < 0, crossing, 0.0).max(axis=1)
        leave = np.where(along > 0, crossing, 1.0).min(axis=1)
        beside = ((along == 0) & (start >= 0)).any(axis=1)
        inside = (np.maximum(enter, 0.0) < np.minimum(leave, 1.0)) & ~beside
        return bool(inside.any())


class Nearby:
    """Finds the segments near a place without looking at all of them.

    The plane is cut into squares of 1 m; the segments that matter to a square are sought when a
    robot first comes there, and kept.
    """

    def __init__(self, segments: Array) -> None:
        """Take the segments (k, 2, 2) that stand still, frame map [m]."""
        self._low = segments.min(axis=1)
        self._high = segments.max(axis=1)
        self._segments = segments
        self._found: dict[tuple[int, int, float], Array] = {}

    def at(self, x: float, y: float, reach: float) -> Array:
        """Return the segments (k, 2, 2) within `reach` [m] of (x, y), and some more."""
        square = (math.floor(x), math.floor(y))
        key = (*square, reach)
        if key not in self._found:
            near = (self._low <= np.add(square, 1 + reach)) & (
                self._high >= np.subtract(square, reach)
            )
            self._found[key] = self._segments[near.all(axis=1)]
        return self._found[key]
