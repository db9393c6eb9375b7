# SPDX-License-Identifier: BSD-3-Clause
"""The route that a robot has from the traffic planner: what it may drive, and for whom it waits.

A robot takes a new route only if it contains what the robot can no longer avoid, its claim. If
no plan is heard for `SILENCE`, or none that has a route for the robot, it goes on by the right of
way alone; at once if its route has no places.
"""

from __future__ import annotations

import itertools
import math
from typing import TYPE_CHECKING, NamedTuple

from robot_navigation.mapf.route import NO_PLAN
from robot_navigation.planning.path import Path

if TYPE_CHECKING:
    from collections.abc import Sequence

    from hive_common.pose import Pose
    from robot_navigation.mapf.route import PlanNumber, Route
    from robot_navigation.planning.path import Point
    from robot_navigation.traffic.neighbourhood import Neighbourhood

SILENCE = 5.0
"""A robot that hears no plan for itself for so long drops its route [s]. A takeover takes 3 s."""

REACHED = 0.1  # a robot this near before a place has reached it [m]
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
        passed: Number of the last place of it that the robot has reached.
    """

    def __init__(self, name: str) -> None:
        self.route: Route | None = None
        self.passed = 0
        self._name = name
        self._offered: Route | None = None
        self._newest: PlanNumber = NO_PLAN
        self._heard_at = self._guided_at = -math.inf  # any plan, one for this robot [s]
        self._marks: list[float] = []  # on the robot's path, of the places after `passed`

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
        self._marks = []

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
        begin = whole.nearest((pose.x, pose.y), 0.0, NEAR)
        if not all(_is_on(whole, point) for point in [(pose.x, pose.y), *claimed]):
            return None
        marks = _marks(offered.places)
        reached = sum(1 for mark in marks if mark <= begin + REACHED)
        self.route = offered
        self.passed = offered.first + reached - 1
        self._marks = [mark - begin for mark in marks[max(0, reached) :]]
        return Path(whole.section(begin, whole.length))

    def advance(self, progress: float) -> None:
        """Count the places that a robot has reached that is `progress` [m] along its path."""
        while self._marks and self._marks[0] <= progress + REACHED:
            self._marks.pop(0)
            self.passed += 1

    def hold(self, progress: float, heard: Neighbourhood) -> Hold:
        """Return how far a robot that is `progress` [m] along its path may go.

        `heard` is what the others announce.
        """
        nearest = Hold(math.inf, "")
        if self.route is None:
            return nearest
        for wait in self.route.waits:
            other = heard.latest(wait.robot)
            epoch = self.route.plan.epoch
            if other is not None and other.plan.epoch == epoch and other.passed >= wait.passes:
                continue
            ahead = wait.at - self.passed
            if ahead < 0:  # it stands on what is decided no more
                continue
            mark = progress if ahead == 0 else self._marks[ahead - 1]
            if mark - progress < nearest.room:
                nearest = Hold(max(0.0, mark - progress), wait.robot)
        return nearest


def _leads_to(route: Route, goal: Pose | None) -> bool:
    """Return whether a route serves a goal; without a goal it must lead nowhere else."""
    if goal is None or route.goal is None:
        return goal is None and route.goal is None
    return math.dist(goal[:2], route.goal) < SAME_GOAL


def _is_on(path: Path, point: Point) -> bool:
    mark = path.nearest(point, 0.0, NEAR)
    return math.dist(path.at(mark), point) < BESIDE


def _marks(places: Sequence[Point]) -> list[float]:
    """Return the distance of each place from the first, along straight lines [m]."""
    marks = [0.0]
    for before, here in itertools.pairwise(places):
        marks.append(marks[-1] + math.dist(before, here))
    return marks
