# SPDX-License-Identifier: BSD-3-Clause
"""What a follower is to the rest of navigation: it turns a way into velocities.

It decides nothing about what is in the way: the laser and the right of way tell it the room.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Protocol

if TYPE_CHECKING:
    from hive_common.pose import Pose, Velocity
    from robot_navigation.planning.path import Way


@dataclass(frozen=True)
class Room:
    """What a robot may do in this moment.

    Attributes:
        ahead: How far along the way it may go before it must stand [m].
        turn: Whether it may turn on the spot.
        speed: Top speed from outside [m/s].
    """

    ahead: float = math.inf
    turn: bool = True
    speed: float = math.inf


class Follower(Protocol):
    """Turns a way into velocities for one base."""

    def start(self, way: Way, goal_yaw: float | None) -> None:
        """Take up a new way, in whatever motion the base is.

        Args:
            way: Frame map.
            goal_yaw: How the base shall stand in the end, frame map [rad]; None for any.
        """
        ...

    def command(self, pose: Pose, room: Room, dt: float) -> Velocity:
        """Return what to do for the next `dt` [s].

        Args:
            pose: Where the base is, frame map.
            room: What it may do.
            dt: Time since the last call [s].
        """
        ...

    def stopped(self) -> None:
        """Learn that the base stands: it stops by itself where commands fail to come."""
        ...

    def halt(self, dt: float) -> Velocity:
        """Return what brings the base to a stand in the next `dt` [s] or as soon as it can."""
        ...

    @property
    def progress(self) -> float:
        """How far along the way the base is [m]."""
        ...

    @property
    def arrived(self) -> bool:
        """Whether the base stands at the end of the way, turned as wished."""
        ...
