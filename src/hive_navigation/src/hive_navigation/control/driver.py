# SPDX-License-Identifier: BSD-3-Clause
"""Drives a robot along one path: as far as its laser sees it free, and as the others let it.

The navigator says where to drive and for whom to wait; what a driver sees it tells the navigator.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from hive_navigation.control.follower import Follower, Room
from hive_navigation.control.obstacle_check import (
    ON_ROBOT,
    ObstacleCheck,
    VisibleObstacles,
    points_seen,
    sort_points,
)
from hive_navigation.planning.clearance import Disc
from hive_navigation.planning.path import sampled
from hive_navigation.traffic.right_of_way import Announcement, claimed_stretch

if TYPE_CHECKING:
    from collections.abc import Iterable

    from hive_common.geometry import Array
    from hive_common.pose import Pose, Velocity
    from hive_navigation.planning.clearance import ClearanceField
    from hive_navigation.planning.path import Path, Point
    from robot_description.models import RobotModel
    from robot_description.scan import Scan

HEARD_LATE = 0.2  # how far a robot may have driven since it announced where it is [m]
SAME_WAY = 0.1  # a new path this near to the one before is known to the others [m]
MAX_ROUND = 0.5  # after a longer round of the control loop the base has stopped by itself [s]


class Driver:
    """Drives one robot.

    Attributes:
        path: The path that it drives along, frame map; None if there is none.
        claim: How much of the path the robot can no longer avoid [m].
        limits: How fast the robot can be.
        sight: How far away a robot that the laser sees may be [m].
    """

    def __init__(
        self, model: RobotModel, follower: Follower, field: ClearanceField, settle: float
    ) -> None:
        """Stand without a path.

        Args:
            model: Of the robot.
            follower: Turns the path into velocities.
            field: Clearances of the planner's map.
            settle: How long a robot that takes up a path stands before it drives [s].
        """
        self.path: Path | None = None
        self.claim = 0.0
        self._base = model.base
        self._laser = model.laser
        self._follower = follower
        self._field = field
        self._settle = settle
        self._former: tuple[Path, float] | None = None  # the path before, and the progress on it
        # From when on [s] the others know the path up to how far along it [m].
        self._known: list[tuple[float, float]] = []
        self._last_time: float | None = None
        self._round = 0.0  # how long the last round of the control loop took, at most [s]
        self._check = ObstacleCheck(model.base, model.laser)
        self.sight = model.laser.range_max + math.hypot(*model.laser.pose[:2])
        self.sight += HEARD_LATE + ON_ROBOT
        self.limits = follower.limits(self._check.most_room)

    @property
    def progress(self) -> float:
        """How far along its path the robot is [m]."""
        return self._follower.progress

    @property
    def arrived(self) -> bool:
        """Whether the robot stands at the end of its path with the wanted yaw."""
        return self._follower.arrived

    def begin_round(self, now: float) -> None:
        """Begin a round of the control loop at a time [s]."""
        since = 0.0 if self._last_time is None else now - self._last_time
        if since > MAX_ROUND:
            self._follower.stopped()
        self._round = min(max(since, 0.0), MAX_ROUND)
        self._last_time = now

    def start(self, path: Path, yaw: float | None, settle_from: float | None) -> None:
        """Take up a path.

        Args:
            path: Where to drive, frame map.
            yaw: How to stand at its end [rad]; None for any.
            settle_from: Since when the robot settles before it drives [s]; None if it drives on.
                What the path has in common with one that was let go counts from when that one
                was announced: so a robot drives whose goal changes faster than it settles.
        """
        since = -math.inf if settle_from is None else settle_from + self._settle
        known = [(since, math.inf)]
        if self._former is not None:
            before, progress = self._former
            same = _in_common(path, before, progress)
            known += [(when, min(far - progress, same)) for when, far in self._known]
        self._known = known
        self.path, self._former = path, None
        self._follower.start(path, yaw)

    def ahead(self, pose: Pose, reach: float) -> tuple[Point, ...]:
        """Return the next `reach` [m] of the path, from where the robot is, frame map."""
        here = (pose.x, pose.y)
        return here, *self._section(reach)

    def claimed(self) -> list[Point]:
        """Return the stretch of the path that the robot can no longer avoid, frame map [m]."""
        return self._section(self.claim) if self.claim > 0 else []

    def _section(self, length: float) -> list[Point]:
        if self.path is None:
            return []
        return self.path.section(self.progress, self.progress + length)

    def look(self, pose: Pose, scan: Scan, near: Iterable[Announcement]) -> VisibleObstacles:
        """Return what a robot at a pose, frame map, sees.

        Args:
            pose: Where the robot is, frame map.
            scan: The latest.
            near: The robots around it; they may have moved since their announcements.
        """
        robots = [
            Disc(other.x, other.y, other.radius + HEARD_LATE)
            for other in near
            if math.hypot(other.x - pose.x, other.y - pose.y) < self.sight + other.radius
        ]
        points = points_seen(self._laser, scan, pose)
        return sort_points(points, self._field, robots, scan.range_max)

    def drive(
        self, now: float, pose: Pose, obstacles: VisibleObstacles, allowed: float
    ) -> Velocity:
        """Return the next velocity along the path, and claim what the robot needs for it.

        Args:
            now: The time [s].
            pose: Where the robot is, frame map.
            obstacles: What it sees.
            allowed: How far the others and its route let it go [m].
        """
        assert self.path is not None  # noqa: S101  (the navigator has looked)
        room = Room(0.0, turn=False)
        known = max((far for when, far in self._known if now >= when), default=0.0)
        self._known = [(-math.inf, known), *(later for later in self._known if later[0] > now)]
        if known > 0:
            free = self._check.room_ahead(self.path, self.progress, pose, obstacles)
            turn = self._check.may_turn(pose, obstacles)
            room = Room(max(0.0, min(free, allowed, known - self.progress)), turn=turn)
        velocity = self._follower.command(pose, room, self._round)
        self._claim_for(velocity, room.ahead)
        return velocity

    def halt(self) -> Velocity:
        """Return the next velocity of a robot that stops as soon as it can."""
        velocity = self._follower.halt(self._round)
        self._former = None
        if self.path is not None:
            self._claim_for(velocity, 0.0)
        return velocity

    def drop(self) -> None:
        """Follow the path no more; the robot claims nothing."""
        self.path, self.claim, self._former = None, 0.0, None

    def let_go(self) -> None:
        """Drop the path for one that is taken up in this round or the next."""
        former = self._former if self.path is None else (self.path, self.progress)
        self.drop()
        self._former = former

    def _claim_for(self, velocity: Velocity, room: float) -> None:
        speed = math.hypot(velocity.vx, velocity.vy)
        claim = claimed_stretch(speed, self._base.acceleration, room)
        self.claim = max(claim, self._follower.committed)

    def blocking(self, obstacles: VisibleObstacles) -> Array:
        """Return the points (n, 2) of unknown obstacles that block the path, frame map [m]."""
        assert self.path is not None  # noqa: S101  (the navigator has looked)
        return self._check.blocking(self.path, self.progress, obstacles)


def _in_common(path: Path, before: Path, progress: float) -> float:
    """Return how far a path leads along what is left of the one before, from `progress` on [m]."""
    points, marks = sampled(path.section(0.0, path.length), SAME_WAY)
    for point, mark in zip(points.tolist(), marks.tolist(), strict=True):
        nearest = before.nearest((point[0], point[1]), progress, before.length)
        if math.dist(before.at(nearest), point) > SAME_WAY:
            return float(mark)
    return path.length
