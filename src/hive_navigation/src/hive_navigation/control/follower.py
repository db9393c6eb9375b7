# SPDX-License-Identifier: BSD-3-Clause
"""The port of the path follower, which turns a path into velocities.

A follower decides nothing about obstacles: the laser and the right of way give it its `Room`.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Protocol

if TYPE_CHECKING:
    from hive_common.pose import Pose, Velocity
    from hive_navigation.planning.path import Path
    from hive_navigation.traffic.right_of_way import Limits


@dataclass(frozen=True)
class Room:
    """What a robot may do at this moment."""

    ahead: float = math.inf  # how far along the path it may go before it must stop [m]
    turn: bool = True  # whether it may turn on the spot


class Follower(Protocol):
    """Turns a path into velocities for one base."""

    progress: float  # how far along the path the base is [m]
    arrived: bool  # whether the base stands at the end of the path with the wanted yaw
    committed: float  # how far the base goes on along the path, whatever it is told now [m]

    def start(self, path: Path, goal_yaw: float | None) -> None:
        """Take up a new path, whose end has a yaw [rad] or any (None), while the base moves."""
        ...

    def command(self, pose: Pose, room: Room, dt: float) -> Velocity:
        """Return the velocity for the next `dt` [s], for a base at `pose`, frame map."""
        ...

    def stopped(self) -> None:
        """Learn that the base stands: a base stops by itself when it gets no commands."""
        ...

    def top_speed(self, room: float) -> float:
        """Return the highest speed on a straight path that is free for `room` [m] ahead [m/s]."""
        ...

    def limits(self, room: float) -> Limits:
        """Return how fast the base drives, speeds up and turns on a path, by experience.

        `room` [m] is how far ahead a path is free at most. Braking and speeding up count as one
        acceleration, their mean, and a turn on the spot as one rate, that of a quarter turn.
        """
        ...

    def halt(self, dt: float) -> Velocity:
        """Return the velocity for the next `dt` [s] that stops the base as soon as it can."""
        ...
