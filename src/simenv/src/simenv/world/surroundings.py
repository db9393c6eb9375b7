# SPDX-License-Identifier: BSD-3-Clause
"""What is near a place besides robots: walls, which never change, and obstacles."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, NamedTuple, TypeAlias

import numpy as np

from hive_common.compiled import compiled
from simenv.world.obstacles import Obstacles

if TYPE_CHECKING:
    from hive_common.geometry import Array, Indices
    from simenv.world.world import World

    Table: TypeAlias = tuple[Array, Indices, Indices, Indices, Indices, Indices]  # of `Walls`
    Solid: TypeAlias = tuple[Array, Indices, Array]  # edges, ends and circles of `Obstacles`

WALLS = 0  # the number of the walls in `Near.things`
SQUARE = 1.0  # side of the squares by which walls are found [m]


class Near(NamedTuple):
    """Segments near m places, place by place."""

    segments: Array  # (k, 2, 2) frame map [m]
    things: Indices  # (k,) what each belongs to: `WALLS`, or 1 + the index of the obstacle
    starts: Indices  # (m + 1,) where those of each place begin


class Walls:
    """Segments that do not move, found by the squares of the plane that they may cross.

    Attributes:
        segments: (k, 2, 2) frame map [m].
        squares: (k, 2) the lowest column and row of each segment.
        size: (2,) columns and rows of the table.
        corner: (2,) lowest column and row of the plane that the table holds.
        first: Where the list of each square begins; one more than there are squares.
        listed: The segments of all squares, square by square.
    """

    def __init__(self, segments: Array) -> None:
        """Take segments (k, 2, 2), frame map [m]."""
        self.segments = np.ascontiguousarray(segments)
        ends = np.floor(np.concatenate([segments, np.zeros((1, 2, 2))]) / SQUARE).astype(np.int64)
        self.corner = ends.min(axis=(0, 1))
        ends -= self.corner
        self.size = ends.max(axis=(0, 1)) + 1
        low, high = ends[:-1].min(axis=1), ends[:-1].max(axis=1)  # without the one for no walls
        self.squares = low
        wide, deep = (high - low + 1).T
        number = wide * deep
        which = np.arange(len(segments)).repeat(number)
        step = np.arange(number.sum()) - (number.cumsum() - number).repeat(number)
        square = (low[which, 0] + step % wide[which]) * self.size[1]
        square += low[which, 1] + step // wide[which]
        order = square.argsort(kind="stable")
        self.listed = which[order]
        self.first = np.searchsorted(square[order], np.arange(self.size.prod() + 1))


class Surroundings:
    """Everything solid in a world besides robots."""

    def __init__(self, world: World) -> None:
        """Begin as the world's file says."""
        self._walls = Walls(world.segments)  # what never changes
        self.obstacles = Obstacles(world)  # people, doors, and other things in the way

    def near(self, places: Array, reaches: Array) -> Near:
        """Return all segments within `reaches` (m,) [m] of m places, and some more.

        `places` is (m, 2) or has further columns; x and y come first, frame map [m].
        """
        walls, others = self._walls, self.obstacles
        found = _near(
            places,
            reaches,
            walls.segments,
            walls.squares,
            walls.size,
            walls.corner,
            walls.first,
            walls.listed,
            others.edges,
            others.ends,
            others.circles,
        )
        return Near(*found)


@compiled()
def _add_walls(
    x: float, y: float, reach: float, table: Table, count: int, found: Array, things: Indices
) -> int:
    """Put the walls near a place behind the `count` segments in `found`; return the new count.

    What has no room in `found` is only counted.
    """
    segments, squares, size, corner, first, listed = table
    left = max(math.floor((x - reach) / SQUARE) - corner[0], 0)
    right = min(math.floor((x + reach) / SQUARE) - corner[0], size[0] - 1)
    low = max(math.floor((y - reach) / SQUARE) - corner[1], 0)
    high = min(math.floor((y + reach) / SQUARE) - corner[1], size[1] - 1)
    for column in range(left, right + 1):
        for row in range(low, high + 1):
            square = column * size[1] + row
            for wall in listed[first[square] : first[square + 1]]:
                if max(squares[wall, 0], left) != column or max(squares[wall, 1], low) != row:
                    continue  # it is in several squares, and came with the first of these
                if count < len(found):
                    found[count], things[count] = segments[wall], WALLS
                count += 1
    return count


@compiled()
def _add_obstacles(
    x: float, y: float, reach: float, obstacles: Solid, count: int, found: Array, things: Indices
) -> int:
    """Do with the obstacles near a place what `_add_walls` does with walls."""
    edges, ends, circles = obstacles
    for i in range(len(circles)):
        if math.hypot(circles[i, 0] - x, circles[i, 1] - y) > reach + circles[i, 2]:
            continue
        for edge in range(ends[i], ends[i + 1]):
            if count < len(found):
                found[count], things[count] = edges[edge], 1 + i
            count += 1
    return count


@compiled(
    "Tuple((float64[:, :, ::1], int64[::1], int64[::1]))(float64[:, ::1], float64[::1],"
    " float64[:, :, ::1], int64[:, ::1], int64[::1], int64[::1], int64[::1], int64[::1],"
    " float64[:, :, ::1], int64[::1], float64[:, ::1])"
)
def _near(
    places: Array,
    reaches: Array,
    segments: Array,
    squares: Indices,
    size: Indices,
    corner: Indices,
    first: Indices,
    listed: Indices,
    edges: Array,
    ends: Indices,
    circles: Array,
) -> tuple[Array, Indices, Indices]:
    """Return the fields of `Near`; see `Walls` and `Obstacles` for the tables."""
    table = (segments, squares, size, corner, first, listed)
    obstacles = (edges, ends, circles)
    starts = np.zeros(len(places) + 1, dtype=np.int64)
    found = np.empty((0, 2, 2))
    things = np.empty(0, dtype=np.int64)
    for _ in range(2):  # count first
        for i in range(len(places)):
            x, y, reach = places[i, 0], places[i, 1], reaches[i]
            count = _add_walls(x, y, reach, table, starts[i], found, things)
            starts[i + 1] = _add_obstacles(x, y, reach, obstacles, count, found, things)
        if len(found) < starts[-1]:
            found = np.empty((starts[-1], 2, 2))
            things = np.empty(starts[-1], dtype=np.int64)
    return found, things, starts
