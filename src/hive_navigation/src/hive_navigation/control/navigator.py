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

from hive_navigation.control.driver import Driver
from hive_navigation.control.goal_tracker import (
    GoalOutcome,
    GoalTracker,
    NavigationSettings,
    StuckDetector,
)
from hive_navigation.control.obstacle_check import ObstacleMemory
from hive_navigation.control.route_keeper import SAME_GOAL, Hold, RouteKeeper
from hive_navigation.planning.path import Path, angle_between
from hive_navigation.planning.planner import PlanError, plan_around
from hive_navigation.traffic.giving_way import GivingWay
from hive_navigation.traffic.passing_place import other_robots
from hive_navigation.traffic.right_of_way import CLAIM, Announcement, Meeting, meetings

if TYPE_CHECKING:
    from collections.abc import Sequence

    from hive_common.pose import Pose, Velocity
    from hive_navigation.control.follower import Follower
    from hive_navigation.control.obstacle_check import VisibleObstacles
    from hive_navigation.mapf.route import Route
    from hive_navigation.planning.clearance import ClearanceField
    from hive_navigation.planning.path import Point
    from hive_navigation.planning.planner import Planner
    from hive_navigation.traffic.neighbourhood import Neighbourhood
    from robot_description.models import RobotModel
    from robot_description.scan import Scan

SLACK = 0.02  # clearance beyond the robot's radius at a passing place [m]
AT_HAND = 0.1  # a robot that may go no farther than this waits [m]
SAME_PATH = 0.02  # how far corners of a path may be from those of another to be the same [m]
SAME_YAW = 0.01  # how far headings of a goal may be apart to be the same [rad]
NEAR = 0.5  # a robot has driven no farther than this since its last round [m]
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
        self._name = name
        self._radius = model.base.circumscribed_radius
        self._planner = planner
        self._settings = settings or NavigationSettings()
        self._driver = Driver(model, follower, field, self._settings.settle)
        self._giving_way = GivingWay(name, planner, field, self._radius + SLACK)
        self._memory = ObstacleMemory()
        self._stuck = StuckDetector()
        self._moving_aside = False
        self._tracker: GoalTracker | None = None
        self._keeper = RouteKeeper(name)
        self._waits_for = ""  # the robot for which it waits
        self._given_at = 0.0
        self._awaits_since = 0.0  # a route to its goal, or to the first of those that are streamed
        self._ends_at_goal = False  # whether the route's path does
        self._turns_only = False  # whether it only turns to its path, until it has a route

    @property
    def path(self) -> Path | None:
        """The path that it drives along, frame map; None if there is none."""
        return self._driver.path

    @property
    def goal(self) -> Pose | None:
        """The goal being pursued, frame map; None if there is none."""
        return None if self._tracker is None else self._tracker.goal

    def set_goal(self, goal: Pose, now: float) -> None:
        """Take up a goal, frame map, in place of any other; `tick` reports how it ends.

        With the goal that it has, the robot goes on. Of goals that come faster than routes, only
        the first waits for one.
        """
        is_first = self._tracker is None or now - self._given_at > ROUTE_WITHIN
        self._given_at = now
        if self._tracker is not None and _is_same(goal, self._tracker.goal):
            return
        if is_first:
            self._awaits_since = now
        self._tracker = GoalTracker(goal, now, self._settings)
        self._giving_way.set_goal(now)
        self._driver.let_go()

    def cancel(self) -> None:
        """Drop the goal; the robot stops as quickly as it can."""
        self._tracker = None
        self._giving_way.set_goal(None)
        self._driver.drop()

    def forget_obstacles(self) -> None:
        """Forget the obstacles that it has seen and that are not on the map.

        A robot without a route plans anew, because its path may lead around them.
        """
        self._memory = ObstacleMemory()
        self.plan_unless_guided()

    def plan_unless_guided(self) -> None:
        """Plan to the goal again if the robot has planned its path itself."""
        if self._tracker is not None and self._keeper.route is None and not self._moving_aside:
            self.plan_again()

    def plan_again(self) -> None:
        """Let go of the path, and plan another one from where the robot is in the next round."""
        self._driver.let_go()
        self._moving_aside = False
        self._giving_way.restore()
        if self._tracker is not None:
            self._tracker.retry_at = -math.inf

    def take_routes(self, routes: Sequence[Route], now: float) -> None:
        """Take in a plan of the traffic planner: the routes of all robots.

        Args:
            routes: They belong to one plan.
            now: The time [s].
        """
        self._keeper.hear(routes, now)

    def tick(self, now: float, pose: Pose, scan: Scan, heard: Neighbourhood) -> Tick:
        """Do one round of the control loop.

        Args:
            now: The time [s].
            pose: Where the robot is, frame map.
            scan: The latest.
            heard: What all robots have announced; its own announcement is ignored.
        """
        self._driver.begin_round(now)
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
            velocity = self._driver.halt()
            self._waits_for = ""
        else:
            obstacles = self._driver.look(pose, scan, near)
            velocity = self._driver.drive(now, pose, obstacles, self._allowed(met, heard))
            outcome = self._arrive(now, pose) or self._wait(now, pose, obstacles, met, heard)
        if outcome is not None:
            self.cancel()
            me, _, _ = self._meet(now, pose, heard)
        if self.path is not None:
            me = me.with_claim(self._driver.claim, self._giving_way.right)
        return Tick(velocity, me, outcome)

    def _take_route(self, now: float, pose: Pose) -> None:
        """Take up a new route of the traffic planner, and drop one that nobody renews."""
        keeper = self._keeper
        if keeper.route is not None and not keeper.is_guided(now):
            keeper.drop()
            self._driver.drop()
        if self.stationary:
            return
        path = keeper.offer(self.goal, pose, self._driver.claimed())
        if path is None or keeper.route is None:
            return
        along = self._along(path)
        if along is not None and self._ends_at_goal == keeper.route.complete:
            keeper.go_on(along)
            return
        self._turns_only = False
        self._ends_at_goal = keeper.route.complete
        goal = self.goal if keeper.route.complete else None
        self._moving_aside = False
        yaw = None if goal is None else goal.yaw
        self._driver.start(path, yaw, settle_from=None)

    def _along(self, path: Path) -> float | None:
        """Return how far along its path a new one begins that goes on with it [m], if one does."""
        if self.path is None or self._moving_aside:
            return None
        progress = self._driver.progress
        begin = path.at(0.0)
        along = self.path.nearest(begin, progress - NEAR, progress + NEAR)
        left = self.path.section(along, self.path.length)
        points = path.section(0.0, path.length)
        same = len(left) == len(points) and all(
            math.dist(*pair) < SAME_PATH for pair in zip(left, points, strict=True)
        )
        return along if same else None

    def _plan_to_goal(self, now: float, pose: Pose, heard: Neighbourhood) -> GoalOutcome | None:
        """Plan to the goal, if there is one and the robot has no path."""
        tracker, awaits_route = self._tracker, self._awaits_route(now)
        if self._turns_only and not awaits_route:
            self._driver.drop()
            self._turns_only = False
        if tracker is None or self.path is not None or now < tracker.retry_at:
            return None
        if not awaits_route:
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
            return None if awaits_route else tracker.attempt_failed(now, str(error))
        self._start(now, points, tracker.goal, turns_only=awaits_route)
        return None

    def _awaits_route(self, now: float) -> bool:
        """Return whether a planner will soon send a route to the goal.

        Meanwhile the robot turns to where it would drive alone.
        """
        return self._keeper.is_guided(now) and now < self._awaits_since + ROUTE_WITHIN

    def _start(
        self, now: float, points: list[Point], goal: Pose | None, *, turns_only: bool = False
    ) -> None:
        """Take a path to a goal; None for a passing place."""
        self._ends_at_goal = False
        self._moving_aside = goal is None
        self._turns_only = turns_only
        yaw = None if goal is None else goal.yaw
        self._driver.start(Path(points), yaw, settle_from=None if turns_only else now)

    def _meet(
        self, now: float, pose: Pose, heard: Neighbourhood
    ) -> tuple[Announcement, list[Announcement], list[Meeting]]:
        """Return the robot's announcement, without a claim, who is near, and how it meets them."""
        me = Announcement(
            name=self._name,
            time=now,
            x=pose.x,
            y=pose.y,
            radius=self._radius,
            right=self._giving_way.right,
            path=self._driver.ahead(pose, self._settings.announce),
            claim=0.0,
            stationary=self.stationary,
            yaw=pose.yaw,
            goal=None if self.goal is None else (self.goal.x, self.goal.y),
            limits=self._driver.limits,
            plan=self._keeper.plan,
            passed=self._keeper.passed,
            waits_for=self._waits_for,
            obstacles=tuple((disc.x, disc.y, disc.radius) for disc in self._memory.discs(now)),
        )
        near = heard.near(me, self._driver.sight, self._settings.silence)
        return me, near, meetings(me, near)

    def _allowed(self, met: Sequence[Meeting], heard: Neighbourhood) -> float:
        """Return how far the route and the right of way let the robot drive on its path [m]."""
        holds = [Hold(meeting.room, meeting.other.name) for meeting in met]
        if self._turns_only:
            holds.append(Hold(0.0, ""))
        if self._keeper.route is not None:
            self._keeper.advance(self._driver.progress)
            holds.append(self._keeper.hold(self._driver.progress, heard))
        first = min(holds, default=Hold(math.inf, ""))
        self._waits_for = first.robot if first.room < AT_HAND else ""
        return first.room

    def _arrive(self, now: float, pose: Pose) -> GoalOutcome | None:
        """Finish a path at whose end the robot stands."""
        route = self._keeper.route
        if not self._driver.arrived or (route is not None and not route.complete):
            return None
        self._driver.drop()
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
        if tracker is None or path is None or self._moving_aside or self._turns_only:
            return None
        guided = self._keeper.route is not None
        if not guided:
            tracker.update(now, path.length - self._driver.progress)
        elif self._stuck.duration(now) < patience:  # a route may lead away from the goal, too
            tracker.note_progress(now)
        if tracker.is_hopeless(now):
            return tracker.given_up(pose, met)
        if self._stuck.duration(now) < patience or now < tracker.retry_at:
            return None
        return self._stand(now, pose, tracker, obstacles, heard)

    def _stand(
        self,
        now: float,
        pose: Pose,
        tracker: GoalTracker,
        obstacles: VisibleObstacles,
        heard: Neighbourhood,
    ) -> GoalOutcome | None:
        """Plan around what keeps the robot standing, where it has no route."""
        guided, patience = self._keeper.route is not None, self._settings.patience
        blocking = self._driver.blocking(obstacles)
        if len(blocking):
            self._memory.add(now, blocking)
            outcome = tracker.blocked(now, pose, blocking)
            if guided:  # the planner hears of the obstacle, and leads around it
                tracker.retry_at = now + patience
            else:
                self._driver.drop()
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


def _is_same(goal: Pose, other: Pose) -> bool:
    near = math.dist(goal[:2], other[:2]) < SAME_GOAL
    return near and abs(angle_between(goal.yaw, other.yaw)) < SAME_YAW
