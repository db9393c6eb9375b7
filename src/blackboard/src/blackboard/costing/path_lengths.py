# SPDX-License-Identifier: BSD-3-Clause
"""How far it is from one place to another, as a robot would have to drive."""

from __future__ import annotations

import math
from collections import OrderedDict
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from scipy import ndimage, sparse
from scipy.sparse import csgraph

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

    from hive_common.map_file import GridMap
    from hive_common.pose import Pose

# Sixteen directions keep the length of a way on a grid within 3 % of the straight line.
_MOVES = ((1, 0), (0, 1), (1, 1), (1, -1), (2, 1), (1, 2), (2, -1), (1, -2))

# As many cells as one distance field is worth: about 50 ms on one core.
_MAX_CELLS = 60_000

_FIELDS_KEPT = 200

_STANDS_KEPT = 4000

# A pose this close to the free floor [m] counts as on it: no robot knows exactly where it is.
_STEP_ASIDE = 0.15


class EuclideanLengths:
    """As the crow flies, as in the report; knows of no wall."""

    def length(self, start: Pose, goal: Pose) -> float:
        """Return the distance [m]."""
        return start.distance_to(goal)

    def lengths(self, starts: Sequence[Pose], goals: Sequence[Pose]) -> NDArray[np.float64]:
        """Return all distances, (starts, goals) [m]."""
        here = np.array([(pose.x, pose.y) for pose in starts]).reshape(-1, 1, 2)
        there = np.array([(pose.x, pose.y) for pose in goals]).reshape(1, -1, 2)
        lengths: NDArray[np.float64] = np.hypot(*np.moveaxis(there - here, -1, 0))
        return lengths

    def refusal(self, pose: Pose) -> str:  # noqa: ARG002  (the port's argument)
        """Return the empty text: without a map, one can stand anywhere."""
        return ""


class GridPathLengths:
    """The shortest way on a map for a round robot, from distance fields kept per goal.

    One field holds the distance from every cell to one goal, so all bids on a task share one
    search. Ways are symmetric: a field of either end answers.

    Args:
        grid: What is known of the floor.
        radius: How close the middle of the robot may come to what is blocked [m].
    """

    def __init__(self, grid: GridMap, radius: float = 0.0) -> None:
        self._radius = radius
        self.use(grid)

    def use(self, grid: GridMap) -> None:
        """Go by another map from now on."""
        self._floor = grid
        self._fields: OrderedDict[int, NDArray[np.float64]] = OrderedDict()
        self._stands: dict[tuple[float, float], _Stand | None] = {}
        self._made: _Roads | None = None

    def length(self, start: Pose, goal: Pose) -> float:
        """Return the length of the shortest way [m]; infinite where there is none."""
        first, last = self._stand(start), self._stand(goal)
        if first is None or last is None or first.part != last.part:
            return math.inf
        ends = [first.node, last.node]
        if ends[0] in self._fields and ends[1] not in self._fields:
            ends.reverse()
        return max(float(self._field(ends[1])[ends[0]]), start.distance_to(goal))

    def lengths(self, starts: Sequence[Pose], goals: Sequence[Pose]) -> NDArray[np.float64]:
        """Return the lengths of all ways, (starts, goals) [m]; see `length`.

        One field for each goal answers for all starts, so there should be fewer goals than starts.
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
        """Say why nobody can stand at a pose; empty where one can."""
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

    def _roads(self) -> _Roads:
        """Return where the robot can drive, worked out when first needed."""
        if self._made is None:
            self._made = _make_roads(self._floor, self._radius)
        return self._made

    def _field(self, node: int) -> NDArray[np.float64]:
        """Return the distance from every node of the coarse grid to one [m]."""
        field = self._fields.pop(node, None)
        if field is None:
            field = csgraph.dijkstra(self._roads().graph, directed=False, indices=node)
        self._fields[node] = field
        if len(self._fields) > _FIELDS_KEPT:
            self._fields.popitem(last=False)
        return field

    def _stand(self, pose: Pose) -> _Stand | None:
        """Return where on the free floor a pose is, or None where it is nowhere near."""
        place = pose.x, pose.y
        if place not in self._stands:
            if len(self._stands) >= _STANDS_KEPT:
                self._stands.clear()
            self._stands[place] = self._find_stand(pose)
        return self._stands[place]

    def _find_stand(self, pose: Pose) -> _Stand | None:
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
    """Where a round robot can drive.

    Attributes:
        parts: On the map's own cells, the number of the connected part of the free floor that a
            cell belongs to; 0 where it is not free.
        factor: How many of the map's cells are one side of a coarse cell.
        columns: Of the coarse grid.
        graph: Of the moves between the coarse cells [m], numbered row by row.
    """

    parts: NDArray[np.int32]
    factor: int
    columns: int
    graph: sparse.csr_matrix


def _make_roads(grid: GridMap, radius: float) -> _Roads:
    """Work out where a robot can drive, and how far it is on a grid of about `_MAX_CELLS`.

    A coarse cell is free if any part of it is, which keeps narrow doors open. Whether there is a
    way at all is decided on the map's own cells, so that none opens where the robot does not fit.
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
    """Return the free cell nearest to one, up to some cells away in each direction, or None."""
    top, left = max(0, cell[0] - reach), max(0, cell[1] - reach)
    window = parts[top : cell[0] + reach + 1, left : cell[1] + reach + 1]
    rows, columns = np.nonzero(window)
    if not rows.size:
        return None
    rows, columns = rows + top, columns + left
    best = np.argmin((rows - cell[0]) ** 2 + (columns - cell[1]) ** 2)
    return int(rows[best]), int(columns[best])


def _graph(free: NDArray[np.bool_]) -> sparse.csr_matrix:
    """Return the graph of moves between free cells, each as long as it is in cells."""
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
    """Return the offsets of the cells that a move passes over, its end included."""
    side = 1 if j > 0 else -1
    between = {
        (1, 1): ((0, side), (1, 0)),
        (2, 1): ((1, 0), (1, side)),
        (1, 2): ((0, side), (1, side)),
    }
    return (*between.get((i, abs(j)), ()), (i, j))
