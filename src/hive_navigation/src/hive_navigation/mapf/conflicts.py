# SPDX-License-Identifier: BSD-3-Clause
"""What a robot blocks for another one, at each place and along each lane of a roadmap.

Ways and places are what robots reserve. A way is a lane or its reverse lane. A robot that stands
blocks every place and way that is nearer to it than both radii and the gap; one that drives along
a lane blocks for the whole drive what is that near to any part of it. So no two drives that could
touch overlap in time, and that is what an order of robots at places can ensure
(`dependency_graph.py`).

The things that are reserved are numbered: the w ways, the n places, then the ends of a plan, then
their legs. So are the actions of a robot: to drive along one of the m lanes, to stand at a place,
to stand at an end, to drive along a leg.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

from hive_common.compiled import compiled

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from hive_common.geometry import Array, Indices
    from hive_navigation.mapf.ends import Ends
    from hive_navigation.mapf.roadmap import Roadmap

ROW = 0.5  # height of the rows in which segments are looked up [m]
TINY = 1e-6  # robots that are this much too near to each other do not touch [m]


@dataclass(frozen=True)
class Conflicts:
    """What a robot that stands or drives blocks for another one.

    Attributes:
        begins: (actions + 1,) array: action a blocks `blocked[begins[a]:begins[a + 1]]`.
        blocked: Numbers of things.
    """

    begins: Indices
    blocked: Indices

    @cached_property
    def most(self) -> int:
        """How many things an action blocks at most."""
        return int(np.diff(self.begins).max(initial=0))


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
    number = ways(roadmap)
    things = int(number.max(initial=-1)) + 1
    driven = np.column_stack([number, things + roadmap.lanes[:, 1]]).reshape(-1)
    blocked = np.concatenate([driven, things + np.arange(count)])
    begins = np.concatenate([2 * np.arange(lanes), 2 * lanes + np.arange(count + 1)])
    return Conflicts(begins.astype(np.intp), blocked.astype(np.intp))


class Lines:
    """Straight lines that are looked up by where they are.

    Attributes:
        lines: (k, 4) their ends, x, y, x, y, frame map [m].
    """

    def __init__(self, lines: Array) -> None:
        self.lines = lines
        rows = np.floor((lines[:, 1] + lines[:, 3]) / 2 / ROW)
        middles = (lines[:, 0] + lines[:, 2]) / 2
        self._order = np.lexsort((middles, rows))
        self._sorted = np.ascontiguousarray(lines[self._order])
        self._middles = middles[self._order]
        self._lowest = int(rows.min()) if len(rows) else 0
        every = self._lowest + np.arange(int(np.ptp(rows)) + 2 if len(rows) else 1)
        self._begins: Indices = np.searchsorted(rows[self._order], every)
        self._wide = float(np.abs(lines[:, 0] - lines[:, 2]).max(initial=0.0)) / 2
        self._high = float(np.abs(lines[:, 1] - lines[:, 3]).max(initial=0.0)) / 2

    def __len__(self) -> int:
        return len(self.lines)

    def near(self, lines: Array, limits: Array) -> tuple[Indices, Indices]:
        """Return which of some lines, (n, 4), are nearer than their limits, (n,) [m], to which."""
        one, other = _nearer(
            np.ascontiguousarray(lines),
            limits,
            self._sorted,
            self._middles,
            self._begins,
            self._lowest,
            self._wide,
            self._high,
        )
        return one, self._order[other]


class SpatialConflicts:
    """The conflicts of robots on one roadmap that must stay some distance from each other."""

    def __init__(self, roadmap: Roadmap, number: Indices, apart: float) -> None:
        """Find them.

        Args:
            roadmap: Where the robots drive.
            number: Of each lane's way.
            apart: Distance that robots keep, centre to centre [m].
        """
        self._limit = max(apart - TINY, 0.0)
        begin, end = roadmap.places[roadmap.lanes[:, 0]], roadmap.places[roadmap.lanes[:, 1]]
        first = np.unique(number, return_index=True)[1]
        self._things = len(first) + len(roadmap.places)
        self._actions = len(roadmap.lanes) + len(roadmap.places)
        # A place is a lane of no length, so one calculation does for both.
        standing = np.hstack([roadmap.places, roadmap.places])
        things = np.vstack([np.hstack([begin[first], end[first]]), standing])
        self._lines = Lines(things)
        self._users = np.full((self._things, 2), -1, dtype=np.intp)
        lanes = np.argsort(number, kind="stable")
        again = np.flatnonzero(np.diff(number[lanes], prepend=-1) == 0)
        self._users[number[lanes], 0] = lanes
        self._users[number[lanes[again]], 1] = lanes[again - 1]
        self._users[len(first) :, 0] = len(roadmap.lanes) + np.arange(len(roadmap.places))
        near, blocked = self._near(things, self._lines)
        self.fixed = _rows(near, blocked, self._users, self._actions)

    def _near(self, lines: Array, others: Lines) -> tuple[Indices, Indices]:
        """Return which lines (k, 4) are too near to which others."""
        return others.near(lines, np.full(len(lines), self._limit))

    def with_ends(self, ends: Ends, places: Array, crowded: Indices) -> Conflicts:
        """Return what is more in a plan with ends.

        Args:
            ends: Of the plan.
            places: (n + e, 2) of all places, frame map [m].
            crowded: (e,) which robot begins at an end where others are too near; -1 for none.
                It may leave them as long as it comes no nearer to them.
        """
        count = len(ends.points)
        standing = np.hstack([ends.points, ends.points])
        driving = np.hstack([places[ends.legs[:, 0]], places[ends.legs[:, 1]]])
        lines = np.vstack([standing, driving])
        one, thing = self._near(lines, self._lines)
        mine, other = self._near(lines, Lines(lines))
        if (crowded >= 0).any():
            begins = np.where(
                np.arange(len(lines)) < count,
                np.arange(len(lines)),
                np.concatenate([np.arange(count), ends.legs[:, 0] - (len(places) - count)]),
            )
            kept = _still_too_near(lines, mine, other, begins, crowded, count)
            mine, other = mine[kept], other[kept]
        total = self._actions + len(lines)
        users = self._users[thing]
        rows = [users[:, 0], users[users[:, 1] >= 0, 1], self._actions + one, self._actions + mine]
        blocked = [
            self._things + one,
            self._things + one[users[:, 1] >= 0],
            thing,
            self._things + other,
        ]
        return _table(np.concatenate(rows), np.concatenate(blocked), total)


def _rows(near: Indices, blocked: Indices, users: Indices, actions: int) -> Conflicts:
    """Return the conflicts of all actions that use things `near`, (k,), which block others."""
    both = users[near]
    back = both[:, 1] >= 0
    return _table(
        np.concatenate([both[:, 0], both[back, 1]]),
        np.concatenate([blocked, blocked[back]]),
        actions,
    )


def _table(rows: Indices, blocked: Indices, actions: int) -> Conflicts:
    """Return the conflicts in which action `rows[k]` blocks `blocked[k]`."""
    begins = np.concatenate([[0], np.cumsum(np.bincount(rows, minlength=actions))])
    return Conflicts(begins.astype(np.intp), _sorted(rows, blocked, begins[:-1].copy()))


@compiled("int64[::1](int64[::1], int64[::1], int64[::1])")
def _sorted(rows: Indices, items: Indices, at: Indices) -> Indices:
    """Return items in the order of their rows; row r begins at `at[r]`, which is counted up."""
    found = np.empty_like(items)
    for k in range(len(rows)):
        found[at[rows[k]]] = items[k]
        at[rows[k]] += 1
    return found


@compiled("float64(float64, float64, float64, float64, float64, float64)")
def _side(ax: float, ay: float, bx: float, by: float, x: float, y: float) -> float:
    """Return on which side of the line ab a point is: positive on the left."""
    return (bx - ax) * (y - ay) - (by - ay) * (x - ax)


@compiled("float64(float64, float64, float64, float64, float64, float64)")
def _squared(x: float, y: float, ax: float, ay: float, bx: float, by: float) -> float:
    """Return the square of the distance of a point from a segment ab [m^2]."""
    along_x, along_y = bx - ax, by - ay
    squared = along_x * along_x + along_y * along_y
    share = 0.0
    if squared > 0:
        share = min(1.0, max(0.0, ((x - ax) * along_x + (y - ay) * along_y) / squared))
    off_x, off_y = x - ax - share * along_x, y - ay - share * along_y
    return off_x * off_x + off_y * off_y


@compiled(
    "boolean(float64, float64, float64, float64, float64, float64, float64, float64, float64)"
)
def _are_near(
    ax: float,
    ay: float,
    bx: float,
    by: float,
    cx: float,
    cy: float,
    dx: float,
    dy: float,
    limit: float,
) -> bool:
    """Return whether segments ab and cd are nearer to each other than `limit` [m]."""
    if max(ay, by) + limit < min(cy, dy) or max(cy, dy) + limit < min(ay, by):
        return False
    if max(ax, bx) + limit < min(cx, dx) or max(cx, dx) + limit < min(ax, bx):
        return False
    enough = limit * limit
    return (
        _squared(ax, ay, cx, cy, dx, dy) < enough
        or _squared(bx, by, cx, cy, dx, dy) < enough
        or _squared(cx, cy, ax, ay, bx, by) < enough
        or _squared(dx, dy, ax, ay, bx, by) < enough
        or (
            _side(ax, ay, bx, by, cx, cy) * _side(ax, ay, bx, by, dx, dy) < 0
            and _side(cx, cy, dx, dy, ax, ay) * _side(cx, cy, dx, dy, bx, by) < 0
        )
    )


@compiled(
    "Tuple((int64[::1], int64[::1]))(float64[:, ::1], float64[::1], float64[:, ::1], float64[::1],"
    " int64[::1], int64, float64, float64)"
)
def _nearer(
    segments: Array,
    limits: Array,
    others: Array,
    middles: Array,
    begins: Indices,
    lowest: int,
    wide: float,
    high: float,
) -> tuple[Indices, Indices]:
    """Return which segments (k, 4) are nearer than their limits (k,) [m] to which others.

    Args:
        segments: x, y, x, y [m].
        limits: [m]
        others: (n, 4) ordered by the rows, `ROW` high, and by the x of their middles.
        middles: (n,) these x [m].
        begins: Row r has the others from `begins[r - lowest]` to `begins[r - lowest + 1]`.
        lowest: The first row.
        wide: How far the others reach from their middles along x, at most [m].
        high: The same along y [m].
    """
    size, found = 1024, 0
    first, second = np.empty(size, np.int64), np.empty(size, np.int64)
    for i in range(len(segments)):
        ax, ay, bx, by = segments[i]
        limit = limits[i]
        reach = abs(ax - bx) / 2 + wide + limit
        up = abs(ay - by) / 2 + high + limit
        x, y = (ax + bx) / 2, (ay + by) / 2
        row = max(int(np.floor((y - up) / ROW)) - lowest, 0)
        last = min(int(np.floor((y + up) / ROW)) - lowest, len(begins) - 2)
        while row <= last:
            end = begins[row + 1]
            k = begins[row] + np.searchsorted(middles[begins[row] : end], x - reach)
            while k < end and middles[k] <= x + reach:
                cx, cy, dx, dy = others[k, 0], others[k, 1], others[k, 2], others[k, 3]
                if _are_near(ax, ay, bx, by, cx, cy, dx, dy, limit):
                    if found == size:
                        size *= 2
                        first = np.concatenate((first, np.empty_like(first)))
                        second = np.concatenate((second, np.empty_like(second)))
                    first[found], second[found] = i, k
                    found += 1
                k += 1
            row += 1
    return first[:found].copy(), second[:found].copy()


@compiled("boolean[::1](float64[:, ::1], int64[::1], int64[::1], int64[::1], int64[::1], int64)")
def _still_too_near(
    lines: Array, mine: Indices, other: Indices, begins: Indices, crowded: Indices, ends: int
) -> NDArray[np.bool_]:
    """Return which conflicts between ends and legs hold where robots begin too near together.

    Args:
        lines: (k, 4) of ends and of legs.
        mine: (p,) one line of each conflict.
        other: (p,) the other line.
        begins: (k,) the end at which a line begins; negative for a leg that leads to an end.
        crowded: See `SpatialConflicts.with_ends`.
        ends: How many ends there are.
    """
    kept = np.ones(len(mine), dtype=np.bool_)
    for k in range(len(mine)):
        a, b = mine[k], other[k]
        one, two = begins[a], begins[b]
        if one < 0 or two < 0 or one == two or crowded[one] < 0 or crowded[two] < 0:
            continue
        if a >= ends and b >= ends:
            continue
        between = math.hypot(lines[one, 0] - lines[two, 0], lines[one, 1] - lines[two, 1])
        kept[k] = _are_near(
            lines[a, 0],
            lines[a, 1],
            lines[a, 2],
            lines[a, 3],
            lines[b, 0],
            lines[b, 1],
            lines[b, 2],
            lines[b, 3],
            max(between - 1e-6, 0.0),
        )
    return kept
