# SPDX-License-Identifier: BSD-3-Clause
"""The reference for planned paths: the shortest ones, found without the planner.

It is Dijkstra's algorithm on a grid with moves to 32 neighbours, pulled taut afterwards. It is at
most about 1 % longer than the shortest any-angle path.
"""

from __future__ import annotations

import itertools
import math
from typing import TYPE_CHECKING, Any

import numpy as np
from scipy import sparse
from scipy.sparse import csgraph

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

    from numpy.typing import NDArray

    from hive_navigation.planning.clearance import ClearanceField

Point = tuple[float, float]

REACH = 4  # largest move of the reference [cells]; 4 gives 32 directions


def random_pairs(
    shortest: ShortestPaths, pairs: int, seed: int
) -> Iterator[tuple[Point, Point, float]]:
    """Yield starts, goals and the lengths of the shortest paths between them [m].

    Pairs closer than 1 m are left out: a ratio of such lengths says little.
    """
    random = np.random.default_rng(seed)
    made = 0
    while made < pairs:
        start = shortest.random_place(random)
        length_to = shortest.lengths_from(start)
        # Several goals for one start: the reference's search is the slow part.
        for _ in range(10):
            goal = shortest.random_place(random)
            length = length_to(goal)
            if made < pairs and 1.0 <= length < math.inf:
                made += 1
                yield start, goal, length


def path_length(corners: list[Point]) -> float:
    """Return the length of a path [m]."""
    return sum(math.dist(a, b) for a, b in itertools.pairwise(corners))


class ShortestPaths:
    """The reference: shortest paths on the free cells of a map."""

    def __init__(self, field: ClearanceField, need: float, goal_need: float) -> None:
        self.field = field
        self.need = need
        self._places = np.flatnonzero(field.clearance >= goal_need)
        self._free = field.clearance >= need
        self._graph = _grid_graph(self._free, field.grid.resolution)

    def random_place(self, random: np.random.Generator) -> Point:
        """Return the centre of a random cell where the robot may stand, frame map [m]."""
        return self._place(int(random.choice(self._places)))

    def lengths_from(self, start: Point) -> Callable[[Point], float]:
        """Return the length of the shortest path from a place as a function of the goal [m].

        It is infinite if there is no path.
        """
        distances, before = csgraph.dijkstra(
            self._graph, indices=self._cell(start), return_predecessors=True
        )

        def length_to(goal: Point) -> float:
            cell = self._cell(goal)
            if not math.isfinite(distances[cell]):
                return math.inf
            cells = [cell]
            while before[cells[-1]] >= 0:
                cells.append(int(before[cells[-1]]))
            return min(float(distances[cell]), self.taut(cells[::-1]))

        return length_to

    def taut(self, cells: list[int]) -> float:
        """Return the length of a path pulled taut [m]."""
        points = [self._place(cell) for cell in cells]
        length = math.inf
        # Each pass drops every corner that its neighbours can see past.
        while path_length(points) < length - 1e-6:
            length = path_length(points)
            points = self._pulled(points)
        return length

    def _pulled(self, points: list[Point]) -> list[Point]:
        kept = [points[0]]
        at = 0
        while at < len(points) - 1:
            ahead = np.array(points[at + 1 :])
            clear = self.field.lines_are_clear(
                np.repeat([points[at]], len(ahead), axis=0), ahead, self.need
            )
            seen = np.flatnonzero(clear)
            at += 1 + (int(seen[-1]) if len(seen) else 0)
            kept.append(points[at])
        return kept

    def _cell(self, place: Point) -> int:
        grid = self.field.grid
        column = int((place[0] - grid.origin[0]) // grid.resolution)
        row = int((place[1] - grid.origin[1]) // grid.resolution)
        return row * self._free.shape[1] + column

    def _place(self, cell: int) -> Point:
        grid = self.field.grid
        row, column = divmod(cell, self._free.shape[1])
        return (
            grid.origin[0] + (column + 0.5) * grid.resolution,
            grid.origin[1] + (row + 0.5) * grid.resolution,
        )


def _grid_graph(free: NDArray[np.bool_], resolution: float) -> sparse.csr_matrix:
    """Return the graph of moves between free cells."""
    rows, columns = free.shape
    number = np.arange(rows * columns).reshape(rows, columns)
    starts, ends, lengths = [], [], []
    for down, right in _moves():
        a, b = _shifted(number, down, right)
        free_a, free_b = _shifted(free, down, right)
        both = free_a & free_b
        starts.append(a[both])
        ends.append(b[both])
        lengths.append(np.full(int(both.sum()), math.hypot(down, right) * resolution))
    shape = (rows * columns, rows * columns)
    joined = (np.concatenate(lengths), (np.concatenate(starts), np.concatenate(ends)))
    return sparse.csr_matrix(joined, shape=shape)


def _moves() -> list[tuple[int, int]]:
    """Return one move in each direction that `REACH` cells can tell apart."""
    span = range(-REACH, REACH + 1)
    return [(down, right) for down in span for right in span if math.gcd(down, right) == 1]


def _shifted(array: NDArray[Any], down: int, right: int) -> tuple[NDArray[Any], NDArray[Any]]:
    """Return the array and the shifted array, both cut to where they overlap."""
    rows, columns = array.shape
    here = array[max(0, -down) : rows - max(0, down), max(0, -right) : columns - max(0, right)]
    there = array[max(0, down) : rows - max(0, -down), max(0, right) : columns - max(0, -right)]
    return here, there
