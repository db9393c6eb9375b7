# SPDX-License-Identifier: BSD-3-Clause
"""How far it is from one place to another, as a robot would have to drive."""

from __future__ import annotations

import math
from collections import OrderedDict
from dataclasses import dataclass
from typing import TYPE_CHECKING, Protocol

import numpy as np
from scipy import ndimage, sparse
from scipy.sparse import csgraph

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from blackboard.pose import Pose

# Sixteen directions keep the length of a way on a grid within 3 % of the straight line.
_MOVES = ((1, 0), (0, 1), (1, 1), (1, -1), (2, 1), (1, 2), (2, -1), (1, -2))

# As many cells as one distance field is worth: about 50 ms on one core.
_MOST_CELLS = 60_000

_FIELDS_KEPT = 200


class Ways(Protocol):
    """Knows the length of the way between two poses, and where nobody can stand."""

    def length(self, start: Pose, goal: Pose) -> float:
        """Return the length of the way [m]; infinite where there is none."""

    def refusal(self, pose: Pose) -> str:
        """Say why nobody can stand at a pose, to follow its name; empty where one can."""


class StraightWays:
    """As the crow flies, as in the report; knows of no wall."""

    def length(self, start: Pose, goal: Pose) -> float:
        """Return the distance [m]."""
        return start.distance_to(goal)

    def refusal(self, pose: Pose) -> str:  # noqa: ARG002  (the port's argument)
        """Return the empty text: without a map, one can stand anywhere."""
        return ""


@dataclass(frozen=True)
class Grid:
    """What is known of the floor.

    Attributes:
        blocked: (rows, columns) array of bool, row 0 at the lowest y, frame map; True where nobody
            can stand (occupied or unknown).
        resolution: Side of a cell [m].
        x: Of the lower left corner [m, frame map].
        y: Of the lower left corner [m, frame map].
    """

    blocked: NDArray[np.bool_]
    resolution: float
    x: float = 0.0
    y: float = 0.0

    def cell(self, pose: Pose) -> tuple[int, int] | None:
        """Return the (row, column) that a pose falls into, or None outside the map."""
        row = math.floor((pose.y - self.y) / self.resolution)
        column = math.floor((pose.x - self.x) / self.resolution)
        rows, columns = self.blocked.shape
        return (row, column) if 0 <= row < rows and 0 <= column < columns else None


class GridWays:
    """The shortest way on a map for a round robot, from distance fields kept per goal.

    One field holds the distance from every cell to one goal, so all bids on a task share one
    search. Ways are symmetric: a field of either end answers.

    Args:
        grid: What is known of the floor.
        radius: How close the middle of the robot may come to what is blocked [m].
    """

    def __init__(self, grid: Grid, radius: float = 0.0) -> None:
        self._radius = radius
        self.use(grid)

    def use(self, grid: Grid) -> None:
        """Go by another map from now on."""
        self._floor = grid
        self._fields: OrderedDict[int, NDArray[np.float64]] = OrderedDict()
        self._network: tuple[Grid, sparse.csr_matrix] | None = None

    def length(self, start: Pose, goal: Pose) -> float:
        """Return the length of the shortest way [m]; infinite where there is none."""
        ends = [self._nearest_free(start), self._nearest_free(goal)]
        if None in ends:
            return math.inf
        first, last = ends
        assert first is not None  # noqa: S101  (for the type checker)
        assert last is not None  # noqa: S101  (for the type checker)
        if first == last:
            return start.distance_to(goal)
        if first in self._fields and last not in self._fields:
            first, last = last, first
        return max(float(self._field(last)[first]), start.distance_to(goal))

    def refusal(self, pose: Pose) -> str:
        """Say why nobody can stand at a pose; empty where one can."""
        floor = self._floor
        cell = floor.cell(pose)
        if cell is None:
            rows, columns = floor.blocked.shape
            return (
                f"is outside the map, which reaches from ({floor.x:.2f}, {floor.y:.2f}) to "
                f"({floor.x + columns * floor.resolution:.2f}, "
                f"{floor.y + rows * floor.resolution:.2f}) m"
            )
        if floor.blocked[cell]:
            return "is inside a wall or in unknown space; choose a free place of the map"
        return ""

    def _roads(self) -> tuple[Grid, sparse.csr_matrix]:
        """Return the coarse map and the graph of moves on it, made when first needed."""
        if self._network is None:
            coarse = _coarse_free_space(self._floor, self._radius)
            self._network = coarse, _graph(~coarse.blocked) * coarse.resolution
        return self._network

    def _field(self, cell: int) -> NDArray[np.float64]:
        """Return the distance from every cell to one [m]."""
        field = self._fields.pop(cell, None)
        if field is None:
            field = csgraph.dijkstra(self._roads()[1], directed=False, indices=cell)
        self._fields[cell] = field
        if len(self._fields) > _FIELDS_KEPT:
            self._fields.popitem(last=False)
        return field

    def _nearest_free(self, pose: Pose) -> int | None:
        """Return the flat index of the free cell that stands for a pose, or None."""
        coarse, _ = self._roads()
        cell = coarse.cell(pose)
        if cell is None:
            return None
        row, column = cell
        rows, columns = coarse.blocked.shape
        around = [
            (abs(i) + abs(j), r * columns + c)
            for i in (-1, 0, 1)
            for j in (-1, 0, 1)
            if 0 <= (r := row + i) < rows
            and 0 <= (c := column + j) < columns
            and not coarse.blocked[r, c]
        ]
        return min(around)[1] if around else None


def _coarse_free_space(grid: Grid, radius: float) -> Grid:
    """Return a grid of about `_MOST_CELLS` in which a cell is free if any part of it is.

    Being generous keeps narrow doors open. It opens no way through a wall as long as the wall,
    grown by the radius on both sides, is thicker than two cells: hence no cell above the radius.
    """
    rows, columns = grid.blocked.shape
    padded = np.pad(grid.blocked, 1, constant_values=True)
    clearance = ndimage.distance_transform_edt(~padded)[1:-1, 1:-1] * grid.resolution
    free = clearance > max(radius, grid.resolution / 2)
    wanted = math.ceil(math.sqrt(rows * columns / _MOST_CELLS))
    factor = max(1, min(wanted, math.floor(radius / grid.resolution)))
    rows, columns = math.ceil(rows / factor), math.ceil(columns / factor)
    whole = np.zeros((rows * factor, columns * factor), dtype=bool)
    whole[: free.shape[0], : free.shape[1]] = free
    coarse = whole.reshape(rows, factor, columns, factor).any(axis=(1, 3))
    return Grid(~coarse, grid.resolution * factor, grid.x, grid.y)


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
