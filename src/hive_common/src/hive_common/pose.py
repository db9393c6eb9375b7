# SPDX-License-Identifier: BSD-3-Clause
"""Poses and velocities in the plane, and moves between poses (REP-103 units, REP-105 frames)."""

from __future__ import annotations

import math
from typing import NamedTuple

FARTHEST = 100_000.0
"""Greatest coordinate [m]: no site is larger than this. What arrives from outside and is farther
away is refused, so that the arithmetic of cells and distances never overflows."""

MOST_TURNED = 1000.0
"""Greatest heading [rad]: some programs count turns rather than stay within pi."""


class Pose(NamedTuple):
    """A position and heading; in the map frame unless said otherwise."""

    x: float  # [m]
    y: float  # [m]
    yaw: float = 0.0  # heading, counter-clockwise from the x axis [rad]

    @property
    def is_finite(self) -> bool:
        """Whether no number is `nan` or infinite."""
        return all(map(math.isfinite, self))

    @property
    def flaw(self) -> str:
        """What is wrong with the numbers, in words for a person; empty if nothing is."""
        if not self.is_finite:
            return "is not made of finite numbers"
        if max(abs(self.x), abs(self.y)) > FARTHEST:
            return f"is farther from the origin than {FARTHEST / 1000:g} km"
        if abs(self.yaw) > MOST_TURNED:
            return f"has a heading of more than {MOST_TURNED:g} rad"
        return ""

    def distance_to(self, other: Pose) -> float:
        """Return the straight-line distance to another position [m]."""
        return math.hypot(other.x - self.x, other.y - self.y)

    def __str__(self) -> str:
        return f"({self.x:.2f}, {self.y:.2f})"


class Velocity(NamedTuple):
    """Velocity of a base: vx forward, vy left [m/s], wz counter-clockwise [rad/s]."""

    vx: float = 0.0
    vy: float = 0.0
    wz: float = 0.0


STOP = Velocity()


def compose(frame: Pose, pose: Pose) -> Pose:
    """Return a pose of a frame in the frame's parent."""
    cos, sin = math.cos(frame.yaw), math.sin(frame.yaw)
    x = frame.x + cos * pose.x - sin * pose.y
    y = frame.y + sin * pose.x + cos * pose.y
    return Pose(x, y, math.remainder(frame.yaw + pose.yaw, math.tau))


def inverse(frame: Pose) -> Pose:
    """Return the pose of the parent in a frame."""
    cos, sin = math.cos(frame.yaw), math.sin(frame.yaw)
    return Pose(-cos * frame.x - sin * frame.y, sin * frame.x - cos * frame.y, -frame.yaw)


def between(before: Pose, after: Pose) -> Pose:
    """Return the move from one pose to another, in the frame of the first."""
    return compose(inverse(before), after)


def blend(before: Pose, after: Pose, share: float) -> Pose:
    """Return the pose at `share` (0..1) of the way; the yaw takes the shorter turn."""
    turn = math.remainder(after.yaw - before.yaw, math.tau)
    return Pose(
        before.x + share * (after.x - before.x),
        before.y + share * (after.y - before.y),
        math.remainder(before.yaw + share * turn, math.tau),
    )
