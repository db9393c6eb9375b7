# SPDX-License-Identifier: BSD-3-Clause
"""What a vehicle asks of the machine below it: to drive, to work, to give current."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple, Protocol

import attrs

if TYPE_CHECKING:
    from collections.abc import Sequence

    from hive_common.pose import Pose, Velocity
    from vda5050.protocol.actions import Action
    from vda5050.protocol.factsheet import ActionScope, RobotAction
    from vda5050.protocol.state import Load, PowerSupply


@attrs.frozen(kw_only=True)
class Waypoint:
    """A node on the way of a drive."""

    sequence: int
    """The sequence id of its node."""
    x: float
    """Frame map [m]."""
    y: float
    """Frame map [m]."""
    heading: float | None = None
    """To take before the drive goes on, counter-clockwise from the x axis [rad]; None for any."""
    deviation: float
    """How far from it the vehicle may pass [m]."""
    heading_deviation: float
    """By how much the heading may differ [rad]."""
    max_speed: float | None = None
    """On the edge to it [m/s]; None for what the vehicle can do."""


class Drive(Protocol):
    """Moves the vehicle along its base."""

    @property
    def pose(self) -> Pose | None:
        """Where the vehicle is, frame map; None before it knows."""

    @property
    def velocity(self) -> Velocity:
        """How it moves, in its own frame."""

    @property
    def passed(self) -> int | None:
        """The sequence id of the last waypoint that it passed since `go`; None for none."""

    @property
    def is_driving(self) -> bool:
        """Whether it drives or turns."""

    @property
    def failure(self) -> str:
        """Why it cannot get to its next waypoint; empty while nothing is wrong."""

    @property
    def unheeded(self) -> str:
        """What of the edge that it drives on it does not heed; empty if it heeds all."""

    @property
    def braking_distance(self) -> float:
        """Way that it needs to stop from its top speed [m]."""

    def go(self, start: tuple[float, float], way: Sequence[Waypoint]) -> None:
        """Drive along a way from now on, and stand still at its end.

        Args:
            start: Where the edge to the first waypoint begins, frame map [m].
            way: At least one waypoint; those of the way so far that lie ahead are among them.
        """

    def halt(self) -> None:
        """Stop as soon as possible, without leaving the way, and forget it."""

    def set_pose(self, pose: Pose) -> bool:
        """Take `pose`, frame map, for the own one; return whether that is possible."""


class Outcome(NamedTuple):
    """How an action ended."""

    done: bool
    """Whether it did what it should."""
    text: str = ""
    """The result, or why it failed."""


class Job(Protocol):
    """An action under way."""

    @property
    def outcome(self) -> Outcome | None:
        """How it ended; None while it runs."""

    def pause(self) -> bool:
        """Stop for a while; return whether it can."""

    def resume(self) -> None:
        """Go on after a pause."""

    def cancel(self) -> bool:
        """End without a result; return whether it can be cancelled."""


class Tools(Protocol):
    """What the vehicle does besides driving: it handles loads, charges, waits."""

    @property
    def offered(self) -> Sequence[RobotAction]:
        """The actions that it can do."""

    @property
    def loads(self) -> tuple[Load, ...]:
        """What is on board."""

    @property
    def power_supply(self) -> PowerSupply:
        """How full its battery is."""

    def why_not(self, action: Action, scope: ActionScope) -> str:
        """Return why it can never do an action in a scope; empty if it can."""

    def start(self, action: Action) -> Job:
        """Begin an action that `why_not` has nothing against."""
