# SPDX-License-Identifier: BSD-3-Clause
"""A `Follower` that steers for a point a little way ahead.

"Pure pursuit": R. C. Coulter, Implementation of the Pure Pursuit Path Tracking Algorithm, Carnegie
Mellon University, 1992. It goes as fast as every limit allows: the base's, the bends ahead, and
the room ahead that the laser and the right of way have left it.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from hive_common.pose import STOP, Pose, Velocity
from robot_navigation.planning.path import Way, angle_between

if TYPE_CHECKING:
    from robot_description.models import Base
    from robot_navigation.control.follower import Room


@dataclass(frozen=True)
class Tuning:
    """How a `PursuitFollower` drives.

    Attributes:
        look_ahead: Distance to the point it steers for, standing [m].
        look_ahead_time: How much farther it looks per speed [s].
        turn_on_spot: Heading error above which it stops and turns [rad].
        braking: Share of the base's deceleration that it plans with [-]; the rest is reserve.
        delay: Time until a command takes effect, half a round of the control loop included [s].
        reaction: The same at worst, when it must stop in time [s]: so long do bases drive on that
            get no more commands, because whoever commands them does not get a processor.
        position_tolerance: How near the goal counts as there [m].
        yaw_tolerance: How near the goal's yaw counts as turned [rad].
    """

    look_ahead: float = 0.20
    look_ahead_time: float = 0.15
    turn_on_spot: float = 0.7
    braking: float = 0.7
    delay: float = 0.15
    reaction: float = 0.5
    position_tolerance: float = 0.05
    yaw_tolerance: float = 0.05


SLOWEST = 0.05
"""Below this speed a base is taken as standing [m/s], [rad/s]."""

AT_END = 0.01
"""Less than this is left of a way at its end [m]."""

SWING = 0.3
"""Share of its acceleration that a holonomic base spends on turning while it drives [-]."""

SIDEWAYS = 0.3
"""A base that can move sideways comes this much nearer to its goal than another [-]."""

STRAIGHT = 0.1
"""Heading error at which a turn on the spot ends [rad]."""


def speed_to_stop_within(distance: float, deceleration: float, reaction: float) -> float:
    """Return the speed from which a base stops within a distance.

    From distance = v * reaction + v^2 / (2 * deceleration).

    Args:
        distance: [m]; nothing below 0 is 0.
        deceleration: [m/s^2], above 0.
        reaction: Time until it starts to brake [s].

    Returns:
        [m/s]
    """
    if distance <= 0:
        return 0.0
    if math.isinf(distance):
        return math.inf
    delay = deceleration * reaction
    return math.sqrt(delay * delay + 2 * deceleration * distance) - delay


class PursuitFollower:
    """A `Follower` for differential and holonomic bases."""

    def __init__(self, base: Base, tuning: Tuning | None = None) -> None:
        self._base = base
        self._tuning = tuning or Tuning()
        self._way = Way([(0.0, 0.0)])
        self._goal_yaw: float | None = None
        self._progress = 0.0
        self._turning = False
        self._at_end = True
        self._arrived = True
        self._last = STOP

    @property
    def progress(self) -> float:
        """See `Follower.progress`."""
        return self._progress

    @property
    def arrived(self) -> bool:
        """See `Follower.arrived`."""
        return self._arrived

    def start(self, way: Way, goal_yaw: float | None) -> None:
        """See `Follower.start`."""
        self._way = way
        self._goal_yaw = goal_yaw
        self._progress = 0.0
        self._turning = False
        self._at_end = False
        self._arrived = False

    def command(self, pose: Pose, room: Room, dt: float) -> Velocity:
        """See `Follower.command`."""
        wanted = STOP if self._arrived else self._wanted(self._soon(pose), room)
        self._last = self._reachable(wanted, dt)
        return self._last

    def stopped(self) -> None:
        """See `Follower.stopped`."""
        self._last = STOP

    def halt(self, dt: float) -> Velocity:
        """See `Follower.halt`."""
        self._last = self._reachable(STOP, dt)
        return self._last

    def _soon(self, pose: Pose) -> Pose:
        """Return where the base will be when it begins to do what it is told now."""
        delay, last = self._tuning.delay, self._last
        yaw = pose.yaw + last.wz * delay / 2
        x = pose.x + delay * (last.vx * math.cos(yaw) - last.vy * math.sin(yaw))
        y = pose.y + delay * (last.vx * math.sin(yaw) + last.vy * math.cos(yaw))
        return Pose(x, y, pose.yaw + last.wz * delay)

    def _wanted(self, pose: Pose, room: Room) -> Velocity:
        """Return the velocity that would be best if the base had no inertia."""
        way, tuning = self._way, self._tuning
        here = (pose.x, pose.y)
        self._progress = way.nearest(here, self._progress - 0.2, self._progress + 1.0)
        left = way.length - self._progress
        away = math.dist(here, way.end)
        near = tuning.position_tolerance * (SIDEWAYS if self._base.holonomic else 1.0)
        if left < 0.5 * near and away < 2 * near:
            self._at_end = True
        if self._at_end:
            return self._turn_to_goal(pose, room)
        ahead = tuning.look_ahead + tuning.look_ahead_time * math.hypot(*self._last[:2])
        # Near a goal that it has missed sideways, steer for the goal itself.
        target = way.end if left < AT_END else way.at(self._progress + ahead)
        speed = self._speed(room, away if left < AT_END else left)
        bearing = math.atan2(target[1] - pose.y, target[0] - pose.x)
        if self._base.holonomic:
            return self._slide(pose, bearing, speed, room, left)
        return self._steer(pose, bearing, math.dist(here, target), speed, room)

    def _speed(self, room: Room, left: float) -> float:
        """Return the fastest speed that the base, the bends and the room ahead allow [m/s]."""
        base, tuning = self._base, self._tuning
        brake = tuning.braking * base.acceleration
        speed = min(
            base.max_speed,
            room.speed,
            speed_to_stop_within(room.ahead, brake, tuning.reaction),
            max(SLOWEST, speed_to_stop_within(left, brake, 0.05)) if room.ahead > 0 else 0.0,
        )
        marks, turns = self._way.bends()
        coming = (marks >= self._progress - 0.1) & (marks <= self._progress + 5.0)
        for mark, turn in zip(marks[coming].tolist(), turns[coming].tolist(), strict=True):
            slow = max(0.15, 1.0 - turn / 1.2) * min(base.max_speed, 0.8)
            gap = max(0.0, mark - self._progress)
            speed = min(speed, math.sqrt(slow * slow + 2 * brake * gap))
        return speed

    def _steer(
        self, pose: Pose, bearing: float, distance: float, speed: float, room: Room
    ) -> Velocity:
        """Return how a differential base drives towards a bearing [rad], frame map."""
        error = angle_between(pose.yaw, bearing)
        if abs(error) > self._tuning.turn_on_spot:
            self._turning = True
        elif abs(error) < STRAIGHT:
            self._turning = False
        if self._turning:
            return self._turn(error, room)
        base = self._base
        curvature = 2 * math.sin(error) / max(distance, 0.1)
        if abs(curvature) * speed > 0.8 * base.max_yaw_rate:
            speed = 0.8 * base.max_yaw_rate / abs(curvature)
        speed *= max(0.1, 1.0 - abs(error) / (1.3 * self._tuning.turn_on_spot))
        if speed < SLOWEST / 5:
            return STOP
        return Velocity(speed, 0.0, curvature * speed)

    def _slide(
        self, pose: Pose, bearing: float, speed: float, room: Room, left: float
    ) -> Velocity:
        """Return how a holonomic base drives towards a bearing [rad], turning meanwhile."""
        direction = angle_between(pose.yaw, bearing)
        speed = min(speed, self._top_speed(direction))
        facing = bearing if self._goal_yaw is None or left > 1.0 else self._goal_yaw
        wz = self._turn(angle_between(pose.yaw, facing), room).wz
        # In the base's own frame a velocity that keeps its direction on the map turns with -wz;
        # that takes acceleration, of which some must be left for staying on the way.
        most = SWING * self._base.acceleration / max(math.hypot(*self._last[:2]), SLOWEST)
        wz = min(max(wz, -most), most)
        return Velocity(speed * math.cos(direction), speed * math.sin(direction), wz)

    def _top_speed(self, direction: float) -> float:
        """Return a holonomic base's top speed in a direction in its own frame [m/s].

        Between the axes and the diagonals the tip of the velocity moves on straight lines, as it
        does for mecanum and omni wheels.
        """
        fastest = self._base.max_speed
        diagonal = (self._base.max_speed_diagonal or fastest) / math.sqrt(2)
        large = max(abs(math.cos(direction)), abs(math.sin(direction)))
        small = min(abs(math.cos(direction)), abs(math.sin(direction)))
        return fastest / (large + small * (fastest - diagonal) / diagonal)

    def _turn(self, error: float, room: Room) -> Velocity:
        """Return how to turn by an angle [rad] on the spot."""
        if not room.turn:
            return STOP
        base = self._base
        rate = min(
            base.max_yaw_rate,
            math.sqrt(2 * self._tuning.braking * base.yaw_acceleration * abs(error)),
            3.0 * abs(error) + 0.02,
        )
        return Velocity(0.0, 0.0, math.copysign(rate, error))

    def _turn_to_goal(self, pose: Pose, room: Room) -> Velocity:
        """Stand at the end of the way and take up the goal's yaw."""
        standing = max(map(abs, self._last)) < SLOWEST
        if self._goal_yaw is None:
            self._arrived = standing
            return STOP
        error = angle_between(pose.yaw, self._goal_yaw)
        if abs(error) < self._tuning.yaw_tolerance:
            self._arrived = standing
            return STOP
        return self._turn(error, room)

    def _reachable(self, wanted: Velocity, dt: float) -> Velocity:
        """Return the velocity nearest to the wanted one that the base can have after `dt`."""
        base, last = self._base, self._last
        step = base.acceleration * dt
        change = np.array(wanted[:2]) - np.array(last[:2])
        size = float(np.hypot(*change))
        if size > step:
            change *= step / size
        turn = base.yaw_acceleration * dt
        wz = last.wz + min(max(wanted.wz - last.wz, -turn), turn)
        return Velocity(last.vx + float(change[0]), last.vy + float(change[1]), wz)
