# SPDX-License-Identifier: BSD-3-Clause
"""A robot's `move_base` without ROS: it takes goals, plans, drives, gives way, and gives up.

One `tick` of the control loop takes what the robot senses and hears and returns what it does. The
ROS node only translates; tests run several navigators in the simulator's core.

A robot that has a route from the traffic planner drives along it and waits for whom it says. One
that has none plans its own path, and gives way.

What happens when the robot cannot go on:

- Another robot that announces itself blocks the path: `right_of_way.py` decides who waits and who
  moves. A robot that stands for `patience` is planned around. A goal without progress for
  `give_up` is aborted.
- Something else blocks the path: the robot stops, waits for `patience`, plans around it, and
  aborts the goal after `attempts` such plans.
- No path can exist (the goal is in a wall or off the map): the goal is aborted at once.
"""

from __future__ import annotations

import math
from functools import partial
from typing import TYPE_CHECKING, NamedTuple

from robot_navigation.control.follower import Follower, Room
from robot_navigation.control.goal_tracker import (
    GoalOutcome,
    GoalTracker,
    NavigationSettings,
    StuckDetector,
)
from robot_navigation.control.obstacle_check import (
    ON_ROBOT,
    ObstacleCheck,
    ObstacleMemory,
    VisibleObstacles,
    points_seen,
    sort_points,
)
from robot_navigation.control.route_keeper import Hold, RouteKeeper
from robot_navigation.planning.clearance import Disc
from robot_navigation.planning.path import Path
from robot_navigation.planning.planner import PlanError, plan_around
from robot_navigation.traffic.giving_way import GivingWay
from robot_navigation.traffic.passing_place import other_robots
from robot_navigation.traffic.right_of_way import (
    CLAIM,
    Announcement,
    Limits,
    Meeting,
    claimed_stretch,
    meetings,
)

if TYPE_CHECKING:
    from collections.abc import Sequence

    from hive_common.geometry import Array
    from hive_common.pose import Pose, Velocity
    from robot_description.models import RobotModel
    from robot_navigation.mapf.route import Route
    from robot_navigation.planning.clearance import ClearanceField
    from robot_navigation.planning.path import Point
    from robot_navigation.planning.planner import Planner
    from robot_navigation.traffic.neighbourhood import Neighbourhood

SLACK = 0.02  # clearance beyond the robot's radius at a passing place [m]
HEARD_LATE = 0.2  # how far a robot may have driven since it announced where it is [m]
MAX_ROUND = 0.5  # after a longer round of the control loop the base has stopped by itself [s]
AT_HAND = 0.1  # a robot that may go no farther than this waits [m]
SAME_PATH = 0.02  # how far corners of a path may be from those of another to be the same [m]
ROUTE_WITHIN = 3.0  # how long a goal waits for a route while a planner is heard [s]


class Tick(NamedTuple):
    """What a robot does in one round of the control loop."""

    velocity: Velocity  # the command for the base
    announcement: Announcement  # what to tell the other robots
    outcome: GoalOutcome | None  # how the goal ended, if it just did


class Navigator:
    """Takes one robot to its goals.

    Attributes:
        stationary: Set to True while the robot must not move (it picks, charges, is defect).
        path: The path that it drives along, frame map; None if there is none.
    """

    def __init__(
        self,
        name: str,
        model: RobotModel,
        planner: Planner,
        follower: Follower,
        field: ClearanceField,
        settings: NavigationSettings | None = None,
    ) -> None:
        """Stand without a goal; `field` holds the clearances of the planner's map."""
        self.stationary = False
        self.path: Path | None = None
        self._name = name
        self._base = model.base
        self._laser = model.laser
        self._radius = model.base.circumscribed_radius
        self._planner = planner
        self._follower = follower
        self._field = field
        # How far away a robot that the laser sees may be.
        reach = model.laser.range_max + math.hypot(*model.laser.pose[:2])
        self._sight = reach + HEARD_LATE + ON_ROBOT
        self._settings = settings or NavigationSettings()
        self._obstacle_check = ObstacleCheck(model.base, model.laser)
        self._giving_way = GivingWay(name, planner, field, self._radius + SLACK)
        self._memory = ObstacleMemory()
        self._stuck = StuckDetector()
        self._last_time: float | None = None
        self._settled_at = 0.0
        self._moving_aside = False
        self._tracker: GoalTracker | None = None
        self._keeper = RouteKeeper(name)
        self._claim = 0.0  # [m]
        self._waits_for = ""  # the robot for which it waits
        self._limits = Limits(
            follower.top_speed(self._obstacle_check.most_room),
            model.base.acceleration,
            model.base.max_yaw_rate,
        )
        self._given_at = 0.0
        self._ends_at_goal = False  # whether the route's path does

    @property
    def goal(self) -> Pose | None:
        """The goal being pursued, frame map; None if there is none."""
        return None if self._tracker is None else self._tracker.goal

    def set_goal(self, goal: Pose, now: float) -> None:
        """Take up a goal, frame map, in place of any other; `tick` reports how it ends."""
        self._tracker = GoalTracker(goal, now, self._settings)
        self._given_at = now
        self._giving_way.set_goal(now)
        self.path = None

    def cancel(self) -> None:
        """Drop the goal; the robot stops as quickly as it can."""
        self._tracker = None
        self._giving_way.set_goal(None)
        self.path = None

    def take_routes(self, routes: Sequence[Route], now: float) -> None:
        """Take in a plan of the traffic planner: the routes of all robots.

        Args:
            routes: They belong to one plan.
            now: The time [s].
        """
        self._keeper.hear(routes, now)

    def tick(self, now: float, pose: Pose, ranges: Array, heard: Neighbourhood) -> Tick:
        """Do one round of the control loop.

        Args:
            now: The time [s].
            pose: Where the robot is, frame map.
            ranges: The latest scan [m].
            heard: What all robots have announced; its own announcement is ignored.
        """
        since = 0.0 if self._last_time is None else now - self._last_time
        dt = min(max(since, 0.0), MAX_ROUND)
        if since > MAX_ROUND:
            self._follower.stopped()
        self._last_time = now
        self._stuck.update(now, pose)
        self._take_route(now, pose)
        outcome = self._plan_to_goal(now, pose, heard)
        me, near, met = self._meet(now, pose, heard)
        if not self.stationary and self._keeper.route is None:
            standing = self._stuck.duration(now)
            everyone = partial(heard.others, self._name, now, self._settings.silence)
            aside = self._giving_way.path_aside(now, me, met, standing, everyone)
            if aside is not None:
                self._start(now, aside, goal=None)
                me, near, met = self._meet(now, pose, heard)
        if self.path is None or self.stationary:
            velocity, room = self._follower.halt(dt), 0.0
        else:
            # The others may have moved since their announcements.
            robots = [
                Disc(other.x, other.y, other.radius + HEARD_LATE)
                for other in near
                if math.hypot(other.x - pose.x, other.y - pose.y) < self._sight + other.radius
            ]
            points = points_seen(self._laser, ranges, pose)
            obstacles = sort_points(points, self._field, robots)
            allowed = self._room(now, pose, self.path, obstacles, met, heard)
            velocity, room = self._follower.command(pose, allowed, dt), allowed.ahead
            outcome = self._arrive(now, pose) or self._wait(now, pose, obstacles, met, heard)
        if outcome is not None:
            self.cancel()
            me, _, _ = self._meet(now, pose, heard)
        return Tick(velocity, self._claimed(me, velocity, room), outcome)

    def _take_route(self, now: float, pose: Pose) -> None:
        """Take up a new route of the traffic planner, and drop one that nobody renews."""
        keeper = self._keeper
        if keeper.route is not None and not keeper.is_guided(now):
            keeper.drop()
            self.path = None
        if self.stationary:
            return
        claimed: list[Point] = []
        if self.path is not None and self._claim > 0:
            begin = self._follower.progress
            claimed = self.path.section(begin, begin + self._claim)
        path = keeper.offer(self.goal, pose, claimed)
        if path is None or keeper.route is None:
            return
        if self._goes_on(path) and self._ends_at_goal == keeper.route.complete:
            keeper.go_on(self._follower.progress)
            return
        self._ends_at_goal = keeper.route.complete
        goal = self.goal if keeper.route.complete else None
        self.path, self._moving_aside = path, False
        self._follower.start(path, None if goal is None else goal.yaw)

    def _goes_on(self, path: Path) -> bool:
        """Return whether a new path is what is left of the one that the robot drives along."""
        if self.path is None or self._moving_aside:
            return False
        left = self.path.section(self._follower.progress, self.path.length)
        points = path.section(0.0, path.length)
        return len(left) == len(points) and all(
            math.dist(*pair) < SAME_PATH for pair in zip(left, points, strict=True)
        )

    def _plan_to_goal(self, now: float, pose: Pose, heard: Neighbourhood) -> GoalOutcome | None:
        """Plan to the goal, if there is one and the robot has no path."""
        tracker = self._tracker
        if tracker is None or self.path is not None or now < tracker.retry_at:
            return None
        if self._keeper.is_guided(now) and now < self._given_at + ROUTE_WITHIN:
            return None
        self._keeper.drop()
        others = heard.others(self._name, now, self._settings.silence)
        stationary = other_robots([other for other in others if other.stationary])
        try:
            points = plan_around(
                self._planner, pose[:2], tracker.goal[:2], self._memory.discs(now), stationary
            )
        except PlanError as error:
            if error.lasting:
                return GoalOutcome(reached=False, text=str(error))
            return tracker.attempt_failed(now, str(error))
        self._start(now, points, tracker.goal)
        return None

    def _start(self, now: float, points: list[Point], goal: Pose | None) -> None:
        """Take a path to a goal; None for a passing place."""
        self._ends_at_goal = False
        self.path = Path(points)
        self._moving_aside = goal is None
        self._settled_at = now + self._settings.settle
        self._follower.start(self.path, None if goal is None else goal.yaw)

    def _meet(
        self, now: float, pose: Pose, heard: Neighbourhood
    ) -> tuple[Announcement, list[Announcement], list[Meeting]]:
        """Return the robot's announcement, without a claim, who is near, and how it meets them."""
        ahead = [(pose.x, pose.y)]
        if self.path is not None:
            begin = self._follower.progress
            ahead += self.path.section(begin, begin + self._settings.announce)
        me = Announcement(
            name=self._name,
            time=now,
            x=pose.x,
            y=pose.y,
            radius=self._radius,
            right=self._giving_way.right,
            path=tuple(ahead),
            claim=0.0,
            stationary=self.stationary,
            yaw=pose.yaw,
            goal=None if self.goal is None else (self.goal.x, self.goal.y),
            limits=self._limits,
            plan=self._keeper.plan,
            passed=self._keeper.passed,
            waits_for=self._waits_for,
            obstacles=tuple((disc.x, disc.y, disc.radius) for disc in self._memory.discs(now)),
        )
        near = heard.near(me, self._sight, self._settings.silence)
        return me, near, meetings(me, near)

    def _claimed(self, me: Announcement, velocity: Velocity, room: float) -> Announcement:
        """Return the announcement with the stretch of the path that the robot claims."""
        self._claim = 0.0
        if self.path is None:
            return me
        speed = math.hypot(velocity.vx, velocity.vy)
        self._claim = claimed_stretch(speed, self._base.acceleration, room)
        return me.with_claim(self._claim, self._giving_way.right)

    def _room(
        self,
        now: float,
        pose: Pose,
        path: Path,
        obstacles: VisibleObstacles,
        met: Sequence[Meeting],
        heard: Neighbourhood,
    ) -> Room:
        """Return what the laser, the route and the right of way allow the robot."""
        if now < self._settled_at:
            return Room(0.0, turn=False)
        free = self._obstacle_check.room_ahead(path, self._follower.progress, pose, obstacles)
        holds = [Hold(meeting.room, meeting.other.name) for meeting in met]
        if self._keeper.route is not None:
            self._keeper.advance(self._follower.progress)
            holds.append(self._keeper.hold(self._follower.progress, heard))
        first = min(holds, default=Hold(math.inf, ""))
        self._waits_for = first.robot if first.room < AT_HAND else ""
        ahead = min(free, first.room)
        return Room(max(0.0, ahead), turn=self._obstacle_check.may_turn(pose, obstacles))

    def _arrive(self, now: float, pose: Pose) -> GoalOutcome | None:
        """Finish a path at whose end the robot stands."""
        route = self._keeper.route
        if not self._follower.arrived or (route is not None and not route.complete):
            return None
        self.path = None
        if self._moving_aside or self._tracker is None:
            self._giving_way.restore()
            return None
        return self._tracker.stopped_at(now, pose)

    def _wait(
        self,
        now: float,
        pose: Pose,
        obstacles: VisibleObstacles,
        met: Sequence[Meeting],
        heard: Neighbourhood,
    ) -> GoalOutcome | None:
        """Plan again, or give up, after standing for too long on the path to the goal."""
        tracker, path, patience = self._tracker, self.path, self._settings.patience
        if tracker is None or path is None or self._moving_aside:
            return None
        guided = self._keeper.route is not None
        if not guided:
            tracker.update(now, path.length - self._follower.progress)
        elif self._stuck.duration(now) < patience:  # a route may lead away from the goal, too
            tracker.note_progress(now)
        if tracker.is_hopeless(now):
            return tracker.given_up(pose, met)
        if self._stuck.duration(now) < patience or now < tracker.retry_at:
            return None
        return self._stand(now, pose, path, tracker, obstacles, heard)

    def _stand(
        self,
        now: float,
        pose: Pose,
        path: Path,
        tracker: GoalTracker,
        obstacles: VisibleObstacles,
        heard: Neighbourhood,
    ) -> GoalOutcome | None:
        """Plan around what keeps the robot standing, where it has no route."""
        guided, patience = self._keeper.route is not None, self._settings.patience
        blocking = self._obstacle_check.blocking(path, self._follower.progress, obstacles)
        if len(blocking):
            self._memory.add(now, blocking)
            outcome = tracker.blocked(now, pose, blocking)
            if guided:  # the planner hears of the obstacle, and leads around it
                tracker.retry_at = now + patience
            else:
                self.path = None
            return outcome
        tracker.retry_at = now + patience
        if guided:
            return None
        others = heard.others(self._name, now, self._settings.silence)
        standing = [other for other in others if other.claim < CLAIM]
        discs = self._memory.discs(now) + other_robots(standing)
        try:
            points = self._planner.plan(pose[:2], tracker.goal[:2], discs)
        except PlanError:
            return None  # The right of way will clear the path, or the goal is given up.
        self._start(now, points, tracker.goal)
        return None
