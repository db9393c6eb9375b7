# SPDX-License-Identifier: BSD-3-Clause
"""Steers a base along straight edges: turn on the spot at sharp bends, cut slight ones.

Between its stops the base follows the lines with pure pursuit (Coulter, CMU-RI-TR-92-01, 1992): it
drives on the arc through a point that lies a little ahead on its way.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import attrs

from hive_common.pose import STOP, Pose, Velocity

if TYPE_CHECKING:
    from collections.abc import Sequence

    from robot_description.models import Base
    from vda5050.vehicle.ports import Waypoint

_AHEAD = 0.4
"""How far ahead the point lies that a base drives to [m]."""

_SHARP = 0.5
"""A bend by more than this angle is taken by turning on the spot [rad]."""

_AT = 0.04
"""A base has come to a point from this distance on [m]."""

_ALIGNED = 0.03
"""A heading is taken from this angle on [rad]."""

_BRAKE = 0.7
"""Share of its deceleration with which a base plans to brake: commands come late."""

_CREEP = 0.05
"""The least speed before a stop [m/s]: below it a base would come to it too late."""

_TURN_GAIN = 1.5
"""Yaw rate per angle that is left to turn [1/s]."""

_STILL = 0.1
"""A base that turns slower than this keeps its heading when it is stopped [rad/s]."""


@attrs.frozen
class Limits:
    """What a base can do."""

    speed: float  # [m/s]
    yaw_rate: float  # [rad/s]
    acceleration: float  # also the deceleration [m/s^2]
    yaw_acceleration: float  # [rad/s^2]

    @classmethod
    def of(cls, base: Base) -> Limits:
        """Return those of a model's base."""
        return cls(base.max_speed, base.max_yaw_rate, base.acceleration, base.yaw_acceleration)

    @property
    def braking_distance(self) -> float:
        """Way to a stop from the top speed, as the steering plans it [m]."""
        return self.speed**2 / (2 * _BRAKE * self.acceleration)


class Steering:
    """Says how a base moves next to get along its way."""

    def __init__(self, limits: Limits) -> None:
        self._limits = limits
        self._points: list[tuple[float, float]] = []
        self._way: list[Waypoint] = []
        self._turns = self._turning = False
        self.passed: int | None = None  # the sequence id of the last waypoint that was passed

    @property
    def is_done(self) -> bool:
        """Whether the way is at its end."""
        return not self._way

    def follow(self, start: tuple[float, float], way: Sequence[Waypoint]) -> None:
        """Follow a way from now on; see `Drive.go`."""
        self._way = list(way)
        self._points = [start, *((each.x, each.y) for each in way)]
        self.passed = None

    def forget(self) -> None:
        """Forget the way, and thereby stop."""
        self._way, self._points = [], []

    def command(self, pose: Pose, velocity: Velocity) -> Velocity:
        """Return the velocity to command to a base at `pose`, frame map, that moves like this.

        Waypoints count as passed on the way.
        """
        self._turning = abs(velocity.wz) > _STILL
        while self._way:
            left, side = self._left(pose)
            ends = self._stops_at(0)
            if ends and left <= _AT:
                turn = self._turn_at_next(pose)
                if turn is not None:
                    return self._turn(turn)
            elif left > (0.0 if ends else self._cut()):
                return self._drive(pose, left, side)
            self._pass()
        return STOP

    def _pass(self) -> None:
        self.passed = self._way.pop(0).sequence
        self._points.pop(0)
        self._turns = False

    def _left(self, pose: Pose) -> tuple[float, float]:
        """Return what is left of the edge, and how far left of it the base is [m]."""
        (ax, ay), (bx, by) = self._points[:2]
        length = math.hypot(bx - ax, by - ay)
        if length < _AT:
            distance = math.hypot(bx - pose.x, by - pose.y)
            return (0.0, 0.0) if distance <= self._way[0].deviation else (distance, 0.0)
        ux, uy = (bx - ax) / length, (by - ay) / length
        return (bx - pose.x) * ux + (by - pose.y) * uy, (pose.y - ay) * ux - (pose.x - ax) * uy

    def _stops_at(self, index: int) -> bool:
        """Return whether the base stands still at a waypoint, if only to turn."""
        if index == len(self._way) - 1 or abs(self._bend(index)) > _SHARP:
            return True
        point = self._way[index]
        if point.heading is None:
            return False
        (ax, ay), (bx, by) = self._points[index : index + 2]
        passing = math.atan2(by - ay, bx - ax) + self._bend(index) / 2
        return abs(math.remainder(point.heading - passing, math.tau)) > point.heading_deviation

    def _bend(self, index: int = 0) -> float:
        """Return the angle between an edge and the one after it [rad]; pi where one is a point."""
        (ax, ay), (bx, by), (cx, cy) = self._points[index : index + 3]
        if math.hypot(cx - bx, cy - by) < _AT or math.hypot(bx - ax, by - ay) < _AT:
            return math.pi
        after, before = math.atan2(cy - by, cx - bx), math.atan2(by - ay, bx - ax)
        return math.remainder(after - before, math.tau)

    def _cut(self) -> float:
        """Return how long before a slight bend the base turns into the next edge [m]."""
        return min(_AHEAD * abs(self._bend()), self._way[0].deviation, _AHEAD / 2)

    def _turn_at_next(self, pose: Pose) -> float | None:
        """Return the angle that is left to turn at the next waypoint; None where it is turned."""
        wanted, allowed = self._way[0].heading, self._way[0].heading_deviation
        if wanted is None:
            return None
        angle = math.remainder(wanted - pose.yaw, math.tau)
        self._turns = self._turns or abs(angle) > max(allowed, _ALIGNED)
        return angle if self._turns and (abs(angle) > _ALIGNED or self._turning) else None

    def _turn(self, angle: float) -> Velocity:
        braking = math.sqrt(_BRAKE * self._limits.yaw_acceleration * abs(angle))
        most = min(self._limits.yaw_rate, braking, _TURN_GAIN * abs(angle))
        return Velocity(wz=math.copysign(most, angle))

    def _drive(self, pose: Pose, left: float, side: float) -> Velocity:
        (ax, ay), (bx, by) = self._points[:2]
        along = math.atan2(by - ay, bx - ax)
        if math.hypot(bx - ax, by - ay) < _AT:
            along = math.atan2(by - pose.y, bx - pose.x)
        # Near a stop, a point close ahead would make the base swerve: the line goes on behind it.
        bearing = along - math.atan2(side, _AHEAD)
        error = math.remainder(bearing - pose.yaw, math.tau)
        if abs(error) > _SHARP or (self._turns and abs(error) > _ALIGNED):
            self._turns = True
            return self._turn(error)
        self._turns = False
        speed = self._speed(left)
        rate = 2 * speed * math.sin(error) / _AHEAD
        most = self._limits.yaw_rate
        if abs(rate) > most:
            speed, rate = speed * most / abs(rate), math.copysign(most, rate)
        return Velocity(vx=speed, wz=rate)

    def _speed(self, left: float) -> float:
        """Return the speed from which the base can still stop, and slow down, where it has to."""
        allowed = self._edge_speed(0)
        braking = 2 * _BRAKE * self._limits.acceleration
        ahead, index = left, 0
        while True:
            if self._stops_at(index):
                return min(allowed, max(math.sqrt(braking * max(ahead, 0.0)), _CREEP))
            index += 1
            following = self._edge_speed(index)
            allowed = min(allowed, math.sqrt(following**2 + braking * max(ahead, 0.0)))
            ahead += math.dist(self._points[index], self._points[index + 1])

    def _edge_speed(self, index: int) -> float:
        most = self._way[index].max_speed
        return self._limits.speed if most is None else min(most, self._limits.speed)
