# SPDX-License-Identifier: BSD-3-Clause
"""Where particles may be after a move that the odometry tells: amcl's `diff` and `omni` models.

The odometry motion model of Thrun, Burgard and Fox, "Probabilistic Robotics", 2005, section 5.4:
a move is a turn, a straight way and a turn, each uncertain by how far the robot went and turned.
The holonomic one is that of ROS's amcl: a way with an error along and one across it.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from hive_common.pose import Pose
    from robot_navigation.localization.amcl_settings import AmclSettings

    Array = NDArray[np.float64]

ON_THE_SPOT = 0.01
"""A way shorter than this has no direction [m]; the same as in ROS's amcl."""


def spread(poses: Array, move: Pose, settings: AmclSettings, random: np.random.Generator) -> Array:
    """Return where particles may be after a move.

    Args:
        poses: (n, 3) before, frame map [m, m, rad].
        move: From the odometry's pose before to the one after, seen from the one before.
        settings: `odom_*` count.
        random: Where the noise comes from.

    Returns:
        (n, 3) poses after.
    """
    model = _across if settings.odom_model_type == "omni" else _turn_go_turn
    moved = model(poses, move, settings, random.normal(size=(3, len(poses))))
    moved[:, 2] = np.remainder(moved[:, 2] + np.pi, 2 * np.pi) - np.pi
    return moved


def _turn_go_turn(poses: Array, move: Pose, settings: AmclSettings, noise: Array) -> Array:
    way = math.hypot(move.x, move.y)
    first = math.atan2(move.y, move.x) if way >= ON_THE_SPOT else 0.0
    second = math.remainder(move.yaw - first, math.tau)
    # Backwards is a straight way too, not half a turn before and another behind.
    turns = [min(abs(turn), math.pi - abs(turn)) for turn in (first, second)]
    deviations = (
        math.sqrt(settings.odom_alpha1 * turns[0] ** 2 + settings.odom_alpha2 * way**2),
        math.sqrt(
            settings.odom_alpha3 * way**2 + settings.odom_alpha4 * (turns[0] ** 2 + turns[1] ** 2)
        ),
        math.sqrt(settings.odom_alpha1 * turns[1] ** 2 + settings.odom_alpha2 * way**2),
    )
    turn = first + deviations[0] * noise[0]
    gone = way + deviations[1] * noise[1]
    heading = poses[:, 2] + turn
    after = heading + second + deviations[2] * noise[2]
    x, y = gone * np.cos(heading), gone * np.sin(heading)
    return np.stack([poses[:, 0] + x, poses[:, 1] + y, after], axis=1)


def _across(poses: Array, move: Pose, settings: AmclSettings, noise: Array) -> Array:
    way, turn = math.hypot(move.x, move.y), abs(move.yaw)
    direction = math.atan2(move.y, move.x) if way >= ON_THE_SPOT else 0.0
    along = way + noise[0] * math.sqrt(
        settings.odom_alpha3 * way**2 + settings.odom_alpha4 * turn**2
    )
    across = noise[1] * math.sqrt(settings.odom_alpha4 * turn**2 + settings.odom_alpha5 * way**2)
    after = poses[:, 2] + move.yaw
    after += noise[2] * math.sqrt(settings.odom_alpha1 * turn**2 + settings.odom_alpha2 * way**2)
    heading = poses[:, 2] + direction
    cos, sin = np.cos(heading), np.sin(heading)
    x = poses[:, 0] + cos * along - sin * across
    y = poses[:, 1] + sin * along + cos * across
    return np.stack([x, y, after], axis=1)
