# SPDX-License-Identifier: BSD-3-Clause
"""What a robot's `move_base` does, without ROS: takes goals, plans, drives, gives way, gives up.

One `tick` of the control loop takes what the robot senses and hears and returns what it does. The
ROS node around it only translates; the tests run several of these in the simulator's core.

What happens when the robot cannot go on:

- Another robot that talks is in the way: `right_of_way.py` says who waits and who moves. One that
  stands still for `patience` is planned around. A goal that comes no nearer for `give_up` is
  aborted.
- Something else is in the way: the robot stops before it, waits for `patience`, plans again with
  it in the map, and aborts after `attempts` such plans.
- There can be no way (goal in a wall, outside the map): aborted at once.
"""

from __future__ import annotations

import enum
import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from robot_description.follower import Follower, Pose, Room, Velocity
from robot_description.giving_way import GivingWay
from robot_description.grid_map import Disc
from robot_description.lookout import Lookout, Memory, Sight, points_seen, sort_points
from robot_description.passing_place import other_robots
from robot_description.planner import PlanError
from robot_description.pursuit import Pursuit
from robot_description.right_of_way import Announcement, Meeting, meetings
from robot_description.stillness import Stillness
from robot_description.way import Way, angle_between

if TYPE_CHECKING:
    from collections.abc import Iterable, Sequence

    from numpy.typing import NDArray

    from robot_description.grid_map import ClearanceField
    from robot_description.models import RobotModel
    from robot_description.planner import Planner

    Array = NDArray[np.float64]

Point = tuple[float, float]

SLACK = 0.02
"""Room beside the robot at a passing place [m]."""

HEARD_LATE = 0.2
"""How far a robot may have driven since it told where it is [m]."""

CLAIM = 0.3
"""How much of its way a robot claims beyond what it needs to brake [m]."""

CLAIM_TIME = 0.5
"""For how long a robot's claim lasts at its speed [s]: until the others have heard the next."""


@dataclass(frozen=True)
class Settings:
    """How a robot behaves towards what is in its way.

    Attributes:
        patience: How long it stands before something until it plans around it [s].
        attempts: How many plans around unknown things it tries for one goal.
        give_up: How long it pursues a goal that comes no nearer [s].
        announce: How much of its way it tells the others [m].
        silence: After this time without a word a robot counts as unknown [s].
        settle: How long it waits with a new way until the others have heard of it [s].
        position_tolerance: How near the goal it must stand in the end [m].
        yaw_tolerance: How near the goal's yaw it must be turned [rad].
    """

    patience: float = 5.0
    attempts: int = 5
    give_up: float = 120.0
    announce: float = 8.0
    silence: float = 2.0
    settle: float = 0.3
    position_tolerance: float = 0.1
    yaw_tolerance: float = 0.1


class Errand(enum.Enum):
    """Why a robot drives."""

    NONE = 0
    """It does not."""
    GOAL = 1
    """To its goal."""
    ASIDE = 2
    """To a passing place."""


class Outcome(NamedTuple):
    """How a goal has ended: whether it was reached, and what to tell about it."""

    reached: bool
    text: str


class Tick(NamedTuple):
    """What a robot does in one round of the control loop.

    Attributes:
        velocity: What the base shall do.
        announcement: What to tell the other robots.
        outcome: How the goal has ended, if it just has.
    """

    velocity: Velocity
    announcement: Announcement
    outcome: Outcome | None


class Navigator:
    """Brings one robot to its goals.

    Attributes:
        parked: Set to True while the robot must not move (it picks, charges, is defect).
        way: What it is driving along at the moment, frame map; None if it is not.
    """

    def __init__(
        self,
        name: str,
        model: RobotModel,
        planner: Planner,
        follower: Follower,
        field: ClearanceField,
        settings: Settings | None = None,
    ) -> None:
        """Stand without a goal.

        Args:
            name: The robot.
            model: What it is.
            planner: Finds its ways.
            follower: Drives along them.
            field: The clearances of the map.
            settings: How it behaves towards what is in its way.
        """
        self.parked = False
        self.way: Way | None = None
        self._name = name
        self._base = model.base
        self._laser = model.laser
        self._radius = model.base.circumscribed_radius
        self._planner = planner
        self._follower = follower
        self._field = field
        self._settings = settings or Settings()
        self._lookout = Lookout(model.base, model.laser)
        self._manners = GivingWay(name, planner, field, self._radius + SLACK)
        self._memory = Memory()
        self._still = Stillness()
        self._last_time: float | None = None
        self._settled_at = 0.0
        self._errand = Errand.NONE
        self._pursuit: Pursuit | None = None

    @property
    def goal(self) -> Pose | None:
        """The goal being pursued, frame map; None if there is none."""
        return None if self._pursuit is None else self._pursuit.goal

    def set_goal(self, goal: Pose, now: float) -> None:
        """Take up a goal in place of any other; `tick` tells how it ends.

        Args:
            goal: Where to stand in the end, frame map.
            now: The time [s].
        """
        self._pursuit = Pursuit(goal, now)
        self._manners.take(now)
        self._stand()

    def cancel(self) -> None:
        """Drop the goal; the robot stops as quickly as it can."""
        self._pursuit = None
        self._manners.take(None)
        self._stand()

    def tick(self, now: float, pose: Pose, ranges: Array, heard: Iterable[Announcement]) -> Tick:
        """Do one round of the control loop.

        Args:
            now: The time [s].
            pose: Where the robot is, frame map.
            ranges: The latest scan [m].
            heard: The latest announcement of every robot; its own among them is ignored.
        """
        dt = 0.0 if self._last_time is None else min(max(now - self._last_time, 0.0), 0.5)
        self._last_time = now
        self._still.update(now, pose)
        others = self._talking(now, heard)
        sight = self._look(pose, ranges, others)
        outcome = self._set_out(now, pose, others)
        met = self._meet(now, pose, others)
        if not self.parked:
            aside = self._manners.way_out(
                now, self._announce(now, pose, 0.0), met, self._still.lasts(now)
            )
            if aside is not None:
                self._start(now, aside, None, Errand.ASIDE)
                met = self._meet(now, pose, others)
        room = self._room(now, pose, sight, met)
        velocity = self._drive(pose, room, dt)
        outcome = outcome or self._arrive(now, pose) or self._wait(now, pose, sight, met, others)
        if outcome is not None:
            self.cancel()
        return Tick(velocity, self._announce(now, pose, self._claim(velocity, room)), outcome)

    def _talking(self, now: float, heard: Iterable[Announcement]) -> list[Announcement]:
        """Return the others that have been heard lately."""
        return [
            other
            for other in heard
            if other.name != self._name and now - other.time < self._settings.silence
        ]

    def _look(self, pose: Pose, ranges: Array, others: Sequence[Announcement]) -> Sight:
        """Return what the laser sees, sorted; robots may have moved since they told."""
        robots = [Disc(other.x, other.y, other.radius + HEARD_LATE) for other in others]
        return sort_points(points_seen(self._laser, ranges, pose), self._field, robots)

    def _set_out(self, now: float, pose: Pose, others: Sequence[Announcement]) -> Outcome | None:
        """Plan to the goal, if there is one and the robot is not on an errand."""
        pursuit = self._pursuit
        if pursuit is None or self._errand != Errand.NONE or now < pursuit.retry_at:
            return None
        parked = other_robots([other for other in others if other.parked])
        try:
            points = self._plan(now, pose, parked)
        except PlanError as error:
            if error.lasting:
                return Outcome(reached=False, text=str(error))
            return self._try_later(now, str(error))
        self._start(now, points, pursuit.goal.yaw, Errand.GOAL)
        return None

    def _plan(self, now: float, pose: Pose, robots: list[Disc]) -> list[Point]:
        """Plan to the goal around what is remembered and, if that is possible, around robots."""
        assert self._pursuit is not None  # noqa: S101  (only called in pursuit of a goal)
        start, goal = (pose.x, pose.y), self._pursuit.goal[:2]
        seen = self._memory.discs(now)
        if robots:
            try:
                return self._planner.plan(start, goal, seen + robots)
            except PlanError as error:
                if error.lasting:
                    raise
        return self._planner.plan(start, goal, seen)

    def _try_later(self, now: float, why: str) -> Outcome | None:
        """Count a failed attempt; give up after too many."""
        pursuit, settings = self._pursuit, self._settings
        assert pursuit is not None  # noqa: S101  (only called in pursuit of a goal)
        pursuit.attempts += 1
        pursuit.retry_at = now + settings.patience
        if pursuit.attempts <= settings.attempts:
            return None
        return Outcome(reached=False, text=f"{why} (given up after {settings.attempts} attempts)")

    def _start(self, now: float, points: list[Point], yaw: float | None, errand: Errand) -> None:
        self.way = Way(points)
        self._errand = errand
        self._settled_at = now + self._settings.settle
        self._follower.start(self.way, yaw)

    def _stand(self) -> None:
        self.way = None
        self._errand = Errand.NONE

    def _ahead(self, pose: Pose) -> list[Point]:
        """Return the next metres of the way, from where the robot is."""
        if self.way is None:
            return [(pose.x, pose.y)]
        begin = self._follower.progress
        return [(pose.x, pose.y), *self.way.piece(begin, begin + self._settings.announce)]

    def _announce(self, now: float, pose: Pose, claim: float) -> Announcement:
        return Announcement(
            name=self._name,
            time=now,
            x=pose.x,
            y=pose.y,
            radius=self._radius,
            right=self._manners.right,
            way=tuple(self._ahead(pose)),
            claim=claim,
            parked=self.parked,
        )

    def _meet(self, now: float, pose: Pose, others: Sequence[Announcement]) -> list[Meeting]:
        return meetings(self._announce(now, pose, 0.0), others, self._ahead(pose))

    def _room(self, now: float, pose: Pose, sight: Sight, met: Sequence[Meeting]) -> Room:
        """Return what the laser and the right of way leave the robot."""
        if self.way is None or now < self._settled_at:
            return Room(0.0, turn=False)
        seen = self._lookout.room_ahead(self.way, self._follower.progress, pose, sight)
        ahead = min([seen, *(meeting.room for meeting in met)])
        return Room(max(0.0, ahead), turn=self._lookout.may_turn(pose, sight))

    def _drive(self, pose: Pose, room: Room, dt: float) -> Velocity:
        if self.way is None or self.parked:
            return self._follower.halt(dt)
        return self._follower.command(pose, room, dt)

    def _claim(self, velocity: Velocity, room: Room) -> float:
        """Return the stretch ahead that the robot is about to use [m]."""
        if self.way is None:
            return 0.0
        speed = math.hypot(velocity.vx, velocity.vy)
        brake = speed * speed / (2 * self._base.acceleration)
        return min(brake + speed * CLAIM_TIME + CLAIM, max(room.ahead, brake))

    def _arrive(self, now: float, pose: Pose) -> Outcome | None:
        """Notice the end of an errand."""
        if self.way is None or not self._follower.arrived:
            return None
        errand = self._errand
        self._stand()
        if errand == Errand.ASIDE or self._pursuit is None:
            self._manners.give_back()
            return None
        goal, settings = self._pursuit.goal, self._settings
        away = math.dist(pose[:2], goal[:2])
        turned = abs(angle_between(pose.yaw, goal.yaw))
        if away <= settings.position_tolerance and turned <= settings.yaw_tolerance:
            return Outcome(reached=True, text=f"reached within {away:.2f} m and {turned:.2f} rad")
        return self._try_later(now, f"the goal was missed by {away:.2f} m and {turned:.2f} rad")

    def _wait(
        self,
        now: float,
        pose: Pose,
        sight: Sight,
        met: Sequence[Meeting],
        others: Sequence[Announcement],
    ) -> Outcome | None:
        """Do something about standing for too long on the way to the goal."""
        pursuit, settings = self._pursuit, self._settings
        if pursuit is None or self.way is None or self._errand != Errand.GOAL:
            return None
        pursuit.note(now, self.way.length - self._follower.progress)
        if now - pursuit.nearer_at > settings.give_up:
            return Outcome(reached=False, text=self._who_blocks(pose, met))
        if self._still.lasts(now) < settings.patience or now < pursuit.retry_at:
            return None
        pursuit.retry_at = now + settings.patience
        blocking = self._lookout.blocking(self.way, self._follower.progress, sight)
        if len(blocking):
            return self._go_round(now, pose, blocking)
        standing = [o for o in others if len(o.way) == 1 or o.parked or o.claim < CLAIM / 2]
        try:
            points = self._planner.plan(
                pose[:2], pursuit.goal[:2], self._memory.discs(now) + other_robots(standing)
            )
        except PlanError:
            return None  # The right of way will free the way, or `give_up` ends the goal.
        self._start(now, points, pursuit.goal.yaw, Errand.GOAL)
        return None

    def _go_round(self, now: float, pose: Pose, blocking: Array) -> Outcome | None:
        """Plan around things that the laser sees in the way."""
        x, y = blocking[np.argmin(np.hypot(*(blocking - np.array(pose[:2])).T))]
        why = (
            f"something that is not on the map is in the way at ({x:.2f}, {y:.2f}); "
            "clear it away, or choose another goal"
        )
        self._memory.add(now, blocking)
        outcome = self._try_later(now, why)
        if outcome is None:
            self._stand()
            if self._pursuit is not None:
                self._pursuit.retry_at = now
        return outcome

    def _who_blocks(self, pose: Pose, met: Sequence[Meeting]) -> str:
        """Return the text for a goal that came no nearer."""
        nearest = min(met, key=lambda meeting: meeting.room, default=None)
        text = f"no nearer to the goal for {self._settings.give_up:g} s; the robot stands at "
        text += f"({pose.x:.2f}, {pose.y:.2f})"
        if nearest is not None and math.isfinite(nearest.room):
            other = nearest.other
            text += f" behind {other.name} at ({other.x:.2f}, {other.y:.2f})"
            text += ", which does not move away" if other.parked else ""
        return text + "; clear the way and send the goal again"
