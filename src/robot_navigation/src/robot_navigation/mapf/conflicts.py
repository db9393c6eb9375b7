# SPDX-License-Identifier: BSD-3-Clause
"""What a robot blocks for another one, at each place and along each lane of a roadmap.

Places and ways are what robots reserve. A way is a lane or its reverse lane; way k has the number
n + k, behind the n places. A robot that stands blocks every place and way that is nearer to it
than both radii and the gap; one that drives along a lane blocks for the whole drive what is that
near to any part of it. So no two drives that could touch overlap in time, and that is what
an order of robots at places can ensure (`dependency_graph.py`).
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from hive_common.compiled import compiled

if TYPE_CHECKING:
    from hive_common.geometry import Array, Indices
    from robot_navigation.mapf.roadmap import Roadmap

ROW = 0.5  # height of the rows in which segments are looked up [m]
TINY = 1e-6  # robots that are this much too near to each other do not touch [m]


@dataclass(frozen=True)
class Conflicts:
    """What a robot that stands or drives blocks for another one.

    An action is standing at place i, number i, or driving along lane k, number n + k.

    Attributes:
        begins: (n + m + 1,) array: action a blocks `blocked[begins[a]:begins[a + 1]]`.
        blocked: Numbers of places and ways.
    """

    begins: Indices
    blocked: Indices


def ways(roadmap: Roadmap) -> Indices:
    """Return the number of each lane's way, (m,), from 0; a lane shares it with its reverse."""
    pairs = np.sort(roadmap.lanes, axis=1)
    keys = pairs[:, 0] * len(roadmap.places) + pairs[:, 1]
    numbers: Indices = np.unique(keys, return_inverse=True)[1].astype(np.intp)
    return numbers


def classical_conflicts(roadmap: Roadmap) -> Conflicts:
    """Return the conflicts of the classical problem: no two robots at a place, none swap places.

    A robot may drive to a place while another one leaves it (Stern et al., Multi-Agent
    Pathfinding: Definitions, Variants, and Benchmarks, SoCS 2019).
    """
    count, lanes = len(roadmap.places), len(roadmap.lanes)
    blocked = np.column_stack([roadmap.lanes[:, 1], count + ways(roadmap)]).reshape(-1)
    begins = np.concatenate([np.arange(count), count + 2 * np.arange(lanes + 1)])
    everything = np.concatenate([np.arange(count), blocked])
    return Conflicts(begins.astype(np.intp), everything.astype(np.intp))


def spatial_conflicts(roadmap: Roadmap, apart: float) -> Conflicts:
    """Return what robots block that must stay `apart` from each other, centre to centre [m]."""
    limit = max(apart - TINY, 0.0)
    number = ways(roadmap)
    first = np.unique(number, return_index=True)[1]
    begin, end = roadmap.places[roadmap.lanes[:, 0]], roadmap.places[roadmap.lanes[:, 1]]
    # A place is a lane of no length, so one calculation does for both.
    from_ = np.vstack([roadmap.places, begin])
    to = np.vstack([roadmap.places, end])
    one_end = np.vstack([roadmap.places, begin[first]])
    other_end = np.vstack([roadmap.places, end[first]])
    middles = (one_end + other_end) / 2
    rows = np.floor(middles[:, 1] / ROW).astype(np.int64)
    order = np.lexsort((middles[:, 0], rows))
    lines = np.hstack([one_end, other_end])[order]
    actions, things = _nearer(np.hstack([from_, to]), lines, limit)
    things = order[things]
    order = np.lexsort((things, actions))
    actions, things = actions[order], things[order]
    begins = np.searchsorted(actions, np.arange(len(from_) + 1))
    return Conflicts(begins.astype(np.intp), things.astype(np.intp))


@compiled("float64(float64, float64, float64, float64, float64, float64)")
def _to_segment(x: float, y: float, ax: float, ay: float, bx: float, by: float) -> float:
    """Return the distance of a point from a segment ab [m]."""
    along_x, along_y = bx - ax, by - ay
    squared = along_x * along_x + along_y * along_y
    share = 0.0
    if squared > 0:
        share = min(1.0, max(0.0, ((x - ax) * along_x + (y - ay) * along_y) / squared))
    return math.hypot(x - ax - share * along_x, y - ay - share * along_y)


@compiled("float64(float64, float64, float64, float64, float64, float64)")
def _side(ax: float, ay: float, bx: float, by: float, x: float, y: float) -> float:
    """Return on which side of the line ab a point is: positive on the left."""
    return (bx - ax) * (y - ay) - (by - ay) * (x - ax)


@compiled(
    "float64(float64, float64, float64, float64, float64, float64, float64, float64, float64)"
)
def _apart(
    ax: float,
    ay: float,
    bx: float,
    by: float,
    cx: float,
    cy: float,
    dx: float,
    dy: float,
    limit: float,
) -> float:
    """Return the distance of segments ab and cd [m]; `limit` where it is more."""
    if max(ay, by) + limit < min(cy, dy) or max(cy, dy) + limit < min(ay, by):
        return limit
    if max(ax, bx) + limit < min(cx, dx) or max(cx, dx) + limit < min(ax, bx):
        return limit
    if (
        _side(ax, ay, bx, by, cx, cy) * _side(ax, ay, bx, by, dx, dy) < 0
        and _side(cx, cy, dx, dy, ax, ay) * _side(cx, cy, dx, dy, bx, by) < 0
    ):
        return 0.0
    return min(
        _to_segment(ax, ay, cx, cy, dx, dy),
        _to_segment(bx, by, cx, cy, dx, dy),
        _to_segment(cx, cy, ax, ay, bx, by),
        _to_segment(dx, dy, ax, ay, bx, by),
        limit,
    )


@compiled("Tuple((int64[::1], int64[::1]))(float64[:, ::1], float64[:, ::1], float64)")
def _nearer(segments: Array, others: Array, limit: float) -> tuple[Indices, Indices]:
    """Return which segments (k, 4) are nearer than `limit` [m] to which others.

    The others are ordered by the rows, `ROW` high, and by the x of their middles.
    """
    middles = (others[:, 0] + others[:, 2]) / 2
    rows = np.floor((others[:, 1] + others[:, 3]) / 2 / ROW)
    wide, high = 0.0, 0.0
    for k in range(len(others)):
        wide = max(wide, abs(others[k, 0] - others[k, 2]) / 2)
        high = max(high, abs(others[k, 1] - others[k, 3]) / 2)
    size, found = 1024, 0
    first, second = np.empty(size, np.int64), np.empty(size, np.int64)
    for i in range(len(segments)):
        ax, ay, bx, by = segments[i]
        reach = abs(ax - bx) / 2 + wide + limit
        up = abs(ay - by) / 2 + high + limit
        x, y = (ax + bx) / 2, (ay + by) / 2
        row, last = np.floor((y - up) / ROW), np.floor((y + up) / ROW)
        while row <= last:
            begin, end = np.searchsorted(rows, row), np.searchsorted(rows, row, side="right")
            k = begin + np.searchsorted(middles[begin:end], x - reach)
            while k < end and middles[k] <= x + reach:
                cx, cy, dx, dy = others[k]
                if _apart(ax, ay, bx, by, cx, cy, dx, dy, limit) < limit:
                    if found == size:
                        size *= 2
                        first = np.concatenate((first, np.empty_like(first)))
                        second = np.concatenate((second, np.empty_like(second)))
                    first[found], second[found] = i, k
                    found += 1
                k += 1
            row += 1
    return first[:found].copy(), second[:found].copy()
