# SPDX-License-Identifier: BSD-3-Clause
"""Plans one robot among the reservations of others; robots that move alike share what it keeps."""

from __future__ import annotations

import math
from collections import OrderedDict
from dataclasses import dataclass
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from robot_navigation.mapf.distances import times_by_lane, times_by_place
from robot_navigation.mapf.roadmap import need
from robot_navigation.mapf.sipp import (
    FOUND,
    NOTHING,
    Graph,
    Workspace,
    bend,
    search,
    trace,
    turning,
)

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from hive_common.geometry import Array, Indices
    from robot_navigation.mapf.reservations import Reservations
    from robot_navigation.mapf.roadmap import Roadmap

KEPT_GOALS = 1024  # goals whose tables of times are kept
ASIDE = 2_000  # most states that a robot looks at which only has to get out of the way
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
        one_lane: Time to turn round and drive a lane of middling length [s].
    """

    def __init__(self, roadmap: Roadmap, ways: Indices, motion: Motion) -> None:
        """Take the roadmap and the number of each of its lanes' ways, from 0."""
        self.motion = motion
        count, lanes = len(roadmap.places), roadmap.lanes
        self._from = np.ascontiguousarray(lanes[:, 0]).astype(np.intp)
        to = np.ascontiguousarray(lanes[:, 1]).astype(np.intp)
        speed = np.minimum(roadmap.speeds, motion.speed)
        durations = np.where(
            roadmap.widths >= need(motion.radius), roadmap.lengths / speed, np.inf
        )
        along = roadmap.places[to] - roadmap.places[self._from]
        self._turn = 1 / motion.yaw_rate
        self._stand = motion.speed / motion.acceleration
        self.turns = self._turn > 0 or self._stand > 0
        fits = durations[durations < np.inf]
        lane = float(np.median(fits)) if len(fits) else 0.0
        self.one_lane = lane + math.pi * self._turn + self._stand
        self._graph = Graph(
            begins=roadmap.begins.astype(np.intp),
            to=to,
            way=(count + ways).astype(np.intp),
            node=np.arange(len(lanes), dtype=np.intp) if self.turns else to,
            angles=np.arctan2(along[:, 1], along[:, 0]),
            durations=durations,
            may_stop=roadmap.may_stop,
        )
        self._lanes_in: Indices = np.argsort(to, kind="stable").astype(np.intp)
        self._into: Indices = np.searchsorted(to[self._lanes_in], np.arange(count + 1))
        self._parks = roadmap.may_park.copy()
        self._goals: NDArray[np.bool_] = np.zeros(count, dtype=bool)
        self._nodes = len(lanes) if self.turns else count
        self._times: OrderedDict[int, Array] = OrderedDict()
        self._anywhere: Array = np.zeros(self._nodes + 1)
        self._place_times: OrderedDict[int, Array] = OrderedDict()
        self._workspace = Workspace(self._nodes + 1, STATES)

    def times(self, goal: int) -> Array:
        """Return the time from each node to a goal [s]; the last is free for a start."""
        if goal < 0:
            return self._anywhere
        found = self._times.get(goal)
        if found is None:
            found = np.append(self._computed(goal), np.inf)
            self._times[goal] = found
            if len(self._times) > KEPT_GOALS:
                self._times.popitem(last=False)
        else:
            self._times.move_to_end(goal)
        return found

    def times_from(self, goal: int) -> Array:
        """Return the time from each place to a goal for a robot that turns at once [s]."""
        if not self.turns:
            return self.times(goal)[:-1]
        found = self._place_times.get(goal)
        if found is None:
            found = times_by_place(
                self._into, self._lanes_in, self._from, self._graph.durations, goal
            )
            self._place_times[goal] = found
            if len(self._place_times) > KEPT_GOALS:
                self._place_times.popitem(last=False)
        return found

    def ways_of(self, actions: Indices) -> Indices:
        """Return the ways, numbered behind the places, of what drives along lanes."""
        ways: Indices = self._graph.way[actions - len(self._goals)]
        return ways

    def alone(self, task: Task) -> float:
        """Return how long a robot takes to its goal from its start, alone [s]."""
        if task.goal < 0 or task.start == task.goal:
            return 0.0
        times = self.times(task.goal)
        if not self.turns:
            return float(times[task.start])
        graph = self._graph
        least = math.inf
        for lane in range(graph.begins[task.start], graph.begins[task.start + 1]):
            angle = bend(task.heading, float(graph.angles[lane]))
            bent = turning(angle, self._turn, self._stand)
            least = min(least, bent + float(graph.durations[lane] + times[lane]))
        return least

    def find(
        self, task: Task, size: int, reservations: Reservations, horizon: float, limit: int
    ) -> Path | None:
        """Return the fastest path among reservations, or None if there is none at all.

        Args:
            task: What to plan.
            size: Number of the robot's size in the reservations.
            reservations: Of all others.
            horizon: From when on it may end anywhere [s].
            limit: Most states to look at.
        """
        times = self.times(task.goal)
        times[-1] = self.alone(task)
        goals = self._parks if task.goal < 0 else self._goals
        goal = task.goal if task.goal >= 0 else task.start
        was_goal = bool(goals[goal])
        goals[goal] = True
        space = self._workspace
        status, last = search(
            *self._graph,
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
            horizon,
            limit if task.goal >= 0 else min(limit, ASIDE),
        )
        goals[goal] = was_goal
        if status == NOTHING:
            return None
        actions, spans = trace(space.times, space.links, last, len(self._goals))
        left = 0.0 if status == FOUND else float(times[space.links[last, 5]])
        return Path(actions, spans, status == FOUND, left)

    def _computed(self, goal: int) -> Array:
        """Return the time from each node to a goal [s]."""
        common = (self._into, self._lanes_in, self._from, self._graph.durations)
        if not self.turns:
            return times_by_place(*common, goal)
        return times_by_lane(*common, self._graph.angles, goal, self._turn, self._stand)
