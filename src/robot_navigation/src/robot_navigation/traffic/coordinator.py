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

from robot_navigation.mapf.dependency_graph import Course, dependencies
from robot_navigation.mapf.joint_planner import (
    Agent,
    Body,
    JointPlanner,
    PlannerSettings,
    Timetable,
)
from robot_navigation.mapf.path_search import Motion
from robot_navigation.mapf.roadmap import need
from robot_navigation.mapf.roadmap_builder import build_roadmap
from robot_navigation.mapf.route import PlanNumber, Route, Wait
from robot_navigation.mapf.zones import roadmap_with
from robot_navigation.traffic.committed import HELD, Drive, Tracked
from robot_navigation.traffic.ends import Ends, Standing
from robot_navigation.traffic.right_of_way import GAP

if TYPE_CHECKING:
    from collections.abc import Sequence

    from hive_common.zone import Zone
    from robot_navigation.mapf.roadmap import Roadmap
    from robot_navigation.planning.clearance import ClearanceField
    from robot_navigation.planning.path import Point
    from robot_navigation.traffic.committed import Committed
    from robot_navigation.traffic.right_of_way import Announcement


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
        self._ends = Ends(roadmap, self._field)
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
        asked = self._asked(robots, begun, now)
        planned = self._planner.plan(
            [each.agent for each in asked if each.agent is not None],
            [each.before for each in asked if each.agent is not None],
            [each.body for each in asked if each.agent is None],
        )
        timetables = iter(planned)
        tables = [None if each.agent is None else next(timetables) for each in asked]
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

    def _asked(
        self, robots: Sequence[Tracked], begun: Sequence[Committed], now: float
    ) -> list[_Asked]:
        """Return what is asked of the planner for each robot."""
        begins = [
            Standing(start.points[-1], robot.said.radius)
            for robot, start in zip(robots, begun, strict=True)
        ]
        entries: list[Standing] = []
        asked = []
        for number, (robot, start) in enumerate(zip(robots, begun, strict=True)):
            others = [*begins[:number], *begins[number + 1 :], *entries]
            each = self._asked_for(robot, start, others, now)
            if each.agent is not None and start.places[-1] < 0:
                entries.append(Standing(self._point(each.agent.start), robot.said.radius))
            asked.append(each)
        return asked

    def _asked_for(
        self, robot: Tracked, begun: Committed, others: Sequence[Standing], now: float
    ) -> _Asked:
        """Return what is asked of the planner for a robot; `others` are where the others begin."""
        said = robot.said
        goal = None if said.goal is None else self._ends.exit(said.goal, said.radius)
        start = None
        leads = said.goal is None or goal is not None
        if robot.is_planned(now) and not said.stationary and leads:
            start = self._start(robot, begun, goal, others, now)
        arrives = said.goal is not None and (
            begun.points[-1] == said.goal or (start is not None and start == goal)
        )
        if start is None or arrives:
            rest = [said.goal] if arrives and said.goal is not None else []
            track = _track(said, [*begun.points[1:], *rest], math.inf)
            return _Asked(None, None, Body(said.radius, track), arrives)
        joins = [] if begun.places[-1] >= 0 else [self._point(start)]
        track = _track(said, [*begun.points[1:], *joins])
        ready = track[-1][2]
        agent = Agent(
            start=start,
            ready=ready,
            heading=_heading(begun, said),
            goal=start if goal is None else goal,
            radius=said.radius,
            speed=said.limits.speed,
            acceleration=said.limits.acceleration,
            yaw_rate=said.limits.yaw_rate,
            priority=said.right.since,
            body=track,
            end=said.goal,
        )
        before = _later(begun.rest, start, ready, said.goal)
        return _Asked(agent, before, Body(said.radius, track), arrives)

    def _start(
        self,
        robot: Tracked,
        begun: Committed,
        goal: int | None,
        others: Sequence[Standing],
        now: float,
    ) -> int | None:
        """Return the place from which a robot is planned; None if it can go to none."""
        if begun.places[-1] >= 0:
            return begun.places[-1]
        said, rest = robot.said, begun.rest
        keep = None
        if rest is not None and rest.places[0] < 0 and now - robot.stands_since < HELD:
            keep = next((place for place in rest.places if place >= 0), None)
        motion = Motion(said.radius, *said.limits)
        times = None if goal is None else self._planner.times_to(goal, motion)
        return self._ends.entry(begun.points[-1], motion, times, others, keep)

    def _drive(
        self,
        robot: Tracked,
        begun: Committed,
        asked: _Asked,
        table: Timetable | None,
        plan: PlanNumber,
        now: float,
    ) -> Drive:
        """Return the course of a robot: what is decided already, the timetable, and its goal."""
        said = robot.said
        known = len(begun.points)
        points, places = list(begun.points), list(begun.places)
        arrives = [now + when for _, _, when in asked.body.track[:known]]
        leaves = list(arrives)
        complete = asked.arrives
        if table is not None:
            complete = table.complete
            skip = 1 if begun.places[-1] >= 0 else 0
            if skip:
                leaves[-1] = now + table.leaves[0]
            points += [self._point(place) for place in table.places[skip:]]
            places += table.places[skip:]
            arrives += [now + when for when in table.arrives[skip:]]
            leaves += [now + when for when in table.leaves[skip:]]
        if complete and said.goal is not None and points[-1] != said.goal:
            leaves[-1] = arrives[-1]
            points.append(said.goal)
            places.append(-1)
            leg = math.dist(points[-2], said.goal)
            arrives.append(arrives[-1] + leg / said.limits.speed)
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


class _Asked(NamedTuple):
    agent: Agent | None  # None for a robot that is not planned
    before: Timetable | None
    body: Body
    arrives: bool  # only its goal is left


def _track(
    said: Announcement, points: Sequence[Point], until: float | None = None
) -> tuple[tuple[float, float, float], ...]:
    """Return where a robot is when on its way through some points; see `Body`.

    It stays at the last one until some time [s], or drives on at once.
    """
    track = [(said.x, said.y, 0.0)]
    for x, y in points:
        leg = math.dist(track[-1][:2], (x, y))
        track.append((x, y, track[-1][2] + leg / said.limits.speed))
    if until is not None:
        track.append((*track[-1][:2], until))
    return tuple(track)


def _heading(begun: Committed, said: Announcement) -> float:
    """Return the heading with which a robot comes to the end of what is decided [rad]."""
    if len(begun.points) < 2 or begun.ahead == 0.0:  # noqa: PLR2004  (a line has two ends)
        return said.yaw
    (ax, ay), (bx, by) = begun.points[-2:]
    return math.atan2(by - ay, bx - ax)


def _later(rest: Drive | None, start: int, ready: float, goal: Point | None) -> Timetable | None:
    """Return the rest of a course to a goal from a place on, reached `ready` from now [s]."""
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
