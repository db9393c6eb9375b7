# SPDX-License-Identifier: BSD-3-Clause
"""The traffic planner: it plans for all robots jointly, and gives each one its route.

It knows only what robots announce, and the courses that it gave them. One that takes over in a
later epoch begins with the stretches that the robots claim.
"""

from __future__ import annotations

import itertools
import math
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from shapely.geometry import LineString

from hive_navigation.mapf.bodies import Body
from hive_navigation.mapf.coupled import REACH
from hive_navigation.mapf.ends import joined_ends
from hive_navigation.mapf.joint_planner import (
    Agent,
    JointPlanner,
    PlannerSettings,
    Timetable,
)
from hive_navigation.mapf.path_search import Motion
from hive_navigation.mapf.route import PlanNumber, Route, marks
from hive_navigation.mapf.zones import roadmap_with
from hive_navigation.traffic.committed import Drive, Tracked
from hive_navigation.traffic.retiming import STAYS, Course, Times, retime
from hive_navigation.traffic.right_of_way import GAP
from hive_navigation.traffic.waits import Part, waits_of

if TYPE_CHECKING:
    from collections.abc import Collection, Iterable, Mapping, Sequence

    from hive_common.geometry import Array
    from hive_navigation.mapf.ends import Ends
    from hive_navigation.mapf.roadmap import Roadmap
    from hive_navigation.planning.clearance import ClearanceField
    from hive_navigation.planning.path import Point
    from hive_navigation.traffic.committed import Committed
    from hive_navigation.traffic.right_of_way import Announcement

BACK = math.radians(150)  # a robot that turns by more goes back [rad]
PATIENCE = 40.0  # so old a goal is planned for without trust that others leave theirs [s]
IMPROVEMENTS = 60  # parts of a plan that are made anew each time
REST = 3.0  # a search for a group that found nothing is not made again for so long [s]
GAIN = 2.0  # by how much they have to get shorter, so that robots keep their paths [s]
SHORT = 0.1  # a way that is not worth driving [m]
STRAIGHT = 0.01  # so far beside a line is on it [m]
PASSED = 100  # a robot this near before a mark has come to it [mm]


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
        roadmap: Made from it for all sizes of the fleet, with what the operator has set.
        epoch: Of the blackboard that it belongs to.
        settings: How often it plans.
    """

    def __init__(
        self,
        field: ClearanceField,
        roadmap: Roadmap,
        epoch: int = 1,
        settings: CoordinatorSettings | None = None,
    ) -> None:
        self._field = field
        self._epoch = epoch
        self._settings = settings or CoordinatorSettings()
        self._robots: dict[str, Tracked] = {}
        self._number = 0
        self._planned_at = -math.inf
        self._groups: list[dict[str, Point | None]] = []
        self._search_from = -math.inf
        self._take_roadmap(roadmap)

    def _take_roadmap(self, roadmap: Roadmap) -> None:
        self.roadmap = roadmap
        self._planner = JointPlanner(
            roadmap, PlannerSettings(gap=GAP, improvements=IMPROVEMENTS, gain=GAIN, straight=True)
        )
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

    def plan_together(self, robots: Collection[str]) -> None:
        """Plan some robots in one search from now on, until each has left its present goal."""
        near = [group for group in self._groups if self._are_near(group, robots)]
        names = {*robots}.union(*near) & self._robots.keys()
        self._join(names)
        self._search_from = -math.inf
        self.plan_anew(names)

    def _join(self, robots: Iterable[str]) -> None:
        """Make one group of some robots, and of the groups that they are in."""
        joined = [group for group in self._groups if not group.keys().isdisjoint(robots)]
        self._groups = [group for group in self._groups if group not in joined]
        group = {name: self._robots[name].said.goal for name in sorted(robots)}
        for each in joined:
            group |= each
        self._groups.append(group)

    def _are_near(self, some: Iterable[str], others: Iterable[str]) -> bool:
        """Return whether one of some robots is near one of others."""
        one, two = (
            [(r.said.x, r.said.y) for name in names if (r := self._robots.get(name)) is not None]
            for names in (some, others)
        )
        return any(math.dist(a, b) <= REACH for a in one for b in two)

    def plan_anew(self, robots: Iterable[str]) -> None:
        """Forget the courses of robots, so that the next plan begins with what they claim."""
        for name in robots:
            known = self._robots.get(name)
            if known is not None:
                known.drive = None
                self._planned_at = -math.inf

    def plan_apart(self, robots: Collection[str]) -> None:
        """Plan robots one after the other from now on, and all with which they were together."""
        self._groups = [group for group in self._groups if group.keys().isdisjoint(robots)]

    def groups(self) -> tuple[frozenset[str], ...]:
        """Return who of each group that is planned in one search is on the way to its goal yet."""
        return tuple(_under_way(group, self._robots) for group in self._groups)

    def _together(self, numbers: Mapping[str, int], now: float) -> list[list[int]]:
        """Return the groups that are planned in one search now, by the robots' numbers."""
        self._groups = [group for group in self._groups if _under_way(group, self._robots)]
        if now < self._search_from:
            return []
        return [[numbers[name] for name in group if name in numbers] for group in self._groups]

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
        begun = [robot.committed(now, self._held(robot)) for robot in robots]
        ends, starts, goals = self._ends(robots, begun, now)
        asked = [
            self._asked(robot, start, from_, to, now)
            for robot, start, from_, to in zip(robots, begun, starts, goals, strict=True)
        ]
        before = self._before(robots, begun, asked)
        names = [robot.said.name for robot, each in zip(robots, asked, strict=True) if each.agent]
        together = self._together({name: number for number, name in enumerate(names)}, now)
        planned = self._planner.plan(
            [each.agent for each in asked if each.agent is not None],
            [table for each, table in zip(asked, before, strict=True) if each.agent is not None],
            [each.body for each in asked if each.agent is None] + self._obstacles(),
            ends,
            together,
        )
        if any(together) and not self._planner.coupled:
            self._search_from = now + REST
        for robots_ in self._planner.coupled:
            self._join([names[number] for number in robots_])
        timetables = iter(planned)
        tables = [None if each.agent is None else next(timetables) for each in asked]
        plan = PlanNumber(self._epoch, self._number)
        places = np.vstack([self.roadmap.places, ends.points])
        drives = [
            self._drive(robot, start, each, table, plan, places, now)
            for robot, start, each, table in zip(robots, begun, asked, tables, strict=True)
        ]
        parts = [
            Part(robot.said.name, robot.said.radius, drive, len(start.points) - 1, planned)
            for robot, start, drive in zip(robots, begun, drives, strict=True)
            for planned in (robot.is_planned(now),)
        ]
        open_ = [zone for zone in self.roadmap.zones if zone.name not in self.roadmap.closed]
        for robot, drive, waits in zip(robots, drives, waits_of(parts, open_), strict=True):
            robot.give(replace(drive, waits=waits))
        return tuple(_route(robot.said, robot.drive) for robot in robots if robot.drive)

    def _obstacles(self) -> list[Body]:
        """Return what robots have seen in their way; they forget it by themselves after a time."""
        seen = {each for robot in self._robots.values() for each in robot.said.obstacles}
        return [Body(radius, ((x, y, math.inf),)) for x, y, radius in sorted(seen)]

    def _held(self, robot: Tracked) -> float:
        """Return the mark at which a robot has to wait now; infinite if at none."""
        if robot.drive is None:
            return math.inf
        return min(
            (
                wait.at
                for wait in robot.drive.waits
                if (other := self._robots.get(wait.robot)) is not None
                and other.said.reaches < wait.passes - PASSED
            ),
            default=math.inf,
        )

    def _before(
        self, robots: Sequence[Tracked], begun: Sequence[Committed], asked: Sequence[_Asked]
    ) -> list[Timetable | None]:
        """Return what is left of the last plan for each robot, with the times as they are now."""
        courses, clears = {}, {}
        for robot, start, each in zip(robots, begun, asked, strict=True):
            rest, agent, said = start.rest, each.agent, robot.said
            if rest is not None and rest.goal == said.goal and (agent or each.arrives):
                motion = Motion(said.radius, *said.limits)
                ready = agent.ready if agent else each.body.track[-2][2]
                courses[said.name] = Course(rest, ready, _heading(start, said), motion)
            elif agent is not None:
                clears[said.name] = agent.ready + STAYS
        retimed = retime(courses, clears)
        count = len(self.roadmap.places)
        return [
            None
            if (times := retimed.get(robot.said.name)) is None or each.agent is None
            else _timetable(courses[robot.said.name].rest, times, each.agent, count)
            for robot, each in zip(robots, asked, strict=True)
        ]

    def _ends(
        self, robots: Sequence[Tracked], begun: Sequence[Committed], now: float
    ) -> tuple[Ends, list[int], list[int]]:
        """Return the ends of a plan, and the places at which each robot begins and ends.

        A place is -1 for a robot that is not planned, and for one without a goal.
        """
        points: list[Point] = []
        radii: list[float] = []
        direct: list[tuple[int, int]] = []
        own: list[int] = []  # rows of points
        begins: list[int] = []  # rows of points
        rows: list[tuple[int, int]] = []
        crowded = _crowded(robots, begun)
        for number, (robot, start) in enumerate(zip(robots, begun, strict=True)):
            said = robot.said
            if not robot.is_planned(now) or said.stationary or start.points[-1] == said.goal:
                rows.append((-1, -1))
                continue
            from_ = to = -1
            if start.places[-1] < 0 or crowded[number]:
                from_ = len(points)
                begins.append(from_)
                points.append(start.points[-1])
                if crowded[number]:
                    own.append(from_)
            if said.goal is not None:
                to = len(points)
                points.append(said.goal)
                if from_ >= 0:
                    direct.append((from_, to))
            radii += [said.radius] * (len(points) - len(radii))
            rows.append((from_, to))
        ends = joined_ends(
            self.roadmap, self._field, np.array(points), np.array(radii), direct, own, begins
        )
        reached = {*range(len(self.roadmap.places)), *ends.legs[:, 1].tolist()}
        starts, goals = [], []
        for (from_, to), robot, start in zip(rows, robots, begun, strict=True):
            goal = -1 if to < 0 else int(ends.index[to])
            place = start.places[-1] if from_ < 0 else int(ends.index[from_])
            planned = robot.is_planned(now) and not robot.said.stationary
            leads = to < 0 or goal in reached
            arrives = start.points[-1] == robot.said.goal
            starts.append(place if planned and leads and not arrives else -1)
            goals.append(goal)
        return ends, starts, goals

    def _asked(
        self, robot: Tracked, begun: Committed, start: int, goal: int, now: float
    ) -> _Asked:
        """Return what is asked of the planner for a robot.

        Args:
            robot: The robot.
            begun: What is decided already.
            start: The place at which that ends; -1 if the robot is not planned.
            goal: The place of its goal; -1 without one.
            now: The time [s].
        """
        said = robot.said
        arrives = begun.points[-1] == said.goal
        if start < 0:
            stays = math.inf
            if arrives and robot.is_planned(now) and not said.stationary:
                stays = STAYS
            track = _track(said, begun, stays)
            return _Asked(None, Body(said.radius, track), arrives)
        track = _track(said, begun)
        ready = track[-1][2]
        agent = Agent(
            start=start,
            ready=ready,
            heading=_heading(begun, said),
            goal=start if goal < 0 else goal,
            radius=said.radius,
            speed=said.limits.speed,
            acceleration=said.limits.acceleration,
            yaw_rate=said.limits.yaw_rate,
            priority=said.right.since,
            dwell=STAYS if now < said.right.since + PATIENCE else math.inf,
            body=track,
        )
        return _Asked(agent, Body(said.radius, track), arrives)

    def _drive(
        self,
        robot: Tracked,
        begun: Committed,
        asked: _Asked,
        table: Timetable | None,
        plan: PlanNumber,
        where: Array,
        now: float,
    ) -> Drive:
        """Return the course of a robot: what is decided already, and the timetable.

        `where` (n + e, 2) are all places of the plan, frame map [m].
        """
        said = robot.said
        known = len(begun.points)
        points, places = list(begun.points), list(begun.places)
        arrives = [now + when for _, _, when in asked.body.track[:known]]
        leaves = list(arrives)
        complete = asked.arrives
        if table is not None:
            complete = table.complete and said.goal is not None
            leaves[-1] = now + table.leaves[0]
            points += [(float(x), float(y)) for x, y in where[list(table.places[1:])]]
            roadmap = len(self.roadmap.places)
            places += [place if place < roadmap else -1 for place in table.places[1:]]
            arrives += [now + when for when in table.arrives[1:]]
            leaves += [now + when for when in table.leaves[1:]]
        leaves[-1] = math.inf
        return Drive(
            plan=plan,
            given=now,
            marks=marks(begun.first, points),
            points=tuple(points),
            places=tuple(places),
            arrives=tuple(arrives),
            leaves=tuple(leaves),
            complete=complete,
            goal=said.goal,
            coupled=table is not None and table.coupled,
        )


class _Asked(NamedTuple):
    agent: Agent | None  # None for a robot that is not planned
    body: Body
    arrives: bool  # only its goal is left


def _track(
    said: Announcement, begun: Committed, until: float | None = None
) -> tuple[tuple[float, float, float], ...]:
    """Return where a robot is while it does what is decided; see `Body`.

    It stays at the end of it for some time [s], or drives on at once.
    """
    track = [(said.x, said.y, 0.0)]
    for x, y in begun.points[1:]:
        leg = math.dist(track[-1][:2], (x, y))
        track.append((x, y, track[-1][2] + leg / said.limits.speed))
    if begun.ahead == 0.0:
        # It takes half of this to get up to speed, in which it drives half as far.
        speeding = said.limits.speed / (2 * said.limits.acceleration)
        track[-1] = (*track[-1][:2], track[-1][2] + speeding)
    if until is not None:
        track.append((*track[-1][:2], track[-1][2] + until))
    return tuple(track)


def _route(said: Announcement, drive: Drive) -> Route:
    """Return what a robot is told of its course: no more than up to where it turns back.

    Where a path lies on itself nobody can say how far along it a robot is.
    """
    points = drive.points
    headings = [math.atan2(by - ay, bx - ax) for (ax, ay), (bx, by) in itertools.pairwise(points)]
    backs = (
        index
        for index, (one, other) in enumerate(itertools.pairwise(headings), start=1)
        if abs(math.remainder(other - one, math.tau)) > BACK
        and math.dist(points[0], points[index]) > SHORT
    )
    end = next(backs, len(points) - 1)
    return Route(
        robot=said.name,
        plan=drive.plan,
        goal=said.goal,
        first=drive.marks[0],
        places=_without_straight(points[: end + 1]),
        waits=drive.waits,
        complete=drive.complete and end == len(points) - 1,
    )


def _without_straight(points: tuple[Point, ...]) -> tuple[Point, ...]:
    """Return the points at which a robot turns, so that it does not slow down at the others."""
    if len(points) < 3:  # noqa: PLR2004  (the points inside a line of two ends)
        return points
    return tuple(LineString(points).simplify(STRAIGHT).coords)


def _heading(begun: Committed, said: Announcement) -> float:
    """Return the heading with which a robot comes to the end of what is decided [rad]."""
    if len(begun.points) < 2 or begun.ahead == 0.0:  # noqa: PLR2004  (a line has two ends)
        return said.yaw
    (ax, ay), (bx, by) = begun.points[-2:]
    return math.atan2(by - ay, bx - ax)


def _timetable(rest: Drive, times: Times, agent: Agent, roadmap: int) -> Timetable | None:
    """Return what is left of a course from a robot's start on; None if it does not hold any more.

    Args:
        rest: The course.
        times: When it gets to its points now, and leaves them.
        agent: The robot, in the plan to come.
        roadmap: How many places the roadmap has; the rest are ends of the plan.
    """
    places = [agent.start, *rest.places[1:]]
    if len(places) > 1 and places[-1] < 0 and agent.goal >= roadmap and rest.complete:
        places[-1] = agent.goal
    # Where an earlier course began between two places it goes straight on.
    kept = [index for index, place in enumerate(places) if place >= 0]
    while len(kept) > 1 and math.dist(rest.points[0], rest.points[kept[1]]) < SHORT:
        if len(kept) == 2 and rest.complete:  # noqa: PLR2004  (only the goal is left)
            return None
        del kept[0]  # it waits where it is, and not a little farther on
    return Timetable(
        places=(agent.start, *(places[index] for index in kept[1:])),
        arrives=(times.arrives[0], *(times.arrives[index] for index in kept[1:])),
        leaves=(*(times.leaves[index] for index in kept[:-1]), math.inf),
        complete=rest.complete,
        coupled=rest.coupled,
    )


def _under_way(group: Mapping[str, Point | None], robots: Mapping[str, Tracked]) -> frozenset[str]:
    """Return who of a group has not left the goal yet with which it was put together."""
    return frozenset(
        name
        for name, goal in group.items()
        if goal is not None and name in robots and robots[name].said.goal == goal
    )


def _crowded(robots: Sequence[Tracked], begun: Sequence[Committed]) -> list[bool]:
    """Return which robots begin nearer to another one than robots keep from each other."""
    at = np.array([start.points[-1] for start in begun], dtype=float).reshape(-1, 2)
    radii = np.array([robot.said.radius for robot in robots])
    between = np.hypot(*(at[:, None] - at[None]).transpose(2, 0, 1))
    near = between < radii[:, None] + radii[None] + GAP
    np.fill_diagonal(near, val=False)
    return [bool(each) for each in near.any(axis=1)]
