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

import math
from dataclasses import replace
from typing import TYPE_CHECKING, NamedTuple

from hive_common.grid_map import Disc
from robot_navigation.control.follower import Follower, Room
from robot_navigation.control.goal_tracker import Errand, GoalTracker, Outcome
from robot_navigation.control.obstacle_check import (
    Memory,
    ObstacleCheck,
    Sight,
    points_seen,
    sort_points,
)
from robot_navigation.control.settings import Settings
from robot_navigation.control.stuck_detector import StuckDetector
from robot_navigation.planning.path import Way
from robot_navigation.planning.planner import PlanError, plan_around
from robot_navigation.traffic.giving_way import GivingWay
from robot_navigation.traffic.passing_place import other_robots
from robot_navigation.traffic.right_of_way import (
    CLAIM,
    Announcement,
    Meeting,
    claimed_stretch,
    meetings,
)

if TYPE_CHECKING:
    from collections.abc import Iterable, Sequence

    import numpy as np
    from numpy.typing import NDArray

    from hive_common.grid_map import ClearanceField
    from hive_common.pose import Pose, Velocity
    from robot_description.models import RobotModel
    from robot_navigation.planning.planner import Planner

    Array = NDArray[np.float64]

Point = tuple[float, float]

SLACK = 0.02
"""Room beside the robot at a passing place [m]."""

HEARD_LATE = 0.2
"""How far a robot may have driven since it told where it is [m]."""

MAX_ROUND = 0.5
"""After a round of the control loop that took longer the base has stopped by itself [s]."""


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
        self._obstacle_check = ObstacleCheck(model.base, model.laser)
        self._manners = GivingWay(name, planner, field, self._radius + SLACK)
        self._memory = Memory()
        self._still = StuckDetector()
        self._last_time: float | None = None
        self._settled_at = 0.0
        self._errand = Errand.NONE
        self._goal_tracker: GoalTracker | None = None

    @property
    def goal(self) -> Pose | None:
        """The goal being pursued, frame map; None if there is none."""
        return None if self._goal_tracker is None else self._goal_tracker.goal

    def set_goal(self, goal: Pose, now: float) -> None:
        """Take up a goal in place of any other; `tick` tells how it ends.

        Args:
            goal: Where to stand in the end, frame map.
            now: The time [s].
        """
        self._goal_tracker = GoalTracker(goal, now, self._settings)
        self._manners.take(now)
        self._stand()

    def cancel(self) -> None:
        """Drop the goal; the robot stops as quickly as it can."""
        self._goal_tracker = None
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
        since = 0.0 if self._last_time is None else now - self._last_time
        dt = min(max(since, 0.0), MAX_ROUND)
        if since > MAX_ROUND:
            self._follower.stopped()
        self._last_time = now
        self._still.update(now, pose)
        others = self._talking(now, heard)
        outcome = self._set_out(now, pose, others)
        me, met = self._meet(now, pose, others)
        if not self.parked:
            aside = self._manners.way_out(now, me, met, self._still.lasts(now))
            if aside is not None:
                self._start(now, aside, None, Errand.ASIDE)
                me, met = self._meet(now, pose, others)
        if self.way is None or self.parked:
            velocity, room = self._follower.halt(dt), 0.0
        else:
            sight = self._look(pose, ranges, others)
            chance = self._room(now, pose, self.way, sight, met)
            velocity, room = self._follower.command(pose, chance, dt), chance.ahead
            outcome = self._arrive(now, pose) or self._wait(now, pose, sight, met)
        if outcome is not None:
            self.cancel()
            me, met = self._meet(now, pose, others)
        return Tick(velocity, self._claimed(me, velocity, room), outcome)

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
        pursuit = self._goal_tracker
        if pursuit is None or self._errand != Errand.NONE or now < pursuit.retry_at:
            return None
        parked = other_robots([other for other in others if other.parked])
        try:
            points = plan_around(
                self._planner, pose[:2], pursuit.goal[:2], self._memory.discs(now), parked
            )
        except PlanError as error:
            if error.lasting:
                return Outcome(reached=False, text=str(error))
            return pursuit.failed(now, str(error))
        self._start(now, points, pursuit.goal.yaw, Errand.GOAL)
        return None

    def _start(self, now: float, points: list[Point], yaw: float | None, errand: Errand) -> None:
        self.way = Way(points)
        self._errand = errand
        self._settled_at = now + self._settings.settle
        self._follower.start(self.way, yaw)

    def _stand(self) -> None:
        self.way = None
        self._errand = Errand.NONE

    def _meet(
        self, now: float, pose: Pose, others: Sequence[Announcement]
    ) -> tuple[Announcement, list[Meeting]]:
        """Return what the robot says of itself, without a claim, and how it meets the others."""
        ahead = [(pose.x, pose.y)]
        if self.way is not None:
            begin = self._follower.progress
            ahead += self.way.piece(begin, begin + self._settings.announce)
        me = Announcement(
            name=self._name,
            time=now,
            x=pose.x,
            y=pose.y,
            radius=self._radius,
            right=self._manners.right,
            way=tuple(ahead),
            claim=0.0,
            parked=self.parked,
        )
        return me, meetings(me, others)

    def _claimed(self, me: Announcement, velocity: Velocity, room: float) -> Announcement:
        """Return the announcement with the stretch ahead that the robot is about to use."""
        if self.way is None:
            return me
        speed = math.hypot(velocity.vx, velocity.vy)
        claim = claimed_stretch(speed, self._base.acceleration, room)
        return replace(me, claim=claim, right=self._manners.right)

    def _room(
        self, now: float, pose: Pose, way: Way, sight: Sight, met: Sequence[Meeting]
    ) -> Room:
        """Return what the laser and the right of way leave the robot."""
        if now < self._settled_at:
            return Room(0.0, turn=False)
        seen = self._obstacle_check.room_ahead(way, self._follower.progress, pose, sight)
        ahead = min([seen, *(meeting.room for meeting in met)])
        return Room(max(0.0, ahead), turn=self._obstacle_check.may_turn(pose, sight))

    def _arrive(self, now: float, pose: Pose) -> Outcome | None:
        """Notice the end of an errand."""
        if not self._follower.arrived:
            return None
        errand = self._errand
        self._stand()
        if errand == Errand.ASIDE or self._goal_tracker is None:
            self._manners.give_back()
            return None
        return self._goal_tracker.arrived(now, pose)

    def _wait(
        self, now: float, pose: Pose, sight: Sight, met: Sequence[Meeting]
    ) -> Outcome | None:
        """Do something about standing for too long on the way to the goal."""
        pursuit, way, patience = self._goal_tracker, self.way, self._settings.patience
        if pursuit is None or way is None or self._errand != Errand.GOAL:
            return None
        pursuit.note(now, way.length - self._follower.progress)
        if pursuit.hopeless(now):
            return pursuit.given_up(pose, met)
        if self._still.lasts(now) < patience or now < pursuit.retry_at:
            return None
        blocking = self._obstacle_check.blocking(way, self._follower.progress, sight)
        if len(blocking):
            self._memory.add(now, blocking)
            self._stand()
            return pursuit.blocked(now, pose, blocking)
        pursuit.retry_at = now + patience
        standing = [meeting.other for meeting in met if meeting.other.claim < CLAIM]
        discs = self._memory.discs(now) + other_robots(standing)
        try:
            points = self._planner.plan(pose[:2], pursuit.goal[:2], discs)
        except PlanError:
            return None  # The right of way will free the way, or the goal is given up.
        self._start(now, points, pursuit.goal.yaw, Errand.GOAL)
        return None
