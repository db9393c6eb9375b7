# SPDX-License-Identifier: BSD-3-Clause
"""Moves particles as the odometry says, with noise: amcl's `diff` and `omni` models.

`diff` is the odometry motion model of Thrun, Burgard and Fox, "Probabilistic Robotics", 2005,
section 5.4: a move is a turn, a straight drive and a turn, each with an error that grows with the
distance and the angle. `omni` is that of ROS's amcl: a drive with errors along and across it.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from hive_common.geometry import Array
    from hive_common.pose import Pose
    from hive_navigation.localization.amcl_settings import AmclSettings

ON_THE_SPOT = 0.01  # a shorter drive has no direction [m]; the same as in ROS's amcl


def spread(poses: Array, move: Pose, settings: AmclSettings, random: np.random.Generator) -> Array:
    """Return poses (n, 3) after a move, frame map [m, m, rad].

    Args:
        poses: (n, 3) before the move.
        move: The move by odometry, in the robot's frame before it.
        settings: The `odom_*` settings apply.
        random: Source of the noise.
    """
    model = _omni if settings.odom_model_type.startswith("omni") else _diff
    moved = model(poses, move, settings, random.normal(size=(3, len(poses))))
    wrap_yaws(moved)
    return moved


def wrap_yaws(poses: Array) -> None:
    """Bring the yaws of poses (n, 3) into [-pi, pi), in place."""
    poses[:, 2] = np.remainder(poses[:, 2] + np.pi, 2 * np.pi) - np.pi


def _diff(poses: Array, move: Pose, settings: AmclSettings, noise: Array) -> Array:
    distance = math.hypot(move.x, move.y)
    first = math.atan2(move.y, move.x) if distance >= ON_THE_SPOT else 0.0
    second = math.remainder(move.yaw - first, math.tau)
    # Driving backwards is straight too, not half a turn before and another one after.
    turns = [min(abs(turn), math.pi - abs(turn)) for turn in (first, second)]
    a1, a2, a3, a4, _ = settings.odom_alphas
    deviations = (
        math.sqrt(a1 * turns[0] ** 2 + a2 * distance**2),
        math.sqrt(a3 * distance**2 + a4 * (turns[0] ** 2 + turns[1] ** 2)),
        math.sqrt(a1 * turns[1] ** 2 + a2 * distance**2),
    )
    turn = first + deviations[0] * noise[0]
    driven = distance + deviations[1] * noise[1]
    heading = poses[:, 2] + turn
    after = heading + second + deviations[2] * noise[2]
    x, y = driven * np.cos(heading), driven * np.sin(heading)
    return np.stack([poses[:, 0] + x, poses[:, 1] + y, after], axis=1)


def _omni(poses: Array, move: Pose, settings: AmclSettings, noise: Array) -> Array:
    distance, turn = math.hypot(move.x, move.y), abs(move.yaw)
    direction = math.atan2(move.y, move.x) if distance >= ON_THE_SPOT else 0.0
    a1, a2, a3, a4, a5 = settings.odom_alphas
    along = distance + noise[0] * math.sqrt(a3 * distance**2 + a4 * turn**2)
    across = noise[1] * math.sqrt(a4 * turn**2 + a5 * distance**2)
    after = poses[:, 2] + move.yaw
    after += noise[2] * math.sqrt(a1 * turn**2 + a2 * distance**2)
    heading = poses[:, 2] + direction
    cos, sin = np.cos(heading), np.sin(heading)
    x = poses[:, 0] + cos * along - sin * across
    y = poses[:, 1] + sin * along + cos * across
    return np.stack([x, y, after], axis=1)
