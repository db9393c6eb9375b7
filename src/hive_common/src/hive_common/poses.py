# SPDX-License-Identifier: BSD-3-Clause
"""Poses in the plane: from one frame into another, and between two moments."""

from __future__ import annotations

import math

from robot_description.follower import Pose


def compose(frame: Pose, pose: Pose) -> Pose:
    """Return where a pose, given in a frame, is in the frame's own parent."""
    cos, sin = math.cos(frame.yaw), math.sin(frame.yaw)
    x = frame.x + cos * pose.x - sin * pose.y
    y = frame.y + sin * pose.x + cos * pose.y
    return Pose(x, y, math.remainder(frame.yaw + pose.yaw, math.tau))


def inverse(frame: Pose) -> Pose:
    """Return the parent's pose in a frame."""
    cos, sin = math.cos(frame.yaw), math.sin(frame.yaw)
    return Pose(-cos * frame.x - sin * frame.y, sin * frame.x - cos * frame.y, -frame.yaw)


def between(before: Pose, after: Pose) -> Pose:
    """Return the move from one pose to another, seen from the first."""
    return compose(inverse(before), after)


def blend(before: Pose, after: Pose, share: float) -> Pose:
    """Return the pose at `share` (0..1) of a short way; the yaw goes the shorter way round."""
    turn = math.remainder(after.yaw - before.yaw, math.tau)
    return Pose(
        before.x + share * (after.x - before.x),
        before.y + share * (after.y - before.y),
        math.remainder(before.yaw + share * turn, math.tau),
    )
