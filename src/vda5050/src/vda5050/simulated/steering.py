# SPDX-License-Identifier: BSD-3-Clause
"""Steers a base along the edges of an order, with the path follower of `move_base`."""

from __future__ import annotations

import itertools
import math
from typing import TYPE_CHECKING

from hive_navigation.control.follower import Room
from hive_navigation.control.pursuit_follower import BRAKING, PursuitFollower
from hive_navigation.planning.path import Path

if TYPE_CHECKING:
    from collections.abc import Sequence

    from hive_common.pose import Pose, Velocity
    from robot_description.models import Base
    from vda5050.vehicle.ports import Waypoint

_AT = 0.05
"""A base has passed a waypoint from this distance before it on, if it may pass so far off [m]."""

_STOPPED = 0.02
"""A base that brakes and is slower has stopped [m/s]."""


class Steering:
    """Says how a base moves next to get along its way.

    Attributes:
        passed: The sequence id of the last waypoint that was passed; None for none.
    """

    def __init__(self, base: Base) -> None:
        self.passed: int | None = None
        self._base = base
        self._follower = PursuitFollower(base)
        self._start = (0.0, 0.0)
        self._way: list[Waypoint] = []
        self._path: Path | None = None  # up to the next waypoint where the base stands
        self._left: list[Waypoint] = []  # those on the path that are still ahead
        self._speed = 0.0  # as commanded last [m/s]
        self._brakes = False

    @property
    def is_done(self) -> bool:
        """Whether the way is at its end."""
        return not self._way

    @property
    def braking_distance(self) -> float:
        """Way to a stop from the top speed, as the steering plans it [m]."""
        return self._base.max_speed**2 / (2 * BRAKING * self._base.acceleration)

    def follow(self, start: tuple[float, float], way: Sequence[Waypoint]) -> None:
        """Follow a way from now on; see `Drive.go`."""
        self._start, self._way, self._path = start, list(way), None
        self._brakes = False
        self.passed = None

    def brake(self) -> None:
        """Stop as soon as possible, on the way, and then forget it."""
        self._brakes = True

    def stand(self) -> None:
        """Learn that the base stands, whatever it was told."""
        self._follower.stopped()
        self._speed = 0.0

    def command(self, pose: Pose, dt: float) -> Velocity:
        """Return the velocity for the next `dt` [s] of a base at a pose, frame map.

        Waypoints count as passed on the way.
        """
        if self._brakes and self._speed < _STOPPED:
            self._way = []
        velocity = self._follow(pose, dt) if self._way else self._follower.halt(dt)
        self._speed = math.hypot(velocity.vx, velocity.vy)
        return velocity

    def _follow(self, pose: Pose, dt: float) -> Velocity:
        path, follower = self._path or self._begin(pose), self._follower
        follower.speed_limit = self._most(path)
        if self._brakes:
            follower.speed_limit = max(0.0, self._speed - self._base.acceleration * dt)
        velocity = follower.command(pose, Room(), dt)
        while len(self._left) > 1 and self._mark(path, 1) - follower.progress <= self._near():
            self._pass()
        if follower.arrived:
            self._start, self._path = path.end, None
            self._pass()
        return velocity

    def _begin(self, pose: Pose) -> Path:
        """Take up the path to the next waypoint where the base stands."""
        stops = (index for index in range(len(self._way)) if self._stops_at(index))
        self._left = self._way[: next(stops) + 1]
        path = Path([self._start, *((each.x, each.y) for each in self._left)])
        last = self._left[-1]
        self._follower.start(path, None if last.heading_deviation >= math.pi else last.heading)
        first = math.dist(self._start, (self._left[0].x, self._left[0].y))
        self._follower.progress = path.nearest((pose.x, pose.y), 0.0, first)
        self._path = path
        return path

    def _pass(self) -> None:
        self._left.pop(0)
        self.passed = self._way.pop(0).sequence

    def _near(self) -> float:
        return min(self._left[0].deviation, _AT)

    def _mark(self, path: Path, count: int) -> float:
        """Return how far along the path the last of the next `count` waypoints is [m]."""
        rest = [(each.x, each.y) for each in self._left[count - 1 :]]
        return path.length - sum(math.dist(*leg) for leg in itertools.pairwise(rest))

    def _most(self, path: Path) -> float:
        """Return the speed that this edge allows, and from which the base can slow down [m/s]."""
        brake = 2 * BRAKING * self._base.acceleration
        most, ahead = math.inf, 0.0
        for index, point in enumerate(self._left, start=1):
            allowed = math.inf if point.max_speed is None else point.max_speed
            most = min(most, math.sqrt(allowed**2 + brake * ahead))
            ahead = max(0.0, self._mark(path, index) - self._follower.progress)
        return most

    def _stops_at(self, index: int) -> bool:
        """Return whether the base has to stand at a waypoint, at the last or to turn."""
        point = self._way[index]
        if index == len(self._way) - 1:
            return True
        if point.heading is None:
            return False
        before = self._start if index == 0 else (self._way[index - 1].x, self._way[index - 1].y)
        after = self._way[index + 1]
        ways = ((point.x - before[0], point.y - before[1]), (after.x - point.x, after.y - point.y))
        headings = [math.atan2(dy, dx) for dx, dy in ways if math.hypot(dx, dy) > _AT]
        return len(headings) < len(ways) or any(
            abs(math.remainder(point.heading - heading, math.tau)) > point.heading_deviation
            for heading in headings
        )
