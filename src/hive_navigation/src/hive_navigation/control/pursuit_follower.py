# SPDX-License-Identifier: BSD-3-Clause
"""A pure-pursuit `Follower`: it steers for a point a short distance ahead on the path.

R. C. Coulter, Implementation of the Pure Pursuit Path Tracking Algorithm, Carnegie Mellon
University, 1992. It drives as fast as all limits allow: the base's, those of the bends ahead, and
the room that the laser and the right of way leave.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from hive_common.pose import STOP, Pose, Velocity
from hive_navigation.planning.path import Path, angle_between
from hive_navigation.traffic.right_of_way import Limits

if TYPE_CHECKING:
    from hive_navigation.control.follower import Room
    from robot_description.models import Base


LOOK_AHEAD = 0.20  # distance to the point that it steers for at standstill [m]
LOOK_AHEAD_TIME = 0.15  # by how much that distance grows with the speed [s]
TURN_ON_SPOT = 0.7  # heading error above which it stops and turns [rad]
BRAKING = 0.7  # share of the base's deceleration that it plans with [-]; the rest is reserve
DELAY = 0.15  # time until a command takes effect, half a control period included [s]

REACTION = 0.5
"""The longest such time [s]. A base goes on for this long without commands, for example while the
navigator gets no processor, and must still stop in time."""

POSITION_TOLERANCE = 0.05  # distance from the goal that counts as reached [m]
YAW_TOLERANCE = 0.05  # yaw error at the goal that counts as turned [rad]
STANDSTILL = 0.05  # below this speed a base counts as standing [m/s], [rad/s]
AT_END = 0.01  # with less than this left of a path the base is at its end [m]
SWING = 0.3  # share of its acceleration that a holonomic base may use to turn while it drives [-]

HOLONOMIC_TOLERANCE = 0.3
"""Share of `position_tolerance` for a holonomic base, which can correct sideways [-]."""

BESIDE_BEND = 0.04
"""By how far a base may cut a bend [m]. A turn by an angle `a` from standstill to standstill takes
2 sqrt(a / yaw acceleration). A base that drives a way `s` meanwhile describes about an arc of that
length, which passes the corner at a distance of s a / 8."""

SLOWEST = (
    0.12  # speed at which it takes the sharpest bend that it does not turn in on the spot [m/s]
)

QUARTER = math.pi / 2  # the turn by which its turning speed is told [rad]
TURN_STEP = 0.02  # in which that turn is followed [s]

STRAIGHT = 0.1  # heading error at which a turn on the spot ends [rad]


def speed_to_stop_within(distance: float, deceleration: float, reaction: float) -> float:
    """Return the speed [m/s] from which a base stops within a distance [m]; 0 for a negative one.

    It solves distance = v * reaction + v^2 / (2 * deceleration), with the time until the base
    starts to brake [s] and a deceleration above 0 [m/s^2].
    """
    if distance <= 0:
        return 0.0
    if math.isinf(distance):
        return math.inf
    delay = deceleration * reaction
    return math.sqrt(delay * delay + 2 * deceleration * distance) - delay


class PursuitFollower:
    """A `Follower` for differential and holonomic bases; see there for its other attributes.

    Attributes:
        speed_limit: It drives no faster, once it has braked to that [m/s].
    """

    def __init__(self, base: Base) -> None:
        self.progress = 0.0
        self.arrived = True
        self.committed = 0.0  # it obeys every command
        self.speed_limit = math.inf
        self._base = base
        self._path = Path([(0.0, 0.0)])
        self._goal_yaw: float | None = None
        self._turning = False
        self._at_end = True
        self._last = STOP

    def start(self, path: Path, goal_yaw: float | None) -> None:
        """See `Follower.start`."""
        self._path = path
        self._goal_yaw = goal_yaw
        self.progress = 0.0
        self._turning = self._at_end = self.arrived = False

    def command(self, pose: Pose, room: Room, dt: float) -> Velocity:
        """See `Follower.command`."""
        wanted = STOP if self.arrived else self._wanted(self._soon(pose), room)
        self._last = self._reachable(wanted, dt)
        return self._last

    def stopped(self) -> None:
        """See `Follower.stopped`."""
        self._last = STOP

    def top_speed(self, room: float) -> float:
        """See `Follower.top_speed`."""
        brake = BRAKING * self._base.acceleration
        return min(self._base.max_speed, speed_to_stop_within(room, brake, REACTION))

    def limits(self, room: float) -> Limits:
        """See `Follower.limits`."""
        base = self._base
        inverse = (1 + 1 / BRAKING) / 2  # it brakes more gently than it speeds up
        return Limits(self.top_speed(room), base.acceleration / inverse, self._quarter_rate())

    def _quarter_rate(self) -> float:
        """Return the mean rate of a quarter turn on the spot [rad/s]."""
        left, rate, steps = QUARTER, 0.0, 0
        while left > STRAIGHT:
            rate = min(rate + self._base.yaw_acceleration * TURN_STEP, self._turning_rate(left))
            left -= rate * TURN_STEP
            steps += 1
        return QUARTER / (steps * TURN_STEP)

    def halt(self, dt: float) -> Velocity:
        """See `Follower.halt`."""
        self._last = self._reachable(STOP, dt)
        return self._last

    def _soon(self, pose: Pose) -> Pose:
        """Return where the base will be when the next command takes effect."""
        last = self._last
        yaw = pose.yaw + last.wz * DELAY / 2
        x = pose.x + DELAY * (last.vx * math.cos(yaw) - last.vy * math.sin(yaw))
        y = pose.y + DELAY * (last.vx * math.sin(yaw) + last.vy * math.cos(yaw))
        return Pose(x, y, pose.yaw + last.wz * DELAY)

    def _wanted(self, pose: Pose, room: Room) -> Velocity:
        """Return the best velocity for a base without inertia."""
        path = self._path
        here = (pose.x, pose.y)
        self.progress = path.nearest(here, self.progress - 0.2, self.progress + 1.0)
        left = path.length - self.progress
        away = math.dist(here, path.end)
        near = POSITION_TOLERANCE * (HOLONOMIC_TOLERANCE if self._base.holonomic else 1.0)
        if left < 0.5 * near and away < 2 * near:
            self._at_end = True
        if self._at_end:
            return self._turn_to_goal(pose, room)
        ahead = LOOK_AHEAD + LOOK_AHEAD_TIME * math.hypot(*self._last[:2])
        # A base that has passed the end beside it steers for the end itself.
        target = path.end if left < AT_END else path.at(self.progress + ahead)
        speed = self._speed(room, away if left < AT_END else left)
        bearing = math.atan2(target[1] - pose.y, target[0] - pose.x)
        if self._base.holonomic:
            return self._slide(pose, bearing, speed, room, left)
        return self._steer(pose, bearing, math.dist(here, target), speed, room)

    def _speed(self, room: Room, left: float) -> float:
        """Return the highest speed that the base, the bends and the room ahead allow [m/s]."""
        base = self._base
        brake = BRAKING * base.acceleration
        speed = min(
            self.speed_limit,
            self.top_speed(room.ahead),
            max(STANDSTILL, speed_to_stop_within(left, brake, 0.05)) if room.ahead > 0 else 0.0,
        )
        for mark, turn in self._path.bends(self.progress - 0.1, self.progress + 5.0):
            slow = max(SLOWEST, self._speed_in(turn))
            gap = max(0.0, mark - self.progress)
            speed = min(speed, math.sqrt(slow * slow + 2 * brake * gap))
        return speed

    def _speed_in(self, turn: float) -> float:
        """Return the speed at which the base may drive through a bend [m/s]; see `BESIDE_BEND`."""
        if turn == 0.0:
            return math.inf
        return 4 * BESIDE_BEND * math.sqrt(self._base.yaw_acceleration / turn) / turn

    def _steer(
        self, pose: Pose, bearing: float, distance: float, speed: float, room: Room
    ) -> Velocity:
        """Return the velocity of a differential base towards a bearing [rad], frame map."""
        error = angle_between(pose.yaw, bearing)
        if abs(error) > TURN_ON_SPOT:
            self._turning = True
        elif abs(error) < STRAIGHT:
            self._turning = False
        if self._turning:
            return self._turn(error, room)
        base = self._base
        curvature = 2 * math.sin(error) / max(distance, 0.1)
        if abs(curvature) * speed > 0.8 * base.max_yaw_rate:
            speed = 0.8 * base.max_yaw_rate / abs(curvature)
        speed *= max(0.1, 1.0 - abs(error) / (1.3 * TURN_ON_SPOT))
        if speed < STANDSTILL / 5:
            return STOP
        return Velocity(speed, 0.0, curvature * speed)

    def _slide(
        self, pose: Pose, bearing: float, speed: float, room: Room, left: float
    ) -> Velocity:
        """Return the velocity of a holonomic base towards a bearing [rad]; it turns meanwhile."""
        direction = angle_between(pose.yaw, bearing)
        speed = min(speed, self._top_speed(direction))
        facing = bearing if self._goal_yaw is None or left > 1.0 else self._goal_yaw
        wz = self._turn(angle_between(pose.yaw, facing), room).wz
        # In the base's own frame a velocity that keeps its direction on the map turns with -wz.
        # That takes acceleration, of which some must be left to stay on the path.
        max_wz = SWING * self._base.acceleration / max(math.hypot(*self._last[:2]), STANDSTILL)
        wz = min(max(wz, -max_wz), max_wz)
        return Velocity(speed * math.cos(direction), speed * math.sin(direction), wz)

    def _top_speed(self, direction: float) -> float:
        """Return a holonomic base's top speed in a direction in its own frame [m/s].

        Between an axis and a diagonal the tip of the velocity moves on a straight line, as it
        does for mecanum and omni wheels.
        """
        fastest = self._base.max_speed
        diagonal = (self._base.max_speed_diagonal or fastest) / math.sqrt(2)
        large = max(abs(math.cos(direction)), abs(math.sin(direction)))
        small = min(abs(math.cos(direction)), abs(math.sin(direction)))
        return fastest / (large + small * (fastest - diagonal) / diagonal)

    def _turn(self, error: float, room: Room) -> Velocity:
        """Return the velocity of a turn on the spot by an angle [rad]."""
        if not room.turn:
            return STOP
        return Velocity(0.0, 0.0, math.copysign(self._turning_rate(abs(error)), error))

    def _turning_rate(self, left: float) -> float:
        """Return how fast the base turns on the spot [rad/s] with so much left of it [rad]."""
        base = self._base
        brake = BRAKING * base.yaw_acceleration
        return min(base.max_yaw_rate, math.sqrt(2 * brake * left), 3.0 * left + 0.02)

    def _turn_to_goal(self, pose: Pose, room: Room) -> Velocity:
        """Return the velocity at the end of the path, where the base turns to the goal's yaw."""
        if self._goal_yaw is not None:
            error = angle_between(pose.yaw, self._goal_yaw)
            if abs(error) >= YAW_TOLERANCE:
                return self._turn(error, room)
        self.arrived = max(map(abs, self._last)) < STANDSTILL
        return STOP

    def _reachable(self, wanted: Velocity, dt: float) -> Velocity:
        """Return the velocity nearest to `wanted` that the base can have after `dt` [s]."""
        base, last = self._base, self._last
        step = base.acceleration * dt
        dx, dy = wanted.vx - last.vx, wanted.vy - last.vy
        size = math.hypot(dx, dy)
        share = step / size if size > step else 1.0
        turn = base.yaw_acceleration * dt
        wz = last.wz + min(max(wanted.wz - last.wz, -turn), turn)
        return Velocity(last.vx + share * dx, last.vy + share * dy, wz)
