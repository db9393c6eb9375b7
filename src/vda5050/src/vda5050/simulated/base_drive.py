# SPDX-License-Identifier: BSD-3-Clause
"""Drives a base that takes velocities, such as a robot of the simulator, along edges."""

from __future__ import annotations

from typing import TYPE_CHECKING, Protocol

from hive_common.pose import STOP, Velocity
from vda5050.simulated.steering import Steering

if TYPE_CHECKING:
    from collections.abc import Sequence

    from hive_common.pose import Pose
    from robot_description import models
    from vda5050.vehicle.ports import Waypoint

_STANDS = 0.01
"""A base that is slower stands [m/s, rad/s]."""

_KNOWN_WITHIN = 1.0
"""A pose that a person gives has to be this near to the true one [m]."""


class Base(Protocol):
    """A base on wheels that takes velocities."""

    @property
    def pose(self) -> Pose | None:
        """Where it is, frame map; None before it knows."""

    @property
    def velocity(self) -> Velocity:
        """How it moves, in its own frame."""

    def command(self, velocity: Velocity) -> None:
        """Move like this until the next command."""


class BaseDrive:
    """Steers a base along the edges of an order; a `Drive`."""

    def __init__(self, base: Base, model: models.Base) -> None:
        self._base = base
        self._steering = Steering(model)
        self._commanded = STOP
        self.braking_distance = self._steering.braking_distance
        self.unheeded = ""  # it heeds all limits
        self.failure = ""  # why the vehicle gets no further; set from outside, as a fault
        self.is_locked = False  # an emergency stop keeps the base where it is

    @property
    def pose(self) -> Pose | None:
        """Where the base is, frame map; None before it knows."""
        return self._base.pose

    @property
    def velocity(self) -> Velocity:
        """How the base moves, in its own frame."""
        return self._base.velocity

    @property
    def passed(self) -> int | None:
        """The sequence id of the last waypoint that was passed since `go`; None for none."""
        return self._steering.passed

    @property
    def is_driving(self) -> bool:
        """Whether the base drives or turns."""
        v = self._base.velocity
        return not self._steering.is_done or max(abs(v.vx), abs(v.vy), abs(v.wz)) > _STANDS

    def go(self, start: tuple[float, float], way: Sequence[Waypoint]) -> None:
        """Drive along a way from now on; see `Drive.go`."""
        self._steering.follow(start, way)

    def halt(self) -> None:
        """Stop as soon as possible, on the way, and forget it."""
        self._steering.brake()

    def set_pose(self, pose: Pose) -> bool:
        """Accept a pose near the true one, which a simulated base always knows."""
        here = self._base.pose
        return here is not None and here.distance_to(pose) <= _KNOWN_WITHIN

    @property
    def _is_held(self) -> bool:
        return self.is_locked or bool(self.failure)

    def step(self, seconds: float) -> None:
        """Command the base at the rate of the control loop, `seconds` after the last time."""
        here = self._base.pose
        wanted = STOP
        if here is not None and not self._is_held:
            wanted = self._steering.command(here, seconds)
        else:
            self._steering.stand()
        if wanted != STOP or self._commanded != STOP:
            self._base.command(wanted)
        self._commanded = wanted
