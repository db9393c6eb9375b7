# SPDX-License-Identifier: BSD-3-Clause
"""Drives a robot along the nodes of an order by the goals of its own navigation.

A robot that plans its own way needs no edges: it gets one node after the other as its goal. On its
way it gets the next goal as soon as it is in the deviation that the order allows, so it does not
stop at every node.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Protocol

from hive_common.pose import STOP, Pose

if TYPE_CHECKING:
    from collections.abc import Sequence

    from hive_common.pose import Velocity
    from vda5050.vehicle.ports import Outcome, Waypoint

_TRIES = 3
"""So often a goal is given before the vehicle says that it cannot get there."""

_MOVES = 0.02
"""A robot that is faster moves [m/s, rad/s]."""


class Navigation(Protocol):
    """A robot's own navigation: one goal at a time."""

    @property
    def pose(self) -> Pose | None:
        """Where the robot is, frame map; None before it knows."""

    @property
    def velocity(self) -> Velocity:
        """How it moves, in its own frame."""

    @property
    def outcome(self) -> Outcome | None:
        """How the last goal ended; None while it is under way."""

    def send(self, goal: Pose) -> None:
        """Drive to a goal, frame map, instead of the one before."""

    def cancel(self) -> None:
        """Stop, and drop the goal."""

    def limit_speed(self, limit: float | None) -> bool:
        """Drive no faster from now on [m/s]; None: as fast as it likes.

        Returns:
            Whether there is a navigation that heeds it.
        """

    def set_pose(self, pose: Pose) -> bool:
        """Tell the localization where the robot is; return whether there is one to tell."""


class GoalDrive:
    """A `Drive` that has a robot's navigation drive.

    Args:
        navigation: Of the robot.
        braking_distance: Way that the robot needs to stop from its top speed [m].
        top_speed: Of the robot [m/s]; a limit above it is none.
    """

    def __init__(
        self, navigation: Navigation, braking_distance: float, top_speed: float = math.inf
    ) -> None:
        self._navigation = navigation
        self._top_speed = top_speed
        self._limit: float | None = None
        self.unheeded = ""  # what of the edge that it drives on the robot does not heed
        self.braking_distance = braking_distance
        self.passed: int | None = None  # the sequence id of the last waypoint since `go`
        self.failure = ""  # why the robot cannot get to its next waypoint
        self._way: list[Waypoint] = []
        self._from = (0.0, 0.0)
        self._goal: Waypoint | None = None
        self._tries = 0

    @property
    def pose(self) -> Pose | None:
        """Where the robot is, frame map; None before it knows."""
        return self._navigation.pose

    @property
    def velocity(self) -> Velocity:
        """How the robot moves, in its own frame."""
        return self._navigation.velocity

    @property
    def is_driving(self) -> bool:
        """Whether the robot has a goal or moves."""
        v = self._navigation.velocity
        has_goal = self._goal is not None and not self.failure
        return has_goal or (v != STOP and max(abs(v.vx), abs(v.vy), abs(v.wz)) > _MOVES)

    def go(self, start: tuple[float, float], way: Sequence[Waypoint]) -> None:
        """Drive along a way from now on; see `Drive.go`."""
        self._way, self.passed = list(way), None
        if self._goal is None or self._goal != way[0] or len(way) == 1:
            self._from, self.failure, self._tries = start, "", 0
            self._next()

    def halt(self) -> None:
        """Stop as soon as possible and forget the way."""
        if self._goal is not None:
            self._navigation.cancel()
        self._way, self._goal, self.failure = [], None, ""
        self._keep_limit()

    def set_pose(self, pose: Pose) -> bool:
        """Take `pose`, frame map, for the robot's."""
        return self._navigation.set_pose(pose)

    def step(self) -> None:
        """Take note of waypoints and of goals that ended; to be called ten times a second."""
        pose = self._navigation.pose
        self._keep_limit()
        if self._goal is None or self.failure or pose is None:
            return
        outcome = self._navigation.outcome
        if outcome is None:
            if len(self._way) > 1 and self._passes(self._goal, pose):
                self._reach()
        elif outcome.done:
            self._reach()
        elif self._tries < _TRIES:
            self._send()
        else:
            self.failure = outcome.text or "the navigation gave up"

    def _keep_limit(self) -> None:
        """Have the robot keep the limit of its edge, and brake for that of the next one."""
        pose, limits = self._navigation.pose, [point.max_speed for point in self._way[:1]]
        if pose is not None and len(self._way) > 1:
            end = self._way[0]
            if math.dist(pose[:2], (end.x, end.y)) <= self.braking_distance + end.deviation:
                limits.append(self._way[1].max_speed)
        known = [each for each in limits if each is not None and each < self._top_speed]
        limit = min(known, default=None)
        if limit == self._limit and not self.unheeded:
            return
        self._limit = limit
        heeded = self._navigation.limit_speed(limit) or limit is None
        self.unheeded = (
            "" if heeded else f"maxSpeed {limit:g} m/s: its navigation takes no speed_limit"
        )

    def _passes(self, point: Waypoint, pose: Pose) -> bool:
        """Return whether the robot may go on to the next waypoint without standing here."""
        near = math.dist(pose[:2], (point.x, point.y)) <= point.deviation
        if point.heading is None:
            return near
        turn = abs(math.remainder(point.heading - pose.yaw, math.tau))
        return near and turn <= point.heading_deviation

    def _reach(self) -> None:
        point = self._way.pop(0)
        self.passed, self._from, self._tries = point.sequence, (point.x, point.y), 0
        self._next()

    def _next(self) -> None:
        self._goal = self._way[0] if self._way else None
        if self._goal is not None:
            self._send()

    def _send(self) -> None:
        """Give the next waypoint as a goal; without a heading, with the one along the edge."""
        point = self._way[0]
        along = math.atan2(point.y - self._from[1], point.x - self._from[0])
        if math.dist(self._from, (point.x, point.y)) == 0 and self.pose is not None:
            along = self.pose.yaw
        heading = point.heading if point.heading is not None else along
        self._tries += 1
        self._navigation.send(Pose(point.x, point.y, heading))
