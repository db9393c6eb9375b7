# SPDX-License-Identifier: BSD-3-Clause
"""How planar bases move: limits of speed and acceleration, and one step.

All robots at once: row i of every array belongs to robot i. A velocity is (vx, vy, wz) in
`base_footprint` [m/s, m/s, rad/s]; a pose is (x, y, yaw) [m, m, rad].
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from hive_common.compiled import compiled

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

    from hive_common.geometry import Array
    from robot_description.models import RobotModel

SPEED, DIAGONAL, SIDEWAYS, YAW_RATE, ACCELERATION, YAW_ACCELERATION, MASS = range(7)
"""Columns of the limits of bases:

- top speeds along x and along a diagonal [m/s],
- 1 for a base that can move along y, else 0,
- the top yaw rate [rad/s],
- the acceleration without load [m/s^2], also the deceleration, and that of turning [rad/s^2],
- the mass without load [kg].
"""


def limits_of(models: Sequence[RobotModel]) -> Array:
    """Return the limits (n, 7) of these robots' bases."""
    limits = [
        (
            base.max_speed,
            base.max_speed_diagonal or base.max_speed,
            float(base.max_speed_diagonal is not None),
            base.max_yaw_rate,
            base.acceleration,
            base.yaw_acceleration,
            base.mass,
        )
        for base in (model.base for model in models)
    ]
    return np.array(limits).reshape(-1, 7)


@compiled("float64[:, ::1](float64[:, ::1], float64[:, ::1])")
def within_limits(commands: Array, limits: Array) -> Array:
    """Return the velocities (n, 3) nearest to the commands (n, 3) that the bases can reach.

    The direction of travel stays. A holonomic base reaches the octagon through the top speeds on
    the axes and between them.
    """
    allowed = np.empty_like(commands)
    for i in range(len(commands)):
        x, y = commands[i, 0], commands[i, 1] * limits[i, SIDEWAYS]
        long, short = max(abs(x), abs(y)), min(abs(x), abs(y))
        straight = 1 / limits[i, SPEED]
        share = long * straight + short * (math.sqrt(2) / limits[i, DIAGONAL] - straight)
        allowed[i, 0], allowed[i, 1] = x / max(share, 1.0), y / max(share, 1.0)
        fastest = limits[i, YAW_RATE]
        allowed[i, 2] = min(max(commands[i, 2], -fastest), fastest)
    return allowed


@compiled(
    "float64[:, ::1](float64[:, ::1], float64[:, ::1], float64[:, ::1], float64[::1], float64)"
)
def accelerated(
    velocities: Array, targets: Array, limits: Array, loads: Array, dt: float
) -> Array:
    """Return the velocities (n, 3) after a step of `dt` [s] towards the targets (n, 3).

    The motors' force is the same with any load (n,) [kg] on board, so a = a0 m / (m + load).
    """
    after = np.empty_like(velocities)
    for i in range(len(velocities)):
        share = limits[i, MASS] / (limits[i, MASS] + loads[i]) * dt
        most, turn = limits[i, ACCELERATION] * share, limits[i, YAW_ACCELERATION] * share
        x, y = targets[i, 0] - velocities[i, 0], targets[i, 1] - velocities[i, 1]
        wz = targets[i, 2] - velocities[i, 2]
        cut = most / max(math.hypot(x, y), most)
        after[i, 0] = velocities[i, 0] + x * cut
        after[i, 1] = velocities[i, 1] + y * cut
        after[i, 2] = velocities[i, 2] + min(max(wz, -turn), turn)
    return after


@compiled("float64[:, ::1](float64[:, ::1], float64[:, ::1])")
def moved(poses: Array, shifts: Array) -> Array:
    """Return the poses (n, 3) after shifts (n, 3) given in each robot's own frame.

    A shift is a velocity times dt. By the midpoint rule it goes along the heading half way through
    the turn, which is exact up to the third order of the angle turned.
    """
    after = poses.copy()
    for i in range(len(poses)):
        x, y, turn = shifts[i, 0], shifts[i, 1], shifts[i, 2]
        if x == 0 and y == 0 and turn == 0:
            continue  # a robot that stands keeps its pose to the last bit
        middle = poses[i, 2] + turn / 2
        cos, sin = math.cos(middle), math.sin(middle)
        after[i, 0] += cos * x - sin * y
        after[i, 1] += sin * x + cos * y
        yaw = poses[i, 2] + turn
        after[i, 2] = yaw - 2 * math.pi * math.floor(yaw / (2 * math.pi) + 0.5)
    return after


@compiled(
    "Tuple((float64[:, ::1], float64[:, ::1], float64[:, ::1]))(float64[:, ::1], float64[:, ::1],"
    " float64[:, ::1], boolean[::1], float64[:, ::1], float64[::1], float64[::1], float64)"
)
def driven(
    poses: Array,
    velocities: Array,
    commands: Array,
    obeys: NDArray[np.bool_],
    limits: Array,
    loads: Array,
    grip: Array,
    dt: float,
) -> tuple[Array, Array, Array]:
    """Let all bases drive for `dt` [s] as if nothing were in their way.

    Args:
        poses: (n, 3) frame map.
        velocities: (n, 3)
        commands: (n, 3) velocities.
        obeys: (n,) whether the command holds; a base without one stops.
        limits: (n, 7)
        loads: (n,) on board [kg].
        grip: (n,) share of every shift that moves the base.
        dt: [s]

    Returns:
        The velocities after the step, what the wheels turned in it, and the poses after it; each
        (n, 3).
    """
    wanted = commands.copy()
    for i in range(len(obeys)):
        if not obeys[i]:
            wanted[i] = 0.0
    targets = within_limits(wanted, limits)
    after = accelerated(velocities, targets, limits, loads, dt)
    shifts = after * dt
    return after, shifts, moved(poses, shifts * grip.reshape(-1, 1))
