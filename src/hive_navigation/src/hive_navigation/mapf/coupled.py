# SPDX-License-Identifier: BSD-3-Clause
"""Plans a few robots in one search over the places of all of them.

Robots that are planned one after the other do not get out of every lane: sometimes each has to
give way more than once. A search over configurations, which place each robot is at, finds a way
wherever there is one (Standley, Finding Optimal Solutions to Cooperative Pathfinding Problems,
AAAI 2010). It is exponential in the number of robots, so it is for those that have locked up. In
one step one robot drives one lane and the others stand; afterwards each drive begins as soon as
those before it that could touch it have ended.
"""

from __future__ import annotations

import heapq
import math
from collections import defaultdict
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from hive_common.compiled import compiled
from hive_navigation.mapf.path_search import Path
from hive_navigation.mapf.sipp import bend, turning

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from numpy.typing import NDArray

    from hive_common.geometry import Array, Indices
    from hive_navigation.mapf.fleet import Fleet

REACH = 10.0  # how far from the robots places count [m]
CONFIGURATIONS = 200_000  # most that are made in one search
WEIGHT = 3.0  # how much more the time that is left counts than the time driven
BUCKETS = 2**19  # of the table of configurations; a power of 2


class _Area(NamedTuple):
    """The part of a roadmap in which a search is done, for robots 0..k-1 of a group.

    Attributes:
        places: (n,) their numbers; those of the search are the rows.
        begins: (n + 1,) the lanes from each place.
        lanes: (m,) the actions of lanes and legs, in the order of where they begin.
        to: (m,) where each leads, a row of `places`.
        durations: (k, m) time that each robot takes for each [s]; infinite for one that it cannot.
        togo: (k, n) time from each place to the robot's goal [s]; 0 for one that only makes way.
        ends: (k,) the row at which each robot's way ends; -1 for one that only makes way.
    """

    places: Indices
    begins: Indices
    lanes: Indices
    to: Indices
    durations: Array
    togo: Array
    ends: Indices


class _Move(NamedTuple):
    robot: int  # of the fleet
    lane: int  # an action
    origin: int  # the place
    to: int
    duration: float  # [s]


def coupled(fleet: Fleet, robots: Sequence[int], points: Array) -> dict[int, Path] | None:
    """Return what robots do so that each of them gets to its goal once.

    A robot that has been at its goal makes way for the others. Of those whose goal is far away,
    each gets as far as it is from the others.

    Args:
        fleet: Of which only those are planned that nobody can move.
        robots: Whom to plan.
        points: (n, 2) all places of the plan, frame map [m].

    Returns:
        The paths by robot; None if the search has found nothing.
    """
    area = _area(fleet, robots, points)
    starts = np.searchsorted(area.places, [fleet.tasks[robot].start for robot in robots])
    blocked = _blocked(fleet, robots, area)
    count, trail = best_first(
        area.begins,
        area.to,
        area.durations,
        area.togo,
        area.ends,
        blocked,
        np.array([fleet.sizes[robot] for robot in robots], dtype=np.intp),
        starts.astype(np.intp),
        WEIGHT,
        CONFIGURATIONS,
    )
    if count < 0:
        return None
    begins = np.searchsorted(area.begins, trail[:count, 1], side="right") - 1
    moves = [
        _Move(
            robots[robot],
            int(area.lanes[lane]),
            int(area.places[begin]),
            int(area.places[area.to[lane]]),
            float(area.durations[robot, lane]),
        )
        for (robot, lane), begin in zip(trail[:count].tolist(), begins.tolist(), strict=True)
    ]
    ends = {
        robot: int(area.places[end])
        for robot, end in zip(robots, area.ends, strict=True)
        if end >= 0
    }
    return _Schedule(fleet, robots, ends).of(moves)


def rescheduled(fleet: Fleet, paths: Mapping[int, Path]) -> dict[int, Path]:
    """Return paths with times as they are now; everybody drives as before, in the same order.

    Args:
        fleet: As in `coupled`.
        paths: What is left of each robot's path.
    """
    moves = []
    for robot, path in paths.items():
        search = fleet.searches[robot]
        places = search.places_of(path.actions[0::2]).tolist()
        for k, lane in enumerate(path.actions[1::2].tolist()):
            duration = float(search.graph.durations[lane])
            move = _Move(robot, lane, places[k], places[k + 1], duration)
            moves.append((float(path.times[2 * k + 1, 0]), k, move))
    ends = {
        robot: int(fleet.searches[robot].places_of(path.actions[-1:])[0])
        for robot, path in paths.items()
        if fleet.tasks[robot].goal >= 0
    }
    order = sorted(moves, key=lambda each: (each[0], each[1], each[2].robot))
    return _Schedule(fleet, [*paths], ends).of([move for _, _, move in order])


def _area(fleet: Fleet, robots: Sequence[int], points: Array) -> _Area:
    """Return the part of the roadmap around some robots, with their own ends."""
    searches = [fleet.searches[robot] for robot in robots]
    tasks = [fleet.tasks[robot] for robot in robots]
    graph, origins = searches[0].graph, searches[0].origins
    starts = np.array([task.start for task in tasks])
    goals = np.array([task.goal for task in tasks])
    near = np.zeros(len(points), dtype=np.bool_)
    for start in starts:
        near |= np.hypot(*(points - points[start]).T) <= REACH
    inside = near & (np.arange(len(points)) < searches[0].places)
    inside[starts] = True
    inside[goals[(goals >= 0) & near[goals]]] = True
    places = np.flatnonzero(inside)
    # Standing takes for ever, and so does a lane that is too narrow.
    drives = np.any([np.isfinite(search.graph.durations) for search in searches], axis=0)
    lanes = np.flatnonzero(inside[origins] & inside[graph.to] & drives)
    # Nobody is planned to leave a goal by its end; who makes way there goes back as it came.
    legs = lanes[lanes >= graph.first_leg]
    back = legs[np.isin(graph.to[legs], goals)]
    begin = np.concatenate([origins[lanes], graph.to[back]])
    to = np.concatenate([graph.to[lanes], origins[back]])
    lanes = np.concatenate([lanes, back])
    order = np.argsort(begin, kind="stable")
    begin, to, lanes = begin[order], to[order], lanes[order]
    durations = np.full((len(robots), len(lanes)), np.inf)
    togo = np.zeros((len(robots), len(places)))
    ends = np.full(len(robots), -1, dtype=np.intp)
    count = searches[0].places
    for k, (robot, search, task) in enumerate(zip(robots, searches, tasks, strict=True)):
        own = np.arange(len(points)) < count
        own[[task.start, task.goal if task.goal >= 0 else task.start]] = True
        free = fleet.free_from(robot)
        open_ = np.maximum(free[search.thing(0) + to], free[search.ways_of(lanes)]) < math.inf
        stops = graph.may_stop[to] | (to == task.goal)
        usable = own[begin] & own[to] & open_ & stops
        durations[k, usable] = search.graph.durations[lanes[usable]]
        if task.goal < 0:
            continue
        times = np.full(len(points), np.inf)
        times[:count] = search.times_from(task.goal)
        times[task.start] = min(times[task.start], search.alone(task))
        times[task.goal] = 0.0
        togo[k] = times[places]
        nearest = int(np.argmin(togo[k]))
        if math.isfinite(togo[k, nearest]):
            ends[k] = nearest
        else:
            togo[k] = 0.0
    return _Area(
        places.astype(np.intp),
        np.searchsorted(begin, [*places, len(points)]).astype(np.intp),
        lanes.astype(np.intp),
        np.searchsorted(places, to).astype(np.intp),
        durations,
        togo,
        ends,
    )


def _blocked(fleet: Fleet, robots: Sequence[int], area: _Area) -> NDArray[np.bool_]:
    """Return which drives are too near to which robots that stand.

    (sizes, sizes, m, n): whether a robot of the first size that drives a lane meets one of the
    second size at a place.
    """
    sizes = sorted({fleet.sizes[robot] for robot in robots})
    most = sizes[-1] + 1
    first = fleet.searches[robots[0]].thing(0)
    found = np.zeros((most, most, len(area.lanes), len(area.places)), dtype=np.bool_)
    for one in sizes:
        for other in sizes:
            row, thing = fleet.reservations.blocked(one, other, area.lanes)
            place = thing - first
            at = np.minimum(np.searchsorted(area.places, place), len(area.places) - 1)
            here = area.places[at] == place
            found[one, other, row[here], at[here]] = True
    return found


class _Schedule:
    """Says when each of some drives begins: as soon as those before it are over."""

    def __init__(self, fleet: Fleet, robots: Sequence[int], ends: dict[int, int]) -> None:
        self._fleet = fleet
        self._robots = robots
        self._ends = ends
        self._now = {robot: fleet.tasks[robot].ready for robot in robots}
        self._heading = {robot: fleet.tasks[robot].heading for robot in robots}
        self._free = {robot: fleet.free_from(robot) for robot in robots}
        self._done: list[tuple[_Move, float]] = []  # and when it is over [s]
        self._stands: dict[int, tuple[int, float]] = {}  # who goes no further: where, until when
        self._things: dict[tuple[int, int, int], frozenset[int]] = {}

    def of(self, moves: Sequence[_Move]) -> dict[int, Path]:
        """Return the paths that consist of moves."""
        fleet = self._fleet
        actions = {r: [fleet.searches[r].standing(fleet.tasks[r].start)] for r in self._robots}
        times: dict[int, list[float]] = defaultdict(list)
        for robot, end in self._ends.items():
            if end == fleet.tasks[robot].start:
                self._stand(robot, end)
        for move in moves:
            robot = move.robot
            if robot in self._stands:
                continue
            spans = self._spans(move)
            if spans is None:
                self._stands[robot] = move.origin, math.inf
                continue
            times[robot] += spans
            actions[robot] += [move.lane, fleet.searches[robot].standing(move.to)]
            self._now[robot] = spans[1]
            self._done.append((move, spans[1]))
            if self._ends.get(robot) == move.to:
                self._stand(robot, move.to)
        return {robot: self._path(robot, actions[robot], times[robot]) for robot in self._robots}

    def _stand(self, robot: int, place: int) -> None:
        """Note that a robot has come to where its way ends."""
        at_goal = self._fleet.tasks[robot].goal == place
        stays = self._fleet.dwells[robot] if at_goal else math.inf
        self._stands[robot] = place, self._now[robot] + stays

    def _spans(self, move: _Move) -> tuple[float, float] | None:
        """Return when a robot sets out and arrives; None if it can never do so."""
        robot, search = move.robot, self._fleet.searches[move.robot]
        angle = search.angle(move.lane)
        turned = turning(bend(self._heading[robot], angle), *search.turn)
        at_once = self._now[robot] + turned
        free = self._free[robot]
        soonest = max(
            at_once,
            float(free[search.thing(move.to)]),
            float(free[search.ways_of(np.array([move.lane]))[0]]),
        )
        for earlier, over in self._done:
            if earlier.robot != robot and self._meet(move, earlier):
                soonest = max(soonest, over)
        for other, (place, until) in self._stands.items():
            if other != robot and self._reaches(move, other, place):
                soonest = max(soonest, until)
        if math.isinf(soonest):
            return None
        self._heading[robot] = angle
        lost = max(0.0, min(soonest - at_once, search.turn[1] - turned))
        return soonest, soonest + move.duration + lost

    def _meet(self, move: _Move, other: _Move) -> bool:
        """Return whether a drive could touch a robot that does an earlier one."""
        size = self._fleet.sizes[other.robot]
        way = self._fleet.searches[other.robot].ways_of(np.array([other.lane]))[0]
        return int(way) in self._blocked(move, size) or any(
            self._reaches(move, other.robot, place) for place in (other.origin, other.to)
        )

    def _reaches(self, move: _Move, other: int, place: int) -> bool:
        """Return whether a drive could touch another robot that stands at a place."""
        thing = self._fleet.searches[other].thing(place)
        return thing in self._blocked(move, self._fleet.sizes[other])

    def _blocked(self, move: _Move, other: int) -> frozenset[int]:
        """Return which things a drive blocks for robots of a size."""
        size = self._fleet.sizes[move.robot]
        key = move.lane, size, other
        if key not in self._things:
            lanes = np.array([move.lane], dtype=np.intp)
            _, things = self._fleet.reservations.blocked(size, other, lanes)
            self._things[key] = frozenset(things.tolist())
        return self._things[key]

    def _path(self, robot: int, actions: Sequence[int], times: Sequence[float]) -> Path:
        """Return what a robot does; `times` are when it sets out and arrives, in turns [s]."""
        task, search = self._fleet.tasks[robot], self._fleet.searches[robot]
        _, until = self._stands.get(robot, (task.start, math.inf))
        marks = [-math.inf, *times, until]
        last = int(search.places_of(np.array(actions[-1:]))[0])
        complete = last == task.goal or task.goal < 0
        left = 0.0
        if not complete:
            at_start = last == task.start
            left = search.alone(task) if at_start else float(search.times_from(task.goal)[last])
        return Path(
            np.array(actions, dtype=np.intp),
            np.column_stack([marks[:-1], marks[1:]]),
            complete,
            left,
        )


@compiled("boolean(int64[::1], int64[::1], int64[::1])")
def is_same(one: Indices, other: Indices, kinds: Indices) -> bool:
    """Return whether two configurations have robots of the same kinds at the same places, (k,)."""
    for a in range(len(one)):
        found = False
        for b in range(len(other)):
            found = found or (one[a] == other[b] and kinds[a] == kinds[b])
        if not found:
            return False
    return True


@compiled(
    "Tuple((int64, int64[:, ::1]))(int64[::1], int64[::1], float64[:, ::1], float64[:, ::1],"
    " int64[::1], boolean[:, :, :, ::1], int64[::1], int64[::1], float64, int64)"
)
def best_first(  # noqa: C901, D417, PLR0912, PLR0915  (an inner loop)
    begins: Indices,
    to: Indices,
    durations: Array,
    togo: Array,
    ends: Indices,
    blocked: NDArray[np.bool_],
    sizes: Indices,
    starts: Indices,
    weight: float,
    most: int,
) -> tuple[int, Indices]:
    """Find drives of one robot after the other until each has been at its end.

    Args:
        begins: See `_Area`, as all up to `ends`.
        blocked: See `_blocked`.
        sizes: (k,) the size of each robot.
        starts: (k,) where each is.
        weight: How much more the time that is left counts than the time driven; 1 for the
            shortest drives.
        most: Most configurations to make.

    Returns:
        How many drives there are, -1 if none were found, and (c, 2) the robot and lane of each.
    """
    robots = len(starts)
    at = np.empty((most, robots), dtype=np.int64)
    been = np.zeros(most, dtype=np.int64)  # a bit for each robot that has been at its end
    driven = np.empty(most)
    left = np.zeros(most)
    links = np.full((most, 4), -1, dtype=np.int64)  # the one before, robot, lane; next of a bucket
    done = np.zeros(most, dtype=np.bool_)
    buckets = np.full(BUCKETS, -1, dtype=np.int64)
    after = np.empty(robots, dtype=np.int64)
    kinds = np.empty(robots, dtype=np.int64)  # robots of one kind may stand in for each other
    everybody = 0
    for robot in range(robots):
        at[0, robot] = starts[robot]
        if ends[robot] >= 0:
            everybody |= 1 << robot
            if starts[robot] == ends[robot]:
                been[0] |= 1 << robot
            left[0] += togo[robot, starts[robot]]
    driven[0] = 0.0
    count = 1
    heap = [(weight * left[0], left[0], 0)]
    last = -1
    while len(heap) > 0 and count < most - 1:
        state = heapq.heappop(heap)[2]
        if done[state]:
            continue
        done[state] = True
        if been[state] == everybody:
            last = state
            break
        for robot in range(robots):
            here = at[state, robot]
            was_there = been[state] >> robot & 1 == 1 or ends[robot] < 0
            for lane in range(begins[here], begins[here + 1]):
                if durations[robot, lane] == np.inf or count >= most - 1:
                    continue
                there = to[lane]
                if not was_there and togo[robot, there] == np.inf:
                    continue
                meets = False
                for other in range(robots):
                    if (
                        other != robot
                        and blocked[sizes[robot], sizes[other], lane, at[state, other]]
                    ):
                        meets = True
                        break
                if meets:
                    continue
                bits = been[state]
                more = left[state]
                if not was_there:
                    more += togo[robot, there] - togo[robot, here]
                    if there == ends[robot]:
                        bits |= 1 << robot
                after[:] = at[state]
                after[robot] = there
                for other in range(robots):
                    free = bits >> other & 1 == 1 or ends[other] < 0
                    kinds[other] = robots + sizes[other] if free else other
                bucket = bits
                for other in range(robots):
                    mixed = (after[other] * 64 + kinds[other] + 1) * 0x9E3779B1
                    bucket += (mixed ^ (mixed >> 15)) & 0x7FFFFFFF
                bucket &= BUCKETS - 1
                spent = driven[state] + durations[robot, lane]
                known = buckets[bucket]
                while known >= 0 and not (
                    been[known] == bits and is_same(at[known], after, kinds)
                ):
                    known = links[known, 3]
                if known >= 0 and (done[known] or driven[known] <= spent):
                    continue
                if known < 0:
                    known = count
                    count += 1
                    been[known] = bits
                    links[known, 3] = buckets[bucket]
                    buckets[bucket] = known
                at[known] = after  # robots that stand in for each other may have changed places
                driven[known], left[known] = spent, more
                links[known, 0], links[known, 1], links[known, 2] = state, robot, lane
                heapq.heappush(heap, (spent + weight * more, more, known))
    if last < 0:
        return -1, np.empty((0, 2), dtype=np.int64)
    length = 0
    state = last
    while links[state, 0] >= 0:
        length += 1
        state = links[state, 0]
    trail = np.empty((length, 2), dtype=np.int64)
    state = last
    for k in range(length - 1, -1, -1):
        trail[k, 0], trail[k, 1] = links[state, 1], links[state, 2]
        state = links[state, 0]
    return length, trail
