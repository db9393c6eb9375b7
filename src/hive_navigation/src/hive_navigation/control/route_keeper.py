# SPDX-License-Identifier: BSD-3-Clause
"""The route that a robot has from the traffic planner: what it may drive, and for whom it waits.

A robot takes a new route only if it contains what the robot can no longer avoid, its claim. If
no plan is heard for `SILENCE`, or none that has a route for the robot, it goes on by the right of
way alone; at once if its route has no places.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, NamedTuple

from hive_navigation.mapf.route import NO_PLAN, PER_METRE
from hive_navigation.planning.path import Path

if TYPE_CHECKING:
    from collections.abc import Sequence

    from hive_common.pose import Pose
    from hive_navigation.mapf.route import PlanNumber, Route
    from hive_navigation.planning.path import Point
    from hive_navigation.traffic.neighbourhood import Neighbourhood

SILENCE = 5.0
"""A robot that hears no plan for itself for so long drops its route [s]. A takeover takes 3 s."""

REACHED = 0.1  # a robot this near before a mark has come to it [m]
BESIDE = 0.15  # how far off its path a robot may be, and a claim off a new route [m]
SAME_GOAL = 0.01  # [m]
NEAR = 6.0  # a robot is on this stretch of a new route, which may come by again later [m]


class Hold(NamedTuple):
    """Where a robot must wait on its path, and for whom; nobody is an empty name."""

    room: float  # how far it may go [m]
    robot: str


class RouteKeeper:
    """The route of one robot.

    Attributes:
        route: The route that the robot follows; None without one.
        passed: The mark that the robot has come to; see `Route`.
    """

    def __init__(self, name: str) -> None:
        self.route: Route | None = None
        self.passed = 0
        self._name = name
        self._offered: Route | None = None
        self._newest: PlanNumber = NO_PLAN
        self._heard_at = self._guided_at = -math.inf  # any plan, one for this robot [s]
        self._begin = 0  # the mark at which the robot's path begins

    @property
    def plan(self) -> PlanNumber:
        """The plan of the route that the robot follows."""
        return NO_PLAN if self.route is None else self.route.plan

    def hear(self, routes: Sequence[Route], now: float) -> None:
        """Take in a plan, the routes of all robots, unless a newer one is known.

        A hive that was bootstrapped again counts its plans from the beginning. So once the newest
        plan was followed by `SILENCE`, a lesser number counts as newer.
        """
        newest = max((route.plan for route in routes), default=NO_PLAN)
        is_late = newest < self._newest and now - self._heard_at < SILENCE
        if newest in {NO_PLAN, self._newest} or is_late:
            return
        self._newest, self._heard_at = newest, now
        own = next((route for route in routes if route.robot == self._name), None)
        if own is not None:
            self._guided_at = now if own.places else -math.inf
        self._offered = own if own is not None and own.places else None

    def is_guided(self, now: float) -> bool:
        """Return whether a planner has lately planned for this robot."""
        return now - self._guided_at < SILENCE

    def drop(self) -> None:
        """Follow no route any more."""
        self.route = None

    def offer(self, goal: Pose | None, pose: Pose, claimed: Sequence[Point]) -> Path | None:
        """Take the newest route, if there is one that the robot can take.

        Args:
            goal: The robot's goal, frame map; None without one.
            pose: Where the robot is, frame map.
            claimed: The stretch of its path that it can no longer avoid, frame map [m].

        Returns:
            The path to drive from where the robot is now; None if it goes on as before.
        """
        offered, self._offered = self._offered, None
        if offered is None or not _leads_to(offered, goal):
            return None
        whole = Path(offered.places)
        begin = whole.nearest((pose.x, pose.y), *self._stretch(offered, whole.length))
        if math.dist(whole.at(begin), pose[:2]) > BESIDE:
            return None
        if not all(_is_on(whole, point, begin) for point in claimed):
            return None
        self.route = offered
        self._begin = self.passed = offered.first + round(PER_METRE * begin)
        return Path(whole.section(begin, whole.length))

    def go_on(self, progress: float) -> None:
        """Take the new route as what is left, `progress` [m] along it, of the robot's path."""
        self._begin -= round(PER_METRE * progress)

    def _stretch(self, offered: Route, length: float) -> tuple[float, float]:
        """Return from where to where on a new route the robot is [m].

        A route may pass a place twice, so what the robot has driven counts.
        """
        if self.route is None or self.plan.epoch != offered.plan.epoch:
            return 0.0, min(NEAR, length)
        driven = (self.passed - offered.first) / PER_METRE
        low = min(max(0.0, driven - BESIDE), length)
        return low, min(max(driven, 0.0) + BESIDE, length)

    def advance(self, progress: float) -> None:
        """Note that a robot is `progress` [m] along its path."""
        self.passed = max(self.passed, self._begin + round(PER_METRE * progress))

    def hold(self, progress: float, heard: Neighbourhood) -> Hold:
        """Return how far a robot that is `progress` [m] along its path may go.

        `heard` is what the others announce.
        """
        nearest = Hold(math.inf, "")
        if self.route is None:
            return nearest
        epoch = self.route.plan.epoch
        for wait in self.route.waits:
            other = heard.latest(wait.robot)
            reached = wait.passes - REACHED * PER_METRE
            if other is not None and other.plan.epoch == epoch and other.reaches >= reached:
                continue
            room = (wait.at - self._begin) / PER_METRE - progress
            if room < -BESIDE:  # it has entered already, and blocks the way if it stops
                continue
            if room < nearest.room:
                nearest = Hold(max(0.0, room), wait.robot)
        return nearest


def _leads_to(route: Route, goal: Pose | None) -> bool:
    """Return whether a route serves a goal; without a goal it must lead nowhere else."""
    if goal is None or route.goal is None:
        return goal is None and route.goal is None
    return math.dist(goal[:2], route.goal) < SAME_GOAL


def _is_on(path: Path, point: Point, begin: float) -> bool:
    mark = path.nearest(point, begin, begin + NEAR)
    return math.dist(path.at(mark), point) < BESIDE
