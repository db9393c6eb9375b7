# SPDX-License-Identifier: BSD-3-Clause
"""Plans one robot among the reservations of others; robots that move alike share what it keeps."""

from __future__ import annotations

import math
from collections import OrderedDict
from dataclasses import dataclass
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from hive_navigation.mapf.distances import times_by_lane, times_by_place
from hive_navigation.mapf.ends import NO_ENDS
from hive_navigation.mapf.roadmap import need
from hive_navigation.mapf.sipp import (
    FOUND,
    NOTHING,
    Graph,
    Workspace,
    add_legs,
    safe_interval,
    search,
    time_onwards,
    trace,
)

if TYPE_CHECKING:
    from collections.abc import Callable, Hashable

    from numpy.typing import NDArray

    from hive_common.geometry import Array, Indices
    from hive_navigation.mapf.ends import Ends
    from hive_navigation.mapf.reservations import Reservations
    from hive_navigation.mapf.roadmap import Roadmap

KEPT_GOALS = 1024  # goals whose tables of times are kept
ASIDE = 2_000  # most states that a robot looks at which only has to get out of the way
SPARE = 0.06  # room beside a robot without which it does not like to drive [m]
TIGHT = 3.0  # how much longer a lane counts that has less
STATES = 60_000  # most states of one search


class Motion(NamedTuple):
    """How a robot moves.

    Attributes:
        radius: [m]
        speed: [m/s]
        acceleration: [m/s^2]
        yaw_rate: [rad/s]
    """

    radius: float
    speed: float
    acceleration: float
    yaw_rate: float


class Task(NamedTuple):
    """What a robot is planned for.

    Attributes:
        start: The place where it is.
        ready: When it is there [s].
        heading: Its heading there [rad].
        goal: The place to which it drives; negative for any place where it may park.
    """

    start: int
    ready: float
    heading: float
    goal: int


@dataclass(frozen=True)
class Path:
    """What a robot does.

    Attributes:
        actions: (2 k + 1,) standing and driving in turns; see `Conflicts`.
        times: (2 k + 1, 2) from when to when [s], from ever for the first, for ever for the last.
        complete: Whether it gets to its goal.
        left: Time from its end to its goal, were it alone [s].
    """

    actions: Indices
    times: Array
    complete: bool
    left: float

    @property
    def end(self) -> float:
        """When it gets to its last place [s]."""
        return float(self.times[-1, 0])


class PathSearch:
    """Finds paths for robots that move alike.

    A robot drives a lane at its speed or the lane's, whichever is less. To stop and drive on
    costs the time v/a, half of it for each. A bend by 90 degrees or more costs that and the time
    to turn, a slighter one its share of it. A wait that is shorter than v/a needs no stop: the
    robot comes slower, so it loses no more than it waits.

    Attributes:
        motion: How the robots move.
        turns: Whether to turn or to stop costs time.
        turn: What a bend costs: time to turn [s/rad], and to stop and drive on [s].
        graph: The roadmap as the search sees it, with the ends of the plan.
        origins: (a,) where each lane and leg begins, by the number of its action.
        places: How many places the roadmap has.
        one_lane: Time to turn round and drive a lane of middling length [s].
    """

    def __init__(self, roadmap: Roadmap, ways: Indices, motion: Motion) -> None:
        """Take the roadmap and the number of each of its lanes' ways, from 0."""
        self.motion = motion
        self._roadmap = roadmap
        self._turn = 1 / motion.yaw_rate
        self._stand = motion.speed / motion.acceleration
        self.turns = self._turn > 0 or self._stand > 0
        self.turn = self._turn, self._stand
        self.places = len(roadmap.places)
        lanes = roadmap.lanes
        self._from = np.ascontiguousarray(lanes[:, 0]).astype(np.intp)
        self._to = np.ascontiguousarray(lanes[:, 1]).astype(np.intp)
        self._ways = ways.astype(np.intp)
        self._things = int(ways.max(initial=-1)) + 1
        self._durations = self._driven(roadmap.lengths, roadmap.widths, roadmap.speeds)
        self._angles = _directions(roadmap.places, lanes)
        fits = self._durations[self._durations < np.inf]
        lane = float(np.median(fits)) if len(fits) else 0.0
        self.one_lane = lane + math.pi * self._turn + self._stand
        self._lanes_in: Indices = np.argsort(self._to, kind="stable").astype(np.intp)
        self._into: Indices = np.searchsorted(
            self._to[self._lanes_in], np.arange(len(roadmap.places) + 1)
        )
        self._times: OrderedDict[Hashable, Array] = OrderedDict()
        self._workspace = Workspace(1, STATES)
        self.join(NO_ENDS)

    def join(self, ends: Ends) -> None:
        """Take the ends of the next plan, in place of those before."""
        roadmap, count, first = self._roadmap, len(self._roadmap.places), len(ends.points)
        lanes, places = len(self._to), count + len(ends.points)
        self._ends = ends
        self._first_leg = lanes + places
        self._leg_from, to = ends.legs[:, 0].astype(np.intp), ends.legs[:, 1].astype(np.intp)
        hole = np.zeros(places, dtype=np.intp)
        everywhere = np.concatenate([self._to, hole, to])
        self._nodes = self._first_leg + len(to) if self.turns else places
        way = self._things + places + np.arange(len(to))
        angles = _directions(np.vstack([roadmap.places, ends.points]), ends.legs)
        durations = self._driven(ends.lengths, ends.widths, ends.speeds)
        self.graph = Graph(
            begins=np.concatenate([roadmap.begins, np.full(first, lanes)]).astype(np.intp),
            legs=np.searchsorted(self._leg_from, np.arange(places + 1)).astype(np.intp),
            first_leg=self._first_leg,
            to=everywhere,
            way=np.concatenate([self._ways, hole, way]).astype(np.intp),
            first_place=self._things,
            node=np.arange(len(everywhere), dtype=np.intp) if self.turns else everywhere,
            angles=np.concatenate([self._angles, np.zeros(places), angles]),
            durations=np.concatenate([self._durations, np.full(places, np.inf), durations]),
            may_stop=np.concatenate([roadmap.may_stop, np.ones(first, dtype=np.bool_)]),
        )
        self.origins: Indices = np.concatenate(
            [self._from, np.arange(places), self._leg_from]
        ).astype(np.intp)
        self._parks = np.concatenate([roadmap.may_park, np.zeros(first, dtype=np.bool_)])
        self._goals: NDArray[np.bool_] = np.zeros(places, dtype=np.bool_)
        self._togo: dict[tuple[int, int], Array] = {}
        if self._nodes + 1 > len(self._workspace.first):
            self._workspace = Workspace(2 * (self._nodes + 1), STATES)

    def _driven(self, lengths: Array, widths: Array, speeds: Array) -> Array:
        """Return the time to drive each lane [s]; infinite where the robot does not fit."""
        spare = widths - need(self.motion.radius)
        times = lengths / np.minimum(speeds, self.motion.speed)
        return np.where(spare >= 0, np.where(spare >= SPARE, times, TIGHT * times), np.inf)

    def _exits(self, goal: int) -> tuple[Indices, Array, Array]:
        """Return from where a goal is reached straight, in what time [s], and in what direction.

        For the end at which a robot begins, that is to where it drives first.
        """
        if goal < len(self._roadmap.places):
            return np.array([goal], dtype=np.intp), np.zeros(1), np.full(1, np.nan)
        legs = self._ends.legs
        into, out = np.flatnonzero(legs[:, 1] == goal), np.flatnonzero(legs[:, 0] == goal)
        used = into if len(into) else out
        places = legs[used, 0] if len(into) else legs[used, 1]
        known = (places < len(self._roadmap.places)) & (
            self.graph.durations[self._first_leg + used] < np.inf
        )
        used = self._first_leg + used[known]
        turned = 0.0 if len(into) else math.pi
        return (
            places[known].astype(np.intp),
            self.graph.durations[used],
            self.graph.angles[used] + turned,
        )

    def _key(self, goal: int) -> Hashable:
        """Return what tells a goal from all others, in this plan and in later ones."""
        count = len(self._roadmap.places)
        return goal if goal < count else tuple(self._ends.points[goal - count].tolist())

    def _kept(self, key: Hashable, compute: Callable[[], Array]) -> Array:
        """Return a table of times that is kept."""
        found = self._times.get(key)
        if found is None:
            found = compute()
            self._times[key] = found
            if len(self._times) > KEPT_GOALS:
                self._times.popitem(last=False)
        else:
            self._times.move_to_end(key)
        return found

    def times_from(self, goal: int) -> Array:
        """Return the time from each place of the roadmap to a goal, turning at once [s]."""

        def compute() -> Array:
            exits, last, _ = self._exits(goal)
            lanes = self._into, self._lanes_in, self._from, self._durations
            return times_by_place(*lanes, exits, last)

        return self._kept(("places", self._key(goal)), compute)

    def _times_by_lane(self, goal: int) -> Array:
        """Return the time from the end of each lane of the roadmap to a goal [s]."""

        def compute() -> Array:
            exits = self._exits(goal)
            lanes = self._into, self._lanes_in, self._from, self._durations, self._angles
            return times_by_lane(*lanes, *exits, self._turn, self._stand)

        return self._kept(("lanes", self._key(goal)), compute)

    def times(self, task: Task) -> Array:
        """Return the time from each node to a task's goal [s]; the last one is for its start.

        Only the ends of the task itself are on the way.
        """
        if task.goal < 0:
            return np.zeros(self._nodes + 1)
        key = task.start, task.goal
        found = self._togo.get(key)
        if found is None:
            found = self._togo[key] = self._times_of(*key)
        found[-1] = self._from_start(task, found)
        return found

    def _times_of(self, start: int, goal: int) -> Array:
        found = np.full(self._nodes + 1, np.inf)
        if not self.turns:
            found[: len(self._roadmap.places)] = self.times_from(goal)
            found[goal] = 0.0
            return found
        found[: len(self._from)] = self._times_by_lane(goal)
        graph, ends = self.graph, (start, goal)
        add_legs(*graph[:4], *graph[6:9], found, *ends, self._turn, self._stand)
        return found

    def _onwards(self, place: int, heading: float, times: Array) -> float:
        """Return the time to the goal from a place at which a robot is with a heading [s]."""
        graph = self.graph
        lanes = *graph[:3], *graph[6:9]
        return time_onwards(*lanes, times, place, heading, self._turn, self._stand)

    def _from_start(self, task: Task, times: Array) -> float:
        """Return how long a robot takes from its start to its goal, by the times of nodes [s]."""
        if task.start == task.goal:
            return 0.0
        return self._onwards(task.start, task.heading, times)

    def alone(self, task: Task) -> float:
        """Return how long a robot takes to its goal from its start, alone [s]."""
        return 0.0 if task.goal < 0 else float(self.times(task)[-1])

    def angle(self, action: int) -> float:
        """Return the direction of a lane or leg [rad]."""
        return float(self.graph.angles[action])

    def standing(self, place: int) -> int:
        """Return the number of the action to stand at a place."""
        return len(self._from) + place

    def thing(self, place: int) -> int:
        """Return the number of a place among the things that are reserved."""
        return self._things + place

    def places_of(self, actions: Indices) -> Indices:
        """Return the places at which actions stand."""
        return actions - len(self._from)

    def things_of(self, actions: Indices) -> Indices:
        """Return the places, as numbers of things, at which actions stand."""
        return actions - len(self._from) + self._things

    def ways_of(self, actions: Indices) -> Indices:
        """Return the ways, as numbers of things, of what drives along lanes and legs."""
        ways: Indices = self.graph.way[actions]
        return ways

    def find(
        self,
        task: Task,
        size: int,
        reservations: Reservations,
        horizon: float,
        limit: int,
        dwell: float = math.inf,
        only: Indices | None = None,
        latest: float = math.inf,
    ) -> Path | None:
        """Return the fastest path among reservations, or None if there is none at all.

        Args:
            task: What to plan.
            size: Number of the robot's size in the reservations.
            reservations: Of all others.
            horizon: From when on it may end anywhere [s]. Where somebody is at the goal for ever,
                it ends as near as it can, however long that takes.
            limit: Most states to look at.
            dwell: For how long it must be able to stay at its goal [s].
            only: The lanes and legs that it may use, (k,); None for all.
            latest: When it has to get to its goal, from its end on alone; None if it cannot [s].
        """
        times = self.times(task)
        if only is not None:
            nodes = np.append(self.graph.node[only], self._nodes)
            allowed = np.full_like(times, np.inf)
            allowed[nodes] = times[nodes]
            times = allowed
        goals = self._parks if task.goal < 0 else self._goals
        goal = task.goal if task.goal >= 0 else task.start
        was_goal = bool(goals[goal])
        goals[goal] = True
        if task.goal >= 0 and self._is_taken(goal, reservations, size, horizon):
            horizon = math.inf  # however far it drives, it ends best where it is nearest
        space = self._workspace
        status, last = search(
            *self.graph,
            reservations.heads[size],
            reservations.spans,
            reservations.links,
            space.first,
            space.times,
            space.links,
            space.heap_keys,
            space.heap,
            goals,
            times,
            task.start,
            self._nodes,
            task.ready,
            task.heading,
            self._turn,
            self._stand,
            dwell if task.goal >= 0 else math.inf,
            horizon,
            latest,
            limit if task.goal >= 0 else min(limit, ASIDE),
        )
        goals[goal] = was_goal
        if status == NOTHING:
            return None
        actions, spans = trace(space.times, space.links, last, len(self._from))
        if status == FOUND and task.goal >= 0:
            # A robot that begins at its goal has been there for ever, and stays from now on.
            spans[-1, 1] = max(spans[-1, 0], task.ready) + dwell
        left = 0.0 if status == FOUND else float(times[space.links[last, 5]])
        return Path(actions, spans, status == FOUND, left)

    def _is_taken(self, goal: int, reservations: Reservations, size: int, since: float) -> bool:
        """Return whether somebody is at a place for ever, from some time on [s]."""
        head = int(reservations.heads[size][self.thing(goal)])
        begin, _ = safe_interval(head, reservations.spans, reservations.links, since)
        return begin == math.inf


def _directions(places: Array, lanes: Indices) -> Array:
    """Return the directions of lanes between places [rad]."""
    along = places[lanes[:, 1]] - places[lanes[:, 0]]
    angles: Array = np.arctan2(along[:, 1], along[:, 0])
    return angles
