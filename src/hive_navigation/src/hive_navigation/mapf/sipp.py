# SPDX-License-Identifier: BSD-3-Clause
"""Safe interval path planning: the earliest arrival of one robot among reservations.

A state is a place, the lane by which the robot came, and the safe interval of the place in which
it did (Phillips and Likhachev, SIPP: Safe Interval Path Planning for Dynamic Environments, ICRA
2011). The lane gives the heading, so that turning takes time. For robots that turn at once the
lane does not matter, and a state is a place and an interval.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from hive_common.compiled import compiled

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from hive_common.geometry import Array, Indices

FOUND, PARTIAL, NOTHING = 2, 1, 0
STRAIGHT = 0.05  # a bend by less than this costs nothing [rad]


class Graph(NamedTuple):
    """A roadmap as a search for one kind of robot sees it.

    Attributes:
        begins: (n + e + 1,) the lanes from each place.
        legs: (n + e + 1,) the legs from each place, counted from the first leg.
        first_leg: The number of the first leg among the actions; see `conflicts`.
        to: (a,) where each lane and leg ends, by the number of its action.
        way: (a,) the number of its way among the things that are reserved.
        first_place: The number of the first place among them.
        node: (a,) the state that a robot is in at its end, without the interval.
        angles: (a,) its direction [rad].
        durations: (a,) time to drive it at full speed [s]; infinite where the robot does not fit.
        may_stop: (n + e,) whether a robot may wait at a place.
    """

    begins: Indices
    legs: Indices
    first_leg: int
    to: Indices
    way: Indices
    first_place: int
    node: Indices
    angles: Array
    durations: Array
    may_stop: NDArray[np.bool_]


class Workspace:
    """Memory for searches, so that none has to allocate and clear it."""

    def __init__(self, nodes: int, states: int) -> None:
        """Make room for searches over some nodes that make at most so many states."""
        self.first: Indices = np.full(nodes, -1, dtype=np.intp)
        self.times: Array = np.empty((states, 5))
        self.links: Indices = np.empty((states, 6), dtype=np.intp)
        self.heap_keys: Array = np.empty((states + 1, 2))
        self.heap: Indices = np.empty(states + 1, dtype=np.intp)


@compiled("float64(float64, float64)")
def bend(one: float, other: float) -> float:
    """Return the angle between two directions, 0..pi [rad]."""
    angle = abs(one - other) % (2.0 * math.pi)
    return min(angle, 2.0 * math.pi - angle)


@compiled("float64(float64, float64, float64)")
def turning(angle: float, turn: float, stand: float) -> float:
    """Return what a bend costs [s].

    Args:
        angle: By which it turns [rad].
        turn: Time to turn [s/rad].
        stand: What it costs to stop and drive on [s]; a bend by 90 degrees needs a stop, a
            slighter one is driven through at a lower speed.
    """
    if angle < STRAIGHT:
        return 0.0
    return angle * turn + stand * min(angle / (0.5 * math.pi), 1.0)


@compiled("int64(float64[:, ::1], int64[::1], int64, float64, float64, int64)")
def push(keys: Array, heap: Indices, size: int, key: float, tie: float, item: int) -> int:
    """Add an item to a binary heap of `size` items and return its new size."""
    at = size
    while at > 0:
        above = (at - 1) // 2
        if keys[above, 0] < key or (keys[above, 0] == key and keys[above, 1] <= tie):
            break
        keys[at, 0], keys[at, 1], heap[at] = keys[above, 0], keys[above, 1], heap[above]
        at = above
    keys[at, 0], keys[at, 1], heap[at] = key, tie, item
    return size + 1


@compiled("int64(float64[:, ::1], int64[::1], int64)")
def pop(keys: Array, heap: Indices, size: int) -> int:
    """Take the least item, `heap[0]`, from a binary heap and return its new size."""
    size -= 1
    key, tie, item = keys[size, 0], keys[size, 1], heap[size]
    at = 0
    while True:
        below = 2 * at + 1
        if below >= size:
            break
        if below + 1 < size and (
            keys[below + 1, 0] < keys[below, 0]
            or (keys[below + 1, 0] == keys[below, 0] and keys[below + 1, 1] < keys[below, 1])
        ):
            below += 1
        if key < keys[below, 0] or (key == keys[below, 0] and tie <= keys[below, 1]):
            break
        keys[at, 0], keys[at, 1], heap[at] = keys[below, 0], keys[below, 1], heap[below]
        at = below
    keys[at, 0], keys[at, 1], heap[at] = key, tie, item
    return size


@compiled("UniTuple(float64, 2)(int64, float64[:, ::1], int64[:, ::1], float64)")
def safe_interval(at: int, spans: Array, entries: Indices, time: float) -> tuple[float, float]:
    """Return the safe interval that a time is in; its begin is later if the time is in none."""
    low, high = -np.inf, np.inf
    while at >= 0:
        if spans[at, 0] > time and spans[at, 0] > low:
            high = spans[at, 0]
            break
        low = max(low, spans[at, 1])
        at = entries[at, 0]
    return low, high


@compiled(
    "Tuple((int64, float64, float64))(float64[:, ::1], int64[:, ::1], float64, int64, float64,"
    " float64)"
)
def safe_after(
    spans: Array, entries: Indices, soonest: float, at: int, low: float, high: float
) -> tuple[int, float, float]:
    """Return the first safe interval of a list that ends after a time.

    Args:
        spans: See `Reservations`.
        entries: Its `links`.
        soonest: The time [s].
        at: The span with which the last safe interval ended, at first the head of the list.
        low: When that interval began, at first minus infinity [s].
        high: When it ended, at first minus infinity [s].

    Returns:
        The same of the one that was looked for; it begins at infinity if there is none.
    """
    while high <= max(soonest, low) and high < np.inf and low < np.inf:
        if high > -np.inf:
            low = max(low, spans[at, 1])
            at = entries[at, 0]
        while at >= 0 and spans[at, 0] <= low:
            low = max(low, spans[at, 1])
            at = entries[at, 0]
        high = spans[at, 0] if at >= 0 else np.inf
    return at, low, high


@compiled(
    "UniTuple(int64, 2)(int64[::1], int64[::1], int64, int64[::1], int64[::1], int64, int64[::1],"
    " float64[::1], float64[::1], boolean[::1], int64[::1], float64[:, ::1], int64[:, ::1],"
    " int64[::1], float64[:, ::1], int64[:, ::1], float64[:, ::1], int64[::1], boolean[::1],"
    " float64[::1], int64, int64, float64, float64, float64, float64, float64, float64, float64,"
    " int64)"
)
def search(  # noqa: C901, D417, PLR0912, PLR0915  (an inner loop; calls with less hide its order)
    begins: Indices,
    legs: Indices,
    first_leg: int,
    to: Indices,
    way: Indices,
    first_place: int,
    node: Indices,
    angles: Array,
    durations: Array,
    may_stop: NDArray[np.bool_],
    heads: Indices,
    spans: Array,
    entries: Indices,
    first: Indices,
    times: Array,
    links: Indices,
    heap_keys: Array,
    heap: Indices,
    goals: NDArray[np.bool_],
    togo: Array,
    start: int,
    start_node: int,
    ready: float,
    heading: float,
    turn: float,
    stand: float,
    dwell: float,
    horizon: float,
    latest: float,
    limit: int,
) -> tuple[int, int]:
    """Find the earliest arrival at one of the goals, to stay there for some time.

    The columns of `times` are when a state is reached, when its safe interval begins and ends, and
    when the robot leaves the state before it; those of `links` are the state before, the lane from
    it, the place, the next state of the same node, whether it is done, and the node.

    Args:
        begins: See `Graph`, as all up to `may_stop`.
        heads: See `Reservations`, of the robot's size, as all up to `entries`.
        first: See `Workspace`, as all up to `heap`.
        goals: (n + e,) which places are goals.
        togo: (nodes + 1,) at most the time from each node to a goal [s].
        start: Where it is.
        start_node: The node of the start, which no lane leads to.
        ready: When it is there [s].
        heading: Its heading there [rad].
        turn: Time to turn [s/rad].
        stand: What it costs to stop and drive on [s].
        dwell: For how long it must be able to stay at its goal [s].
        horizon: From when on it may end at any place where it can stay for ever [s].
        latest: It gives up when no path leads to a goal by then, beyond its end alone [s]; without
            a horizon, it ends as near as it can by then.
        limit: Most states to look at.

    Returns:
        FOUND, PARTIAL (it cannot get to a goal in time, and ends as near as it can) or NOTHING,
        and the last state.
    """
    count = 0
    size = 0
    best = -1
    best_togo = np.inf
    done = 0
    last = -1
    status = NOTHING
    low, high = safe_interval(heads[first_place + start], spans, entries, ready)
    if low <= ready:
        times[0, 0], times[0, 1], times[0, 2], times[0, 3] = ready, low, high, ready
        links[0, 0], links[0, 1], links[0, 2] = -1, -1, start
        links[0, 3], links[0, 4], links[0, 5] = -1, 0, start_node
        first[start_node] = 0
        count = 1
        size = push(heap_keys, heap, size, ready + togo[start_node], 0.0, 0)
    while size > 0 and done < limit and count < len(times) - 64:
        if heap_keys[0, 0] > latest:
            if horizon < np.inf:
                best = -1
            break
        state = heap[0]
        size = pop(heap_keys, heap, size)
        if links[state, 4] != 0:
            continue
        links[state, 4] = 1
        done += 1
        here = links[state, 2]
        now, end = times[state, 0], times[state, 2]
        if goals[here] and end >= now + dwell:
            last, status = state, FOUND
            break
        if end == np.inf and (may_stop[here] or links[state, 0] < 0):
            if now >= horizon:
                last, status = state, PARTIAL
                break
            if togo[links[state, 5]] < best_togo - 1e-9:
                best, best_togo = state, togo[links[state, 5]]
        facing = heading if links[state, 1] < 0 else angles[links[state, 1]]
        lanes = begins[here + 1] - begins[here]
        for item in range(lanes + legs[here + 1] - legs[here]):
            lane = begins[here] + item
            if item >= lanes:
                lane = first_leg + legs[here] + item - lanes
            if durations[lane] == np.inf or togo[node[lane]] == np.inf:
                continue
            there = to[lane]
            turned = 0.0
            if turn > 0.0 or stand > 0.0:
                turned = turning(bend(facing, angles[lane]), turn, stand)
            at_once = now + turned
            soonest = at_once
            waits = may_stop[here] or links[state, 0] < 0
            place_at, way_at = heads[first_place + there], heads[way[lane]]
            place_low, way_low = -np.inf, -np.inf
            # Both lists of safe intervals are walked along together.
            place_high = -np.inf
            way_high = -np.inf
            while True:
                place_at, place_low, place_high = safe_after(
                    spans, entries, soonest, place_at, place_low, place_high
                )
                way_at, way_low, way_high = safe_after(
                    spans, entries, soonest, way_at, way_low, way_high
                )
                depart = max(soonest, place_low, way_low)
                if depart > end or depart == np.inf or (depart > at_once + 1e-9 and not waits):
                    break
                lost = max(0.0, min(depart - at_once, stand - turned))
                arrive = depart + durations[lane] + lost
                upper = min(place_high, way_high)
                if arrive <= upper:
                    key = node[lane]
                    other = first[key]
                    while other >= 0 and times[other, 1] != place_low:
                        other = links[other, 3]
                    better = True
                    if other >= 0:
                        better = times[other, 0] > arrive + 1e-9
                    if better:
                        if other >= 0:
                            # The old state stays where it is in the heap, and is passed over.
                            links[other, 4] = 1
                            times[other, 1] = np.nan
                        new = count
                        count += 1
                        times[new, 0], times[new, 1], times[new, 2] = arrive, place_low, place_high
                        times[new, 3] = depart
                        links[new, 0], links[new, 1], links[new, 2] = state, lane, there
                        links[new, 3], links[new, 4], links[new, 5] = first[key], 0, key
                        first[key] = new
                        if count < len(times) - 8:
                            size = push(heap_keys, heap, size, arrive + togo[key], togo[key], new)
                    # Later departures come to the same interval: on to the next one.
                    soonest = max(soonest, place_high)
                elif upper == np.inf:
                    break
                else:
                    soonest = max(soonest, upper)
                if soonest > end or count >= len(times) - 8:
                    break
    for state in range(count):
        first[links[state, 5]] = -1
    if status == NOTHING and best >= 0:
        last, status = best, PARTIAL
    return status, last


@compiled(
    "float64(int64[::1], int64[::1], int64, int64[::1], float64[::1], float64[::1], float64[::1],"
    " int64, float64, float64, float64)"
)
def time_onwards(  # noqa: D417  (the first ones are those of `Graph`)
    begins: Indices,
    legs: Indices,
    first_leg: int,
    node: Indices,
    angles: Array,
    durations: Array,
    togo: Array,
    place: int,
    heading: float,
    turn: float,
    stand: float,
) -> float:
    """Return how long a robot takes from a place to its goal if nobody is in its way [s].

    Args:
        begins: See `Graph`, as all up to `durations`.
        togo: (nodes + 1,) the time from each node to the goal [s].
        place: Where it is.
        heading: Its heading there [rad].
        turn: Time to turn [s/rad].
        stand: What it costs to stop and drive on [s].
    """
    least = np.inf
    lanes = begins[place + 1] - begins[place]
    for item in range(lanes + legs[place + 1] - legs[place]):
        lane = begins[place] + item
        if item >= lanes:
            lane = first_leg + legs[place] + item - lanes
        turned = 0.0
        if turn > 0.0 or stand > 0.0:
            turned = turning(bend(heading, angles[lane]), turn, stand)
        least = min(least, turned + durations[lane] + togo[node[lane]])
    return least


@compiled(
    "void(int64[::1], int64[::1], int64, int64[::1], int64[::1], float64[::1], float64[::1],"
    " float64[::1], int64, int64, float64, float64)"
)
def add_legs(  # noqa: D417  (the first ones are those of `Graph`)
    begins: Indices,
    legs: Indices,
    first_leg: int,
    to: Indices,
    node: Indices,
    angles: Array,
    durations: Array,
    togo: Array,
    start: int,
    goal: int,
    turn: float,
    stand: float,
) -> None:
    """Note the time to a goal from the end of each leg that leads to it, or away from a start.

    Args:
        begins: See `Graph`, as all up to `durations`.
        togo: (nodes + 1,) the time from each node of the roadmap to the goal [s].
        start: The place where a robot begins.
        goal: The place to which it drives.
        turn: Time to turn [s/rad].
        stand: What it costs to stop and drive on [s].
    """
    for leg in range(first_leg, len(to)):
        if to[leg] == goal:
            togo[node[leg]] = 0.0
    for leg in range(first_leg + legs[start], first_leg + legs[start + 1]):
        if to[leg] != goal:
            togo[node[leg]] = time_onwards(
                begins,
                legs,
                first_leg,
                node,
                angles,
                durations,
                togo,
                to[leg],
                angles[leg],
                turn,
                stand,
            )


@compiled("Tuple((int64[::1], float64[:, ::1]))(float64[:, ::1], int64[:, ::1], int64, int64)")
def trace(times: Array, links: Indices, last: int, standing: int) -> tuple[Indices, Array]:
    """Return what the robot does up to the last state of a search, and when.

    Args:
        times: See `search`.
        links: See `search`.
        last: The last state.
        standing: The number of the action to stand at the first place.

    Returns:
        Actions, standing and driving in turns, see `conflicts.Conflicts`; and from when to when
        [s], from ever for the first and for ever for the last.
    """
    steps = 0
    state = last
    while links[state, 0] >= 0:
        steps += 1
        state = links[state, 0]
    actions = np.empty(2 * steps + 1, dtype=np.int64)
    spans = np.empty((2 * steps + 1, 2))
    state = last
    until = np.inf
    for k in range(steps, 0, -1):
        actions[2 * k] = standing + links[state, 2]
        spans[2 * k, 0], spans[2 * k, 1] = times[state, 0], until
        until = times[state, 3]
        actions[2 * k - 1] = links[state, 1]
        spans[2 * k - 1, 0], spans[2 * k - 1, 1] = until, times[state, 0]
        state = links[state, 0]
    actions[0] = standing + links[state, 2]
    spans[0, 0], spans[0, 1] = -np.inf, until
    return actions, spans
