# SPDX-License-Identifier: BSD-3-Clause
"""How long a robot takes to its goal when nobody is in its way: the search's lower bound."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from hive_common.compiled import compiled

if TYPE_CHECKING:
    from hive_common.geometry import Array, Indices

STRAIGHT = 0.05  # a bend by less than this costs nothing [rad]; as in `sipp`


@compiled("float64(float64, float64, float64, float64)")
def turning(one: float, other: float, turn: float, stand: float) -> float:
    """Return what a bend costs [s]; see `sipp.turning`."""
    angle = abs(one - other) % (2.0 * math.pi)
    angle = min(angle, 2.0 * math.pi - angle)
    if angle < STRAIGHT:
        return 0.0
    return angle * turn + stand * min(angle / (0.5 * math.pi), 1.0)


@compiled("int64(float64[::1], int64[::1], int64[::1], int64, int64)")
def raised(keys: Array, heap: Indices, index: Indices, size: int, item: int) -> int:
    """Move an item up whose key became less, or add it; return the heap's size."""
    at = index[item]
    if at < 0:
        at = size
        size += 1
    while at > 0:
        above = (at - 1) // 2
        if keys[heap[above]] <= keys[item]:
            break
        heap[at] = heap[above]
        index[heap[at]] = at
        at = above
    heap[at] = item
    index[item] = at
    return size


@compiled("int64(float64[::1], int64[::1], int64[::1], int64)")
def lowered(keys: Array, heap: Indices, index: Indices, size: int) -> int:
    """Take the least item from a heap and return its new size."""
    size -= 1
    item = heap[size]
    at = 0
    while True:
        below = 2 * at + 1
        if below >= size:
            break
        if below + 1 < size and keys[heap[below + 1]] < keys[heap[below]]:
            below += 1
        if keys[item] <= keys[heap[below]]:
            break
        heap[at] = heap[below]
        index[heap[at]] = at
        at = below
    heap[at] = item
    index[item] = at
    return size


@compiled(
    "float64[::1](int64[::1], int64[::1], int64[::1], float64[::1], int64[::1], float64[::1])"
)
def times_by_place(
    into: Indices, lanes_in: Indices, from_: Indices, durations: Array, exits: Indices, last: Array
) -> Array:
    """Return the time from each place to the goal for a robot that turns at once [s].

    Args:
        into: (n + 1,) the lanes to place i are `lanes_in[into[i]:into[i + 1]]`.
        lanes_in: (m,) numbers of lanes in the order of where they end.
        from_: (m,) where each lane begins.
        durations: (m,) time to drive each lane [s].
        exits: (k,) the places from which the goal is reached straight; the goal itself if it is
            a place.
        last: (k,) time from each of them to the goal [s].
    """
    count = len(into) - 1
    times = np.full(count, np.inf)
    heap = np.empty(count, dtype=np.int64)
    index = np.full(count, -1, dtype=np.int64)
    size = 0
    for k in range(len(exits)):
        if last[k] < times[exits[k]]:
            times[exits[k]] = last[k]
            size = raised(times, heap, index, size, exits[k])
    while size > 0:
        place = heap[0]
        size = lowered(times, heap, index, size)
        index[place] = -1
        for k in range(into[place], into[place + 1]):
            lane = lanes_in[k]
            time = times[place] + durations[lane]
            if time < times[from_[lane]]:
                times[from_[lane]] = time
                size = raised(times, heap, index, size, from_[lane])
    return times


@compiled(
    "float64[::1](int64[::1], int64[::1], int64[::1], float64[::1], float64[::1], int64[::1],"
    " float64[::1], float64[::1], float64, float64)"
)
def times_by_lane(
    into: Indices,
    lanes_in: Indices,
    from_: Indices,
    durations: Array,
    angles: Array,
    exits: Indices,
    last: Array,
    headings: Array,
    turn: float,
    stand: float,
) -> Array:
    """Return the time to the goal from the end of each lane, for a robot that came along it [s].

    Args:
        into: See `times_by_place`.
        lanes_in: See there.
        from_: See there.
        durations: See there.
        angles: (m,) direction of each lane [rad].
        exits: See there.
        last: See there.
        headings: (k,) direction from each of them to the goal [rad]; NaN at the goal itself.
        turn: Time to turn [s/rad].
        stand: What it costs to stop and drive on [s].
    """
    count = len(from_)
    times = np.full(count, np.inf)
    heap = np.empty(count, dtype=np.int64)
    index = np.full(count, -1, dtype=np.int64)
    size = 0
    for exit_ in range(len(exits)):
        for k in range(into[exits[exit_]], into[exits[exit_] + 1]):
            lane = lanes_in[k]
            if durations[lane] == np.inf:
                continue
            time = last[exit_]
            if not np.isnan(headings[exit_]):
                time += turning(angles[lane], headings[exit_], turn, stand)
            if time < times[lane]:
                times[lane] = time
                size = raised(times, heap, index, size, lane)
    while size > 0:
        lane = heap[0]
        size = lowered(times, heap, index, size)
        index[lane] = -1
        for k in range(into[from_[lane]], into[from_[lane] + 1]):
            before = lanes_in[k]
            if durations[before] == np.inf:
                continue
            bend = turning(angles[before], angles[lane], turn, stand)
            time = times[lane] + durations[lane] + bend
            if time < times[before]:
                times[before] = time
                size = raised(times, heap, index, size, before)
    return times
