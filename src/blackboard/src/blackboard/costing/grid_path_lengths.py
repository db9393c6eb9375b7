# SPDX-License-Identifier: BSD-3-Clause
"""The lengths of paths that robots can drive on a map."""

from __future__ import annotations

import math
from collections import OrderedDict
from dataclasses import dataclass
from functools import cache, lru_cache, partial
from typing import TYPE_CHECKING

import numpy as np
from scipy import ndimage, sparse
from scipy.sparse import csgraph

from blackboard.costing.euclidean_lengths import EuclideanLengths

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

    from hive_common.grid_map import GridMap
    from hive_common.pose import Pose

_MOVES = ((1, 0), (0, 1), (1, 1), (1, -1), (2, 1), (1, 2), (2, -1), (1, -2))
"""Sixteen directions keep the length of a path on a grid within 3 % of the straight line."""

_MAX_CELLS = 60_000
"""One distance field over so many cells takes about 50 ms on one core."""

_MAX_FIELDS = 200

_MAX_STANDS = 4000

_STEP_ASIDE = 0.15
"""A pose this close to the free floor counts as on it: no robot knows exactly where it is [m]."""


class GridPathLengths:
    """Shortest paths on a map for a round robot, from a distance field per goal.

    A field holds the distance from every cell to one goal, so all bids on a task share one search.
    Paths are symmetric: the field of either end answers.

    Args:
        grid: What is known of the floor.
        radius: How close the robot's centre may come to a blocked cell [m].
    """

    def __init__(self, grid: GridMap, radius: float = 0.0) -> None:
        self._radius = radius
        self.use(grid)

    def use(self, grid: GridMap) -> None:
        """Use another map from now on."""
        self._floor = grid
        self._fields: OrderedDict[int, NDArray[np.float64]] = OrderedDict()
        self._stand = lru_cache(_MAX_STANDS)(self._find_stand)
        self._roads = cache(partial(_make_roads, grid, self._radius))  # made when first needed

    def length(self, start: Pose, goal: Pose) -> float:
        """Return the length of the shortest path [m]; infinite if there is none."""
        first, last = self._stand(start), self._stand(goal)
        if first is None or last is None or first.part != last.part:
            return math.inf
        ends = [first.node, last.node]
        if ends[0] in self._fields and ends[1] not in self._fields:
            ends.reverse()
        return max(float(self._field(ends[1])[ends[0]]), start.distance_to(goal))

    def lengths(self, starts: Sequence[Pose], goals: Sequence[Pose]) -> NDArray[np.float64]:
        """Return the lengths of all paths, (starts, goals) [m]; see `length`.

        One field per goal answers for all starts, so there should be fewer goals than starts.
        """
        straight = EuclideanLengths().lengths(starts, goals)
        stands = [self._stand(pose) for pose in starts]
        nodes = np.array([stand.node if stand else 0 for stand in stands], dtype=int)
        parts = np.array([stand.part if stand else 0 for stand in stands], dtype=int)
        found = np.full(straight.shape, math.inf)
        for column, goal in enumerate(goals):
            end = self._stand(goal)
            if end is not None:
                reached = parts == end.part
                field = self._field(end.node)[nodes[reached]]
                found[reached, column] = np.maximum(field, straight[reached, column])
        return found

    def refusal(self, pose: Pose) -> str:
        """Say why no robot can stand at a pose; empty if one can."""
        floor = self._floor
        cell = floor.cell(pose)
        if cell is None:
            x_min, y_min, x_max, y_max = floor.bounds
            return (
                f"is outside the map, which reaches from ({x_min:.2f}, {y_min:.2f}) to "
                f"({x_max:.2f}, {y_max:.2f}) m"
            )
        if floor.blocked[cell]:
            return "is inside a wall or in unknown space; choose a free place of the map"
        return ""

    def _field(self, node: int) -> NDArray[np.float64]:
        """Return the distance from every node of the coarse grid to one node [m]."""
        field = self._fields.pop(node, None)
        if field is None:
            field = csgraph.dijkstra(self._roads().graph, directed=False, indices=node)
        self._fields[node] = field
        if len(self._fields) > _MAX_FIELDS:
            self._fields.popitem(last=False)
        return field

    def _find_stand(self, pose: Pose) -> _Stand | None:
        """Return where on the free floor a pose is; None if it is not close to it."""
        cell = self._floor.cell(pose)
        if cell is None:
            return None
        roads = self._roads()
        reach = round(_STEP_ASIDE / self._floor.resolution)
        free = cell if roads.parts[cell] else _nearest(roads.parts, cell, reach)
        if free is None:
            return None
        row, column = free
        node = (row // roads.factor) * roads.columns + column // roads.factor
        return _Stand(node, int(roads.parts[free]))


@dataclass(frozen=True)
class _Stand:
    """A place on the free floor: its node of the coarse grid and the part of the floor."""

    node: int
    part: int


@dataclass(frozen=True)
class _Roads:
    """Where a round robot can drive."""

    # For each cell of the map, the number of the connected part of the free floor that it belongs
    # to; 0 if it is not free.
    parts: NDArray[np.int32]
    factor: int  # how many of the map's cells make one side of a coarse cell
    columns: int  # of the coarse grid
    graph: sparse.csr_matrix  # moves between the coarse cells [m], which are numbered row by row


def _make_roads(grid: GridMap, radius: float) -> _Roads:
    """Compute where a robot can drive, and the moves on a grid of about `_MAX_CELLS`.

    A coarse cell is free if any part of it is, which keeps narrow doors open. The map's own cells
    decide whether there is a path at all, so that none opens where the robot does not fit.
    """
    padded = np.pad(grid.blocked, 1, constant_values=True)
    clearance = ndimage.distance_transform_edt(~padded)[1:-1, 1:-1] * grid.resolution
    free = clearance > max(radius, grid.resolution / 2)
    parts, _ = ndimage.label(free)
    rows, columns = free.shape
    wanted = math.ceil(math.sqrt(rows * columns / _MAX_CELLS))
    factor = max(1, min(wanted, math.floor(radius / grid.resolution)))
    rows, columns = math.ceil(rows / factor), math.ceil(columns / factor)
    whole = np.zeros((rows * factor, columns * factor), dtype=bool)
    whole[: free.shape[0], : free.shape[1]] = free
    coarse = whole.reshape(rows, factor, columns, factor).any(axis=(1, 3))
    return _Roads(parts, factor, columns, _graph(coarse) * (grid.resolution * factor))


def _nearest(
    parts: NDArray[np.int32], cell: tuple[int, int], reach: int
) -> tuple[int, int] | None:
    """Return the free cell nearest to one, at most `reach` cells away in each direction."""
    top, left = max(0, cell[0] - reach), max(0, cell[1] - reach)
    window = parts[top : cell[0] + reach + 1, left : cell[1] + reach + 1]
    rows, columns = np.nonzero(window)
    if not rows.size:
        return None
    rows, columns = rows + top, columns + left
    best = np.argmin((rows - cell[0]) ** 2 + (columns - cell[1]) ** 2)
    return int(rows[best]), int(columns[best])


def _graph(free: NDArray[np.bool_]) -> sparse.csr_matrix:
    """Return the graph of moves between free cells, their lengths in cells."""
    rows, columns = free.shape
    index = np.arange(rows * columns).reshape(rows, columns)
    starts, ends, lengths = [], [], []
    for i, j in _MOVES:
        low = max(0, -j)
        here = np.s_[: rows - i, low : columns - max(0, j)]
        open_moves = free[here].copy()
        for k, m in _cells_touched(i, j):
            open_moves &= free[k : rows - i + k, low + m : columns - max(0, j) + m]
        start = index[here][open_moves]
        starts.append(start)
        ends.append(start + i * columns + j)
        lengths.append(np.full(start.size, math.hypot(i, j)))
    edges = (np.concatenate(lengths), (np.concatenate(starts), np.concatenate(ends)))
    return sparse.csr_matrix(edges, shape=(index.size, index.size))


def _cells_touched(i: int, j: int) -> tuple[tuple[int, int], ...]:
    """Return the offsets of the cells that a move passes over, including its end."""
    side = 1 if j > 0 else -1
    between = {
        (1, 1): ((0, side), (1, 0)),
        (2, 1): ((1, 0), (1, side)),
        (1, 2): ((0, side), (1, side)),
    }
    return (*between.get((i, abs(j)), ()), (i, j))
