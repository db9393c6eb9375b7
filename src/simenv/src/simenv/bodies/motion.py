# SPDX-License-Identifier: BSD-3-Clause
"""How planar bases move: limits of speed and acceleration, and one step.

All robots at once: row i of every array belongs to robot i. A velocity is (vx, vy, wz) in
`base_footprint` [m/s, m/s, rad/s]; a pose is (x, y, yaw) [m, m, rad].
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from hive_common.geometry import cos_and_sin

if TYPE_CHECKING:
    from collections.abc import Sequence

    from hive_common.geometry import Array
    from robot_description.models import RobotModel


@dataclass(frozen=True)
class Limits:
    """Limits of n bases; arrays (n,)."""

    speed: Array  # top speed along x [m/s]
    diagonal: Array  # top speed along a diagonal [m/s]
    sideways: Array  # 1 for a base that can move along y, else 0
    yaw_rate: Array  # [rad/s]
    acceleration: Array  # of the robot without load, also its deceleration [m/s^2]
    yaw_acceleration: Array  # [rad/s^2]
    mass: Array  # of the robot without load [kg]


def limits_of(models: Sequence[RobotModel]) -> Limits:
    """Return the limits of these robots' bases."""
    bases = [model.base for model in models]
    return Limits(
        speed=np.array([base.max_speed for base in bases]),
        diagonal=np.array([base.max_speed_diagonal or base.max_speed for base in bases]),
        sideways=np.array([float(base.max_speed_diagonal is not None) for base in bases]),
        yaw_rate=np.array([base.max_yaw_rate for base in bases]),
        acceleration=np.array([base.acceleration for base in bases]),
        yaw_acceleration=np.array([base.yaw_acceleration for base in bases]),
        mass=np.array([base.mass for base in bases]),
    )


def within_limits(commands: Array, limits: Limits) -> Array:
    """Return the velocities (n, 3) nearest to the commands (n, 3) that the bases can reach.

    The direction of travel stays. A holonomic base reaches the octagon through `speed` on the axes
    and `diagonal` between them.
    """
    allowed = commands.copy()
    allowed[:, 1] *= limits.sideways
    across = np.abs(allowed[:, :2])
    long, short = across.max(axis=1), across.min(axis=1)
    share = long / limits.speed + short * (np.sqrt(2) / limits.diagonal - 1 / limits.speed)
    allowed[:, :2] /= np.maximum(share, 1.0)[:, None]
    allowed[:, 2] = np.clip(allowed[:, 2], -limits.yaw_rate, limits.yaw_rate)
    return allowed


def changes_of(limits: Limits, load: Array, dt: float) -> Array:
    """Return how much velocities can change in a step of `dt` [s] with loads (n,) [kg] on board.

    The motors' force is the same with any load, so a = a0 m / (m + load).

    Returns:
        (2, n): in any direction [m/s], and of turning [rad/s].
    """
    share = limits.mass / (limits.mass + load) * dt
    return np.array([limits.acceleration * share, limits.yaw_acceleration * share])


def accelerated(velocities: Array, targets: Array, changes: Array) -> Array:
    """Return the velocities (n, 3) after a step towards `targets`; see `changes_of`."""
    most, turn = changes
    change = targets - velocities
    size = np.hypot(change[:, 0], change[:, 1])
    change[:, :2] *= (most / np.maximum(size, most))[:, None]
    change[:, 2] = np.minimum(np.maximum(change[:, 2], -turn), turn)
    change += velocities
    return change


def moved(poses: Array, shifts: Array) -> Array:
    """Return the poses (n, 3) after shifts (n, 3) given in each robot's own frame.

    A shift is a velocity times dt. By the midpoint rule it goes along the heading half way through
    the turn, which is exact up to the third order of the angle turned.
    """
    middle = poses[:, 2] + shifts[:, 2] / 2
    cos, sin = cos_and_sin(middle)
    x, y = shifts[:, 0], shifts[:, 1]
    after: Array = poses + shifts
    after[:, 0] = poses[:, 0] + (cos * x - sin * y)
    after[:, 1] = poses[:, 1] + (sin * x + cos * y)
    after[:, 2] = np.remainder(after[:, 2] + np.pi, 2 * np.pi) - np.pi
    return after
