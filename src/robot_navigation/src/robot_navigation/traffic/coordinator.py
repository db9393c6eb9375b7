# SPDX-License-Identifier: BSD-3-Clause
"""The traffic planner: it plans for all robots jointly, and gives each one its route.

It knows only what robots announce, and the courses that it gave them. One that takes over in a
later epoch begins with the stretches that the robots claim.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from scipy.spatial import cKDTree

from robot_navigation.mapf.dependency_graph import Course, dependencies
from robot_navigation.mapf.ends import nearest_places
from robot_navigation.mapf.joint_planner import Agent, JointPlanner, PlannerSettings, Timetable
from robot_navigation.mapf.path_search import Motion
from robot_navigation.mapf.roadmap import need
from robot_navigation.mapf.roadmap_builder import build_roadmap
from robot_navigation.mapf.route import PlanNumber, Route, Wait
from robot_navigation.mapf.segments import segments_near
from robot_navigation.mapf.zones import roadmap_with
from robot_navigation.traffic.committed import HELD, STANDS, Drive, Tracked
from robot_navigation.traffic.right_of_way import GAP

if TYPE_CHECKING:
    from collections.abc import Sequence

    from hive_common.geometry import Indices
    from hive_common.zone import Zone
    from robot_navigation.mapf.roadmap import Roadmap
    from robot_navigation.planning.clearance import ClearanceField
    from robot_navigation.planning.path import Point
    from robot_navigation.traffic.committed import Committed
    from robot_navigation.traffic.right_of_way import Announcement

MOST_EXITS = 10_000  # goals whose nearest places are remembered
ENTRIES = 8  # places that are looked at for a robot that is off the roadmap
BLOCKED = 60.0  # what it costs if another robot stands on the way to such a place [s]


@dataclass(frozen=True)
class CoordinatorSettings:
    """How often the coordinator plans.

    Attributes:
        period: Between two plans while nothing new happens [s].
        soonest: Between two plans at least [s].
        forget: A robot that is silent for so long is no longer planned with [s].
    """

    period: float = 1.0
    soonest: float = 0.2
    forget: float = 30.0


class Waiting(NamedTuple):
    """A robot that waits for another one."""

    robot: str
    waits_for: str
    at: Point  # frame map [m]
    since: float  # [s]


class Coordinator:
    """Plans for all robots that are heard.

    Args:
        field: Clearances of the map.
        radii: Of the fleet's robots: circles around their footprints [m].
        zones: What the operator has set.
        epoch: Of the blackboard that it belongs to.
        settings: How often it plans.
    """

    def __init__(
        self,
        field: ClearanceField,
        radii: Sequence[float],
        zones: Sequence[Zone] = (),
        epoch: int = 1,
        settings: CoordinatorSettings | None = None,
    ) -> None:
        self._field = field
        self._epoch = epoch
        self._settings = settings or CoordinatorSettings()
        self._robots: dict[str, Tracked] = {}
        self._number = 0
        self._planned_at = -math.inf
        self._take_roadmap(build_roadmap(field, radii, zones))

    def _take_roadmap(self, roadmap: Roadmap) -> None:
        self.roadmap = roadmap
        self._planner = JointPlanner(roadmap, PlannerSettings(gap=GAP))
        self._places = cKDTree(roadmap.places)
        self._exits: dict[tuple[Point, float], int | None] = {}
        self._planned_at = -math.inf
        for robot in self._robots.values():
            robot.drive = None  # its places have other numbers now

    def close(self, name: str) -> None:
        """Close a zone: no robot enters it any more."""
        self._take_roadmap(roadmap_with(self.roadmap, self.roadmap.closed | {name}))

    def open(self, name: str) -> None:
        """Open a zone that was closed."""
        self._take_roadmap(roadmap_with(self.roadmap, self.roadmap.closed - {name}))

    def hear(self, said: Announcement) -> None:
        """Take in what a robot announces."""
        known = self._robots.get(said.name)
        if known is None:
            self._robots[said.name] = Tracked(said)
        else:
            known.hear(said)

    def step(self, now: float) -> tuple[Route, ...]:
        """Return a new plan, the routes of all robots, if one is due; else nothing.

        Args:
            now: The time [s].
        """
        since = now - self._planned_at
        if since < self._settings.soonest:
            return ()
        if since < self._settings.period and not any(map(self._needs_plan, self._robots.values())):
            return ()
        self._planned_at = now
        self._number += 1
        for name, robot in list(self._robots.items()):
            if now - robot.said.time > self._settings.forget:
                del self._robots[name]
        return self._plan(now)

    def waiting(self) -> list[Waiting]:
        """Return who waits for whom."""
        return [
            Waiting(name, robot.said.waits_for, (robot.said.x, robot.said.y), robot.stands_since)
            for name, robot in self._robots.items()
            if robot.said.waits_for
        ]

    def _needs_plan(self, robot: Tracked) -> bool:
        """Return whether a robot has a goal to which its course does not lead."""
        said, drive = robot.said, robot.drive
        if drive is None:
            return True
        end = drive.points[-1] if drive.complete else None
        return said.goal is not None and said.goal not in {drive.goal, end}

    def _plan(self, now: float) -> tuple[Route, ...]:
        robots = list(self._robots.values())
        begun = [robot.committed(now) for robot in robots]
        asked = [
            self._asked(robot, start, now) for robot, start in zip(robots, begun, strict=True)
        ]
        tables = self._planner.plan(
            [each.agent for each in asked], [each.before for each in asked]
        )
        plan = PlanNumber(self._epoch, self._number)
        drives = [
            self._drive(robot, start, each, table, plan, now)
            for robot, start, each, table in zip(robots, begun, asked, tables, strict=True)
        ]
        for robot, drive in zip(robots, drives, strict=True):
            robot.give(drive)
        waits = self._waits(robots, begun, drives, now)
        return tuple(
            Route(
                robot=robot.said.name,
                plan=plan,
                goal=robot.said.goal,
                first=drive.first,
                places=drive.points,
                waits=tuple(waiting),
                complete=drive.complete,
            )
            for robot, drive, waiting in zip(robots, drives, waits, strict=True)
        )

    def _asked(self, robot: Tracked, begun: Committed, now: float) -> _Asked:
        """Return what is asked of the planner for a robot."""
        said, speed = robot.said, robot.said.limits.speed
        end = begun.points[-1]
        goal = None if said.goal is None else self._exit(said.goal, said.radius)
        start = self._start(robot, begun, goal, now)
        stays = (
            start is None
            or said.stationary
            or not robot.is_planned(now)
            or (said.goal is not None and goal is None)
        )
        if start is None:
            start = int(self._places.query(end)[1])
        arrives = not stays and said.goal is not None and (start == goal or end == said.goal)
        stays = stays or arrives
        before = None
        ready = begun.ahead / speed
        if not stays:
            if begun.places[-1] < 0:
                ready += math.dist(end, self._point(start)) / speed
            before = _later(begun.rest, start, ready, said.goal)
        agent = Agent(
            start=start,
            ready=ready,
            heading=_heading(begun, said),
            goal=start if goal is None or stays else goal,
            radius=said.radius,
            speed=speed,
            acceleration=said.limits.acceleration,
            yaw_rate=said.limits.yaw_rate,
            priority=said.right.since,
            stays=stays,
            body=self._body(said, begun, None if stays else start, ready, arrives=arrives),
            end=said.goal,
        )
        return _Asked(agent, before, arrives)

    def _body(
        self,
        said: Announcement,
        begun: Committed,
        start: int | None,
        ready: float,
        *,
        arrives: bool,
    ) -> tuple[tuple[float, float, float], ...]:
        """Return where a robot is until it is at its start; see `Agent`.

        One that has no start stays at the end of what is decided, or at its goal if it `arrives`.
        """
        points = list(begun.points[1:])
        if arrives and said.goal is not None:
            points.append(said.goal)
        if start is not None and begun.places[-1] < 0:
            points.append(self._point(start))
        body = [(said.x, said.y, 0.0)]
        for x, y in points:
            leg = math.dist(body[-1][:2], (x, y))
            body.append((x, y, body[-1][2] + leg / said.limits.speed))
        until = math.inf if start is None else ready
        body = [(x, y, min(when, until)) for x, y, when in body]
        return (*body, (*body[-1][:2], until))

    def _drive(
        self,
        robot: Tracked,
        begun: Committed,
        asked: _Asked,
        table: Timetable,
        plan: PlanNumber,
        now: float,
    ) -> Drive:
        """Return the course of a robot: what is decided already, the timetable, and its goal."""
        said, agent = robot.said, asked.agent
        known = len(begun.points)
        pace = agent.ready / max(1, known - 1)
        points, places = list(begun.points), list(begun.places)
        arrives = [now + pace * index for index in range(known)]
        leaves = list(arrives)
        skip = 1 if begun.places[-1] >= 0 else 0
        if agent.stays:
            skip = len(table.places)
        leaves[-1] = now + table.leaves[0] if skip == 1 else leaves[-1]
        for index in range(skip, len(table.places)):
            points.append(self._point(table.places[index]))
            places.append(table.places[index])
            arrives.append(now + table.arrives[index])
            leaves.append(now + table.leaves[index])
        complete = asked.arrives or (table.complete and not agent.stays)
        if complete and said.goal is not None and points[-1] != said.goal:
            leaves[-1] = arrives[-1]
            points.append(said.goal)
            places.append(-1)
            arrives.append(arrives[-1] + math.dist(points[-2], said.goal) / agent.speed)
            leaves.append(math.inf)
        leaves[-1] = math.inf
        for index in (known, len(points) - 2):
            if known - 1 < index < len(points) - 1 and self._is_detour(
                points, places, index, said.radius
            ):
                for each in (points, places, arrives, leaves):
                    del each[index]
        return Drive(
            plan=plan,
            given=now,
            first=begun.first,
            points=tuple(points),
            places=tuple(places),
            arrives=tuple(arrives),
            leaves=tuple(leaves),
            complete=complete,
            goal=said.goal,
        )

    def _is_detour(
        self, points: Sequence[Point], places: Sequence[int], index: int, radius: float
    ) -> bool:
        """Return whether a robot can leave out a place between the roadmap and a point off it."""
        if places[index - 1] >= 0 and places[index + 1] >= 0:
            return False
        return self._field.line_is_clear(points[index - 1], points[index + 1], need(radius))

    def _waits(
        self,
        robots: Sequence[Tracked],
        begun: Sequence[Committed],
        drives: Sequence[Drive],
        now: float,
    ) -> list[list[Wait]]:
        """Return for each robot whom it lets pass first."""
        courses = [
            Course(
                np.array(drive.points),
                np.array([*drive.leaves[:-1], drive.arrives[-1]]),
                robot.said.radius,
            )
            for robot, drive in zip(robots, drives, strict=True)
        ]
        waits: list[list[Wait]] = [[] for _ in robots]
        for me, mine, other, its in dependencies(courses, GAP).tolist():
            if mine < len(begun[me].points) - 1:
                continue  # It cannot avoid this any more; the claims keep them apart.
            if not robots[other].is_planned(now):
                continue  # Nobody knows when it goes on; the claims keep them apart.
            waits[me].append(
                Wait(
                    at=drives[me].first + mine,
                    robot=robots[other].said.name,
                    passes=drives[other].first + its + 1,
                )
            )
        return waits

    def _point(self, place: int) -> Point:
        x, y = self.roadmap.places[place]
        return float(x), float(y)

    def _start(self, robot: Tracked, begun: Committed, goal: int | None, now: float) -> int | None:
        """Return the place from which a robot is planned; None if it can go to none."""
        if begun.places[-1] >= 0:
            return begun.places[-1]
        said, here, rest = robot.said, begun.points[-1], begun.rest
        if rest is not None and rest.places[0] < 0 and now - robot.stands_since < HELD:
            onward = next((place for place in rest.places if place >= 0), -1)
            if onward >= 0:
                return onward
        found = self._reached(here, said.radius, ENTRIES)
        if not len(found):
            return None
        legs = np.hypot(*(self.roadmap.places[found] - here).T)
        costs = legs / said.limits.speed
        if goal is not None:
            costs = costs + self._planner.times_to(goal, Motion(said.radius, *said.limits))[found]
        blocked = [self._is_blocked(said, here, self._point(int(place))) for place in found]
        return int(found[np.argmin(costs + BLOCKED * np.array(blocked))])

    def _is_blocked(self, said: Announcement, here: Point, there: Point) -> bool:
        """Return whether another robot stands where one would go."""
        for name, other in self._robots.items():
            if name == said.name or other.claim >= STANDS:
                continue
            body = (other.said.x, other.said.y)
            apart = said.radius + other.said.radius + GAP
            near = segments_near(
                np.array([here]),
                np.array([there]),
                np.array([body]),
                min(apart, math.dist(here, body)),
            )
            if len(near):
                return True
        return False

    def _exit(self, point: Point, radius: float) -> int | None:
        """Return the place from which a robot goes straight to its goal; None if there is none."""
        key = (point, radius)
        if key not in self._exits:
            if len(self._exits) > MOST_EXITS:
                self._exits.clear()
            found = self._reached(point, radius, 1)
            self._exits[key] = int(found[0]) if len(found) else None
        return self._exits[key]

    def _reached(self, point: Point, radius: float, most: int) -> Indices:
        """Return the places nearest to a point to which a robot can go straight."""
        found = nearest_places(
            self.roadmap, self._field, np.array([point]), np.array([radius]), most
        )[0]
        return found[found >= 0]


class _Asked(NamedTuple):
    agent: Agent
    before: Timetable | None
    arrives: bool  # only its goal is left


def _heading(begun: Committed, said: Announcement) -> float:
    """Return the heading with which a robot comes to the end of what is decided [rad]."""
    if len(begun.points) < 2 or begun.ahead == 0.0:  # noqa: PLR2004  (a line has two ends)
        return said.yaw
    (ax, ay), (bx, by) = begun.points[-2:]
    return math.atan2(by - ay, bx - ax)


def _later(rest: Drive | None, start: int, ready: float, goal: Point | None) -> Timetable | None:
    """Return the rest of a course to a goal, from a place on that is reached `ready` from now [s]."""
    if rest is None or rest.goal != goal or start not in rest.places:
        return None
    first = rest.places.index(start)
    end = first
    while end < len(rest.places) and rest.places[end] >= 0:
        end += 1
    delay = ready - rest.arrives[first]
    return Timetable(
        places=rest.places[first:end],
        arrives=tuple(time + delay for time in rest.arrives[first:end]),
        leaves=(*(time + delay for time in rest.leaves[first : end - 1]), math.inf),
        complete=rest.complete,
    )
