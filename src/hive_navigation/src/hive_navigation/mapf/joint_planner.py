# SPDX-License-Identifier: BSD-3-Clause
"""Plans paths for all robots at once, so that no two are in one place at one time.

Robots are planned one after the other, each the fastest way past those before it (`sipp.py`) and
moving aside those after it (`pushing.py`). docs/decisions/012-joint-planning.md tells what else
was tried.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from itertools import chain, pairwise
from typing import TYPE_CHECKING

import numpy as np

from hive_navigation.mapf.bodies import Body, Things
from hive_navigation.mapf.conflicts import (
    Conflicts,
    Lines,
    SpatialConflicts,
    classical_conflicts,
    ways,
)
from hive_navigation.mapf.coupled import coupled, rescheduled
from hive_navigation.mapf.ends import NO_ENDS
from hive_navigation.mapf.lacam import solve
from hive_navigation.mapf.neighbourhood_search import improve
from hive_navigation.mapf.path_search import Motion, Path, PathSearch, Task
from hive_navigation.mapf.pushing import PushingFleet
from hive_navigation.mapf.reservations import Reservations
from hive_navigation.mapf.zone_counts import ZoneCounts

if TYPE_CHECKING:
    from collections.abc import Collection, Mapping, Sequence

    from hive_navigation.mapf.ends import Ends
    from hive_navigation.mapf.fleet import Fleet
    from hive_navigation.mapf.roadmap import Roadmap

RENEW = 0.5  # a path that ends before this share of the horizon, and not at the goal, is made anew
MOST_TOGETHER = 8  # robots of one search; its effort is exponential in their number
LATE = 0.05  # a robot that is this late still has the plan that it had [s]


@dataclass(frozen=True)
class Agent:
    """A robot as the joint planner sees it.

    Attributes:
        start: The place from which it is planned.
        ready: When it is there [s].
        heading: Its heading there, frame map [rad].
        goal: The place to which it drives.
        radius: Of the circle around its footprint [m].
        speed: Its highest speed [m/s].
        acceleration: [m/s^2]
        yaw_rate: Its highest turning speed [rad/s].
        priority: The lesser of two is planned first.
        stays: Whether it cannot be moved: it picks, charges, is defect or follows no plan.
        dwell: How long it stays at its goal; later others may plan to pass there [s].
        body: Where it is until it is at its start, x, y [m] and when it leaves each point [s].
    """

    start: int
    ready: float
    heading: float
    goal: int
    radius: float
    speed: float
    acceleration: float
    yaw_rate: float
    priority: float
    stays: bool = False
    dwell: float = math.inf
    body: tuple[tuple[float, float, float], ...] = ()


@dataclass(frozen=True)
class Timetable:
    """When a robot is where, by a plan.

    Attributes:
        places: Indices of the places that it passes, its start first.
        arrives: When it reaches each [s].
        leaves: When it leaves each [s]; infinite for the last.
        complete: Whether it gets to its goal within the horizon.
        coupled: Whether it was planned in one search with others.
    """

    places: tuple[int, ...]
    arrives: tuple[float, ...]
    leaves: tuple[float, ...]
    complete: bool
    coupled: bool = False


@dataclass(frozen=True)
class PlannerSettings:
    """How far and how hard to plan.

    Attributes:
        horizon: A robot that gets to its goal later than this ends somewhere on the way, where it
            can stay [s]; infinite to plan all the way.
        gap: Between the circles of two robots [m].
        searches: Most searches for paths of one plan, for each robot.
        states: Most states that one search looks at.
        improvements: How often parts of a plan are made anew to see whether it gets shorter.
        gain: By how much a part of a plan has to get shorter to be changed [s].
        straight: Whether robots that begin at ends go straight to later places of their paths.
        classical: Whether robots are points and conflict as in the classical problem; see
            `conflicts.classical_conflicts`.
    """

    horizon: float = 30.0
    gap: float = 0.1
    searches: int = 20
    states: int = 20_000
    improvements: int = 0
    gain: float = 1e-3
    straight: bool = False
    classical: bool = False


DEFAULTS = PlannerSettings()


class JointPlanner:
    """Plans for all robots on one roadmap.

    The same calls give the same plans. It keeps tables of the roadmap, and nothing about robots.

    Attributes:
        coupled: The groups of the last plan, with those who have joined them; none if the robots
            were planned one after the other.
    """

    def __init__(self, roadmap: Roadmap, settings: PlannerSettings = DEFAULTS) -> None:
        self.roadmap = roadmap
        self.settings = settings
        self._ways = ways(roadmap)
        self._lanes, self._count = len(roadmap.lanes), len(roadmap.places)
        first = np.unique(self._ways, return_index=True)[1]
        ways_ = roadmap.places[roadmap.lanes[first]].reshape(-1, 4)
        self._known = Lines(np.vstack([ways_, np.hstack([roadmap.places, roadmap.places])]))
        self._lane_of = {(int(p), int(q)): k for k, (p, q) in enumerate(roadmap.lanes)}
        self._conflicts: dict[float, SpatialConflicts] = {}
        self._classical: tuple[Conflicts, Conflicts] | None = None
        if settings.classical:
            nothing = np.zeros(self._lanes + self._count + 1, dtype=np.intp)
            self._classical = classical_conflicts(roadmap), Conflicts(nothing, nothing[:0])
        self._ends = NO_ENDS
        self._places = roadmap.places
        self._leg_of: dict[tuple[int, int], int] = {}
        self._searches: dict[Motion, PathSearch] = {}
        self.coupled: Sequence[Sequence[int]] = ()

    def plan(
        self,
        agents: Sequence[Agent],
        before: Sequence[Timetable | None] = (),
        bodies: Sequence[Body] = (),
        ends: Ends = NO_ENDS,
        together: Sequence[Collection[int]] = (),
    ) -> list[Timetable]:
        """Return what each robot is to do, so that no two come too near to each other.

        It all can be driven to its end: a robot that does not get to its goal within the horizon
        ends where it is in nobody's way.

        Args:
            agents: The robots. One whose start is its goal moves out of the way of others, to the
                nearest place where it may park. One that cannot get to its goal does the same.
            before: What each robot had to do so far, with times from now on; kept where it still
                holds. None, or nothing at all, for robots without.
            bodies: What else is in the way, for ever at its last point.
            ends: Places of this plan alone: starts and goals beside the roadmap.
            together: Groups of robots each of which is planned in one search, before all others;
                see `coupled`. Who is in the way of a group and cannot get out of it joins it.
                Where that finds nothing, the robots are planned as all others.
        """
        self._join(ends)
        order = sorted(range(len(agents)), key=lambda k: _rank(agents[k], k))
        fixed = {robot for robot in order if agents[robot].stays}
        before = [*before, *[None] * (len(agents) - len(before))]
        groups = [sorted({*group} - fixed, key=order.index) for group in together]
        fleet = self._fleet(agents, bodies)
        groups = [group for group in groups if group]
        self.coupled = self._settle_groups(fleet, agents, before, order, groups)
        fixed = fixed.union(*self.coupled)
        if not self.coupled:
            self._settle(fleet, agents, before, order, fixed)
        # Bodies may keep a robot from getting out of the way; it waits for the next plan.
        for robot, path in enumerate(fleet.paths):
            if path is None:
                fleet.put(robot, fleet.stand(robot))
        movable = [robot for robot in order if robot not in fixed]
        if self.settings.straight:
            self._straighten(fleet, agents, movable)
        improve(fleet, movable, self.settings.improvements, self.settings.gain)
        paths = [path for path in fleet.paths if path is not None]
        grouped = {*chain.from_iterable(self.coupled)}
        return [
            self._timetable(path, agent, coupled=robot in grouped)
            for robot, (path, agent) in enumerate(zip(paths, agents, strict=True))
        ]

    def _settle(
        self,
        fleet: PushingFleet,
        agents: Sequence[Agent],
        before: Sequence[Timetable | None],
        order: Sequence[int],
        fixed: Collection[int],
    ) -> None:
        """Plan all robots one after the other, but for those that cannot move."""
        self._begin(fleet, agents)
        self._keep(fleet, agents, before, order)
        if fleet.settle_freely(order, fixed) or self._step_by_step(fleet, agents):
            return
        # Those for whom there was no place are planned anew, and if need be all of them.
        kept = [None if k in fleet.contested else table for k, table in enumerate(before)]
        self._begin(fleet, agents)
        self._keep(fleet, agents, kept, order)
        if fleet.settle_all(order):
            return
        self._begin(fleet, agents)
        fleet.settle_all(order)

    def _settle_groups(
        self,
        fleet: PushingFleet,
        agents: Sequence[Agent],
        before: Sequence[Timetable | None],
        order: Sequence[int],
        groups: Sequence[Sequence[int]],
    ) -> Sequence[Sequence[int]]:
        """Plan all robots, with groups in one search each, and return the groups.

        They grow as in independence detection (Standley, AAAI 2010).

        Returns:
            Nothing if there is no group, or no plan in which one gets through.
        """
        while groups and max(map(len, groups)) <= MOST_TOGETHER:
            self._begin(fleet, agents)
            more: Collection[int] = ()
            if all(self._put_together(fleet, agents, before, group) for group in groups):
                fixed = {robot for robot in order if agents[robot].stays}.union(*groups)
                self._keep(fleet, agents, before, order)
                if fleet.settle_freely(order, fixed):
                    return groups
                more = fleet.contested - fixed
            if not more and len(groups) == 1:
                break
            groups = [[*chain.from_iterable(groups), *sorted(more)]]
        return ()

    def _put_together(
        self,
        fleet: Fleet,
        agents: Sequence[Agent],
        before: Sequence[Timetable | None],
        group: Sequence[int],
    ) -> bool:
        """Plan a group; return whether it worked. It keeps a plan of one search while it holds."""
        paths = {
            robot: path
            for robot in group
            if (table := before[robot]) is not None
            and table.coupled
            and (path := self._rest(agents[robot], table)) is not None
        }
        if len(paths) == len(group):
            kept = rescheduled(fleet, paths)
            goes_on = all(kept[robot].complete >= paths[robot].complete for robot in group)
            if goes_on and _put_all(fleet, kept):
                return True
        found = coupled(fleet, group, self._places)
        return found is not None and _put_all(fleet, found)

    def _straighten(self, fleet: Fleet, agents: Sequence[Agent], movable: Sequence[int]) -> None:
        """Let robots go straight from where they begin to a later place of their paths."""
        for robot in movable:
            path = fleet.paths[robot]
            start = agents[robot].start
            if path is None or len(path.actions) < 2 or fleet.tasks[robot].goal < 0:  # noqa: PLR2004
                continue
            places = (path.actions[0::2] - self._lanes).tolist()
            legs = [leg for place in places[2:] if (leg := self._leg_of.get((start, place)))]
            if legs:
                fleet.shorten(robot, np.concatenate([path.actions[1::2], legs]))

    def _join(self, ends: Ends) -> None:
        """Take the ends of the next plan, in place of those before."""
        self._ends = ends
        self._places = np.vstack([self.roadmap.places, ends.points])
        first = self._lanes + len(self._places)
        self._leg_of = {(p, q): first + k for k, (p, q) in enumerate(ends.legs.tolist())}
        for search in self._searches.values():
            search.join(ends)

    def _step_by_step(self, fleet: Fleet, agents: Sequence[Agent]) -> bool:
        """Plan all robots of a classical problem that has no horizon; return whether it worked."""
        settings = self.settings
        if not settings.classical or math.isfinite(settings.horizon):
            return False
        if any(agent.stays for agent in agents):
            return False
        times = np.array([self._search(agent).times_from(agent.goal) for agent in agents])
        trail = solve(
            self.roadmap.begins.astype(np.intp),
            np.ascontiguousarray(self.roadmap.lanes[:, 1], dtype=np.intp),
            [agent.start for agent in agents],
            [agent.goal for agent in agents],
            times,
        )
        if trail is None:
            return False
        fleet.forget()
        for robot, line in enumerate(np.array(trail).T.tolist()):
            moves = [k for k in range(1, len(line)) if line[k] != line[k - 1]]
            places = [line[0], *(line[k] for k in moves)]
            arrives = [0.0, *(float(k) for k in moves)]
            leaves = [*(float(k - 1) for k in moves), math.inf]
            fleet.put(robot, self._path(places, arrives, leaves, 0.0, complete=True))
        return True

    def _fleet(self, agents: Sequence[Agent], bodies: Sequence[Body]) -> PushingFleet:
        """Return the robots, with nobody planned yet."""
        settings = self.settings
        searches = [self._search(agent) for agent in agents]
        radii = sorted({agent.radius for agent in agents})
        apart = {one + other + settings.gap for one in radii for other in radii}
        conflicts = {distance: self._conflict(distance, agents) for distance in apart}
        reservations = Reservations(
            len(self._known) + len(self._ends.points) + len(self._ends.legs),
            [[conflicts[one + other + settings.gap] for other in radii] for one in radii],
        )
        tasks = []
        for agent, search in zip(agents, searches, strict=True):
            task = Task(agent.start, agent.ready, agent.heading, agent.goal)
            if agent.goal == agent.start or not math.isfinite(search.alone(task)):
                task = task._replace(goal=-1)
            tasks.append(task)
        fleet = PushingFleet(
            tasks,
            [radii.index(agent.radius) for agent in agents],
            searches,
            reservations,
            settings.horizon,
            settings.searches * len(agents),
            settings.states,
            [agent.dwell for agent in agents],
        )
        fleet.counts = self._counts(reservations)
        if not settings.classical:
            self._block(fleet, agents, bodies, radii)
        return fleet

    def _block(
        self, fleet: Fleet, agents: Sequence[Agent], bodies: Sequence[Body], radii: Sequence[float]
    ) -> None:
        """Reserve what robots until they begin, and all bodies, block for robots of each size."""
        starts = np.array([agent.start for agent in agents], dtype=np.intp)
        things = Things(self._known, self._count, self._ends, self._places, starts)
        all_ = [*(Body(agent.radius, agent.body) for agent in agents), *bodies]
        for size, radius in enumerate(radii):
            for each in things.blocked(all_, radius, self.settings.gap):
                who = len(agents) + each.body
                fleet.reservations.block(who, size, each.things, -math.inf, each.until)
                last = all_[each.body].track[-1][2]
                if fleet.counts is not None and each.body >= len(agents) and each.until == last:
                    fleet.counts.stay(who, each.things, each.until)

    def _counts(self, reservations: Reservations) -> ZoneCounts | None:
        """Return what counts robots in zones with a limit; None without such zones."""
        limits = self.roadmap.limits
        if not limits:
            return None
        ways = len(self._known) - self._count
        more = {each.name: each for each in self._ends.limits}
        first_leg, first_way = self._lanes + len(self._places), ways + len(self._places)
        none = np.empty(0, dtype=np.intp)
        things, actions = [], []
        for limit in limits:
            ends = more.get(limit.name)
            places, legs = (none, none) if ends is None else (ends.places, ends.lanes)
            places = np.concatenate([limit.places, places])
            things.append(
                np.concatenate(
                    [np.unique(self._ways[limit.lanes]), ways + places, first_way + legs]
                )
            )
            actions.append(np.concatenate([limit.lanes, self._lanes + places, first_leg + legs]))
        return ZoneCounts(reservations, things, actions, [limit.robots for limit in limits])

    def _begin(self, fleet: Fleet, agents: Sequence[Agent]) -> None:
        """Forget all plans, and plan the robots that cannot move."""
        fleet.forget()
        for robot, agent in enumerate(agents):
            if agent.stays:
                fleet.put(robot, fleet.stand(robot))

    def _keep(
        self,
        fleet: Fleet,
        agents: Sequence[Agent],
        before: Sequence[Timetable | None],
        order: Sequence[int],
    ) -> None:
        """Plan those robots for which the plan before still holds."""
        for robot in order:
            table = before[robot]
            if table is not None and fleet.paths[robot] is None:
                path = self._kept(agents[robot], table)
                if path is not None and fleet.fits(robot, path):
                    fleet.put(robot, path)
                elif path is not None:
                    fleet.habits[robot] = path.actions[1::2]

    def _kept(self, agent: Agent, table: Timetable) -> Path | None:
        """Return the rest of the plan that a robot had, or None if it does not hold any more."""
        path = self._rest(agent, table)
        if path is None:
            return None
        if agent.start == agent.goal:
            end = int(path.actions[-1]) - self._lanes
            parks = end < self._count and bool(self.roadmap.may_park[end])
            return path if len(path.actions) > 1 and parks else None
        return path if path.complete or path.end >= RENEW * self.settings.horizon else None

    def _rest(self, agent: Agent, table: Timetable) -> Path | None:
        """Return the rest of the plan that a robot had; None if it cannot be driven any more."""
        if agent.start not in table.places:
            return None
        first = table.places.index(agent.start)
        places = table.places[first:]
        idle = agent.start == agent.goal
        complete = idle or places[-1] == agent.goal
        lost = any(self._lane(pair) is None for pair in pairwise(places))
        if lost or agent.ready > table.leaves[first] + LATE:
            return None
        left = 0.0
        if not complete:
            if places[-1] >= self._count:
                return None
            left = float(self._search(agent).times_from(agent.goal)[places[-1]])
        leaves = [max(table.leaves[first], agent.ready), *table.leaves[first + 1 :]]
        stays = agent.dwell if complete and not idle else math.inf
        return self._path(
            places, table.arrives[first:], leaves, left, complete=complete, stays=stays
        )

    def _path(
        self,
        places: Sequence[int],
        arrives: Sequence[float],
        leaves: Sequence[float],
        left: float,
        *,
        complete: bool,
        stays: float = math.inf,
    ) -> Path:
        """Return what a robot does that passes some places at some times [s]; see `Path`."""
        actions = np.empty(2 * len(places) - 1, dtype=np.intp)
        actions[0::2] = self._lanes + np.array(places)
        actions[1::2] = [self._lane(pair) for pair in pairwise(places)]
        times = np.empty((len(actions), 2))
        times[0::2, 0], times[0::2, 1] = arrives, leaves
        times[0, 0] = -math.inf
        times[1::2, 0], times[1::2, 1] = times[:-1:2, 1], times[2::2, 0]
        times[-1, 1] = arrives[-1] + stays
        return Path(actions, times, complete, left)

    def _lane(self, pair: tuple[int, int]) -> int | None:
        """Return the number of the lane or leg between two places; None if there is none."""
        lane = self._lane_of.get(pair)
        return self._leg_of.get(pair) if lane is None else lane

    def _timetable(self, path: Path, agent: Agent, *, coupled: bool) -> Timetable:
        """Return what a path says."""
        arrives = path.times[0::2, 0].tolist()
        arrives[0] = agent.ready
        return Timetable(
            tuple((path.actions[0::2] - self._lanes).tolist()),
            tuple(arrives),
            (*path.times[0:-1:2, 1].tolist(), math.inf),
            path.complete,
            coupled,
        )

    def _search(self, agent: Agent) -> PathSearch:
        """Return what finds paths for a robot."""
        return self._mover(Motion(agent.radius, agent.speed, agent.acceleration, agent.yaw_rate))

    def _mover(self, motion: Motion) -> PathSearch:
        if motion not in self._searches:
            self._searches[motion] = PathSearch(self.roadmap, self._ways, motion)
            self._searches[motion].join(self._ends)
        return self._searches[motion]

    def _conflict(self, apart: float, agents: Sequence[Agent]) -> tuple[Conflicts, Conflicts]:
        """Return what robots block for others that must be so far away [m], and more with ends."""
        if self._classical is not None:
            return self._classical
        if apart not in self._conflicts:
            self._conflicts[apart] = SpatialConflicts(self.roadmap, self._ways, apart)
        crowded = np.full(len(self._ends.points), -1, dtype=np.intp)
        for number, agent in enumerate(agents):
            if agent.start >= self._count:
                crowded[agent.start - self._count] = number
        found = self._conflicts[apart]
        return found.fixed, found.with_ends(self._ends, self._places, crowded)


def _put_all(fleet: Fleet, paths: Mapping[int, Path]) -> bool:
    """Plan robots; return whether their paths fit, else nothing changed."""
    for number, (robot, path) in enumerate(paths.items()):
        if not fleet.fits(robot, path):
            for planned in [*paths][:number]:
                fleet.take(planned)
            return False
        fleet.put(robot, path)
    return True


def _rank(agent: Agent, number: int) -> tuple[bool, float, int]:
    """Return a key that orders robots: who is planned first."""
    return agent.goal == agent.start, agent.priority, number
