# SPDX-License-Identifier: BSD-3-Clause
"""The lengths of paths that robots can drive on a map."""

from __future__ import annotations

import math
from collections import OrderedDict
from dataclasses import dataclass
from functools import cache, lru_cache, partial
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from scipy import ndimage, sparse
from scipy.sparse import csgraph

from blackboard.costing.euclidean_lengths import EuclideanLengths
from blackboard.costing.traffic_conditions import NO_TRAFFIC
from blackboard.domain.path_lengths import FieldJob, Moves, Wanted
from hive_common.distances import distances, strips

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from numpy.typing import NDArray

    from blackboard.costing.traffic_conditions import TrafficConditions
    from blackboard.domain.path_lengths import Field
    from hive_common.grid_map import GridMap
    from hive_common.pose import Pose

_MOVES = ((1, 0), (0, 1), (1, 1), (1, -1), (2, 1), (1, 2), (2, -1), (1, -2))
"""Sixteen directions keep the length of a path on a grid within 3 % of the straight line."""

_MAX_CELLS = 60_000
"""One distance field over so many cells takes about 50 ms on one core."""

_FIELD_TIME, _READ_TIME = 0.015, 0.0002
"""Processor time of a field over the warehouse, and of reading one for a thousand starts [s]."""

_MAX_FIELDS = 200
_FIELD_BYTES = 100_000_000
"""So many fields are kept at most, and in so much memory, which a large map needs for 30."""

_MAX_WANTED = 25  # so many fields are wanted at once, 0.5 MB each for the warehouse

_MAX_STANDS = 4000

_STEP_ASIDE = 0.15
"""A pose this close to the free floor counts as on it: no robot knows exactly where it is [m]."""

_DETOUR = 1.0  # how much farther a robot drives to save a second [m]


class GridPathLengths:
    """Shortest paths on a map for a round robot, from a distance field per goal.

    A field holds the distance from every cell to one goal, so all bids on a task share one search.
    Without traffic, paths are symmetric: the field of either end answers.

    Where traffic costs time, paths are those that a robot prefers which drives `_DETOUR` farther
    to save a second.

    Args:
        grid: What is known of the floor.
        radius: How close the robot's centre may come to a blocked cell [m].
        traffic: Where robots may not go, and where they lose time.
    """

    def __init__(
        self, grid: GridMap, radius: float = 0.0, traffic: TrafficConditions = NO_TRAFFIC
    ) -> None:
        self._radius = radius
        self._lay_out(grid, traffic)
        self._follow(traffic)

    def use(self, grid: GridMap, traffic: TrafficConditions = NO_TRAFFIC) -> None:
        """Use another map, or other conditions of traffic, from now on."""
        if grid is not self._floor or traffic.zones != self._traffic.zones:
            self._lay_out(grid, traffic)
        self._follow(traffic)

    def _lay_out(self, grid: GridMap, traffic: TrafficConditions) -> None:
        self._floor = grid
        self._stand = lru_cache(_MAX_STANDS)(self._find_stand)
        # Made when first needed.
        self._roads = cache(partial(_make_roads, grid, self._radius, traffic))

    def _follow(self, traffic: TrafficConditions) -> None:
        self._traffic = traffic
        self._moves = cache(lambda: _moves_in_traffic(self._roads(), self._floor, traffic))
        self._all_moves = cache(self._make_moves)
        self._fields: OrderedDict[int, _Field] = OrderedDict()

    def length(self, start: Pose, goal: Pose) -> float:
        """Return the length of the path [m]; infinite if there is none."""
        return self.length_and_delay(start, goal)[0]

    def reaches(self, start: Pose, goal: Pose) -> bool:
        """Return whether a path leads from a start to a goal, without looking for it."""
        first, last = self._stand(start), self._stand(goal)
        return first is not None and last is not None and first.part == last.part

    def length_and_delay(self, start: Pose, goal: Pose) -> tuple[float, float]:
        """Return the length of the path [m] and the time that traffic costs on it [s].

        The length is infinite if there is no path.
        """
        first, last = self._stand(start), self._stand(goal)
        if first is None or last is None or first.part != last.part:
            return math.inf, 0.0
        ends = [first.node, last.node]
        symmetric = self._traffic.change_nothing
        if symmetric and ends[0] in self._fields and ends[1] not in self._fields:
            ends.reverse()
        field = self._field(ends[1])
        delay = 0.0 if field.delays is None else float(field.delays[ends[0]])
        return max(float(field.lengths[ends[0]]), start.distance_to(goal)), delay

    def lengths(self, starts: Sequence[Pose], goals: Sequence[Pose]) -> NDArray[np.float64]:
        """Return the lengths of all paths, (starts, goals) [m]; see `columns`."""
        columns = [lengths for lengths, *_ in self.columns(starts, goals)]
        return np.array(columns).reshape(len(goals), len(starts)).T

    def columns(
        self, starts: Sequence[Pose], goals: Sequence[Pose]
    ) -> Iterator[tuple[NDArray[np.float64], NDArray[np.float64], float]]:
        """Yield lengths [m] and delays [s] from all starts to each goal, and the time of that [s].

        One field per goal answers for all starts, so there should be fewer goals than starts.
        """
        straight = EuclideanLengths().lengths(starts, goals)
        stands = [self._stand(pose) for pose in starts]
        nodes = np.array([stand.node if stand else 0 for stand in stands], dtype=int)
        parts = np.array([stand.part if stand else 0 for stand in stands], dtype=int)
        for column, goal in enumerate(goals):
            lengths, delays = np.full(len(starts), math.inf), np.zeros(len(starts))
            end, taken = self._stand(goal), _READ_TIME
            if end is not None:
                taken += 0.0 if end.node in self._fields else _FIELD_TIME
                reached = parts == end.part
                field = self._field(end.node)
                lengths[reached] = np.maximum(
                    field.lengths[nodes[reached]], straight[reached, column]
                )
                if field.delays is not None:
                    delays[reached] = field.delays[nodes[reached]]
            yield lengths, delays, taken

    def wanted(self, ways: Sequence[Sequence[Pose]]) -> Wanted | None:
        """Return the fields that are missing for the paths to some ways and along them.

        Where paths are symmetric, the field of every second pose has them all.
        """
        each = 2 if self._traffic.change_nothing else 1
        stands = [self._stand(pose) for way in ways for pose in way[::each]]
        nodes = list(dict.fromkeys(stand.node for stand in stands if stand))
        kept = self._fields  # another map or other traffic has fields of its own
        missing = []
        for node in nodes[: self._most_fields()]:
            if node in kept:
                kept.move_to_end(node)
            else:
                missing.append(node)
        if not missing:
            return None
        missing = missing[:_MAX_WANTED]

        def keep(fields: Sequence[Field]) -> None:
            for node, (lengths, lost) in zip(missing, fields, strict=True):
                delays = None if lost is None else lost / _DETOUR
                self._keep(kept, node, _Field(lengths, delays))

        return Wanted(FieldJob(self._all_moves(), missing), keep)

    def refusal(self, pose: Pose) -> str:
        """Say why no robot can stand at a pose; empty if one can."""
        return self._floor.refusal(pose)

    def _field(self, node: int) -> _Field:
        """Return the paths from every node of the coarse grid to one node."""
        field = self._fields.pop(node, None)
        if field is None:
            if self._traffic.change_nothing:
                graph = self._roads().graph
                field = _Field(csgraph.dijkstra(graph, directed=False, indices=node), None)
            else:
                field = _field_in_traffic(self._roads(), self._moves(), node)
        self._keep(self._fields, node, field)
        return field

    def _keep(self, fields: OrderedDict[int, _Field], node: int, field: _Field) -> None:
        fields[node] = field
        if len(fields) > self._most_fields():
            fields.popitem(last=False)

    def _most_fields(self) -> int:
        rows, columns = self._roads().shape
        return max(1, min(_MAX_FIELDS, _FIELD_BYTES // (8 * rows * columns)))

    def _make_moves(self) -> Moves:
        roads = self._roads()
        if self._traffic.change_nothing:
            moves = roads.graph + roads.graph.T
            return Moves(moves.indptr, moves.indices, moves.data, moves.data)
        moves = self._moves()
        ends = np.repeat(np.arange(moves.shape[0]), np.diff(moves.indptr))
        lengths = _between(roads, ends, moves.indices)
        return Moves(moves.indptr, moves.indices, moves.data, lengths)

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
        node = (row // roads.factor) * roads.shape[1] + column // roads.factor
        return _Stand(node, int(roads.parts[free]))


class _Field(NamedTuple):
    """The paths from all nodes of the coarse grid to one of them."""

    lengths: NDArray[np.float64]  # [m]; infinite where there is no path
    delays: NDArray[np.float64] | None  # what traffic costs on each [s]; None if nothing


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
    shape: tuple[int, int]  # of the coarse grid
    side: float  # of a coarse cell [m]
    graph: sparse.csr_matrix  # moves between the coarse cells [m], which are numbered row by row


def _make_roads(grid: GridMap, radius: float, traffic: TrafficConditions) -> _Roads:
    """Compute where a robot can drive, and the moves on a grid of about `_MAX_CELLS`.

    A coarse cell is free if any part of it is, which keeps narrow doors open. The map's own cells
    decide whether there is a path at all, so that none opens where the robot does not fit.
    """
    blocked = grid.blocked
    if traffic.zones:
        blocked = blocked.copy()
        for strip, _ in strips(blocked, 0.0):
            middles = _middles(grid, blocked[strip].shape, grid.resolution, strip.start)
            blocked[strip] |= traffic.is_shut(middles).reshape(blocked[strip].shape)
    need = max(radius, grid.resolution / 2)
    free = np.empty(blocked.shape, dtype=np.bool_)
    for strip, cells in distances(blocked, need / grid.resolution + 1):
        free[strip] = cells * grid.resolution > need
    parts, _ = ndimage.label(free)
    rows, columns = free.shape
    wanted = math.ceil(math.sqrt(rows * columns / _MAX_CELLS))
    factor = max(1, min(wanted, math.floor(radius / grid.resolution)))
    rows, columns = math.ceil(rows / factor), math.ceil(columns / factor)
    whole = np.zeros((rows * factor, columns * factor), dtype=bool)
    whole[: free.shape[0], : free.shape[1]] = free
    coarse = whole.reshape(rows, factor, columns, factor).any(axis=(1, 3))
    side = grid.resolution * factor
    return _Roads(parts, factor, (rows, columns), side, _graph(coarse) * side)


def _middles(
    grid: GridMap, shape: tuple[int, ...], side: float, first: int = 0
) -> NDArray[np.float64]:
    """Return the middles of cells of a side [m], row by row from the first row, (n, 2) [m]."""
    rows, columns = np.indices(shape).reshape(2, -1)
    rows += first
    corner = np.array(grid.origin[:2])
    middles: NDArray[np.float64] = corner + side * (np.column_stack([columns, rows]) + 0.5)
    return middles


def _moves_in_traffic(
    roads: _Roads, grid: GridMap, traffic: TrafficConditions
) -> sparse.csr_matrix:
    """Return the moves that traffic allows, from each cell to where a robot comes from.

    A move costs its length, and what time it takes longer, as `_DETOUR` says [m].
    """
    middles = _middles(grid, roads.shape, roads.side)
    ways = roads.graph.tocoo()
    lost = traffic.lost_time(middles)
    costs = ways.data * (1.0 + _DETOUR * (lost[ways.row] + lost[ways.col]) / 2)
    starts, ends = np.concatenate([ways.row, ways.col]), np.concatenate([ways.col, ways.row])
    kept = traffic.is_allowed(middles[starts], middles[ends])
    moves = (np.concatenate([costs, costs])[kept], (ends[kept], starts[kept]))
    return sparse.csr_matrix(moves, shape=roads.graph.shape)


def _field_in_traffic(roads: _Roads, moves: sparse.csr_matrix, node: int) -> _Field:
    """Return the paths of least cost to a node, and what they consist of."""
    costs, following = csgraph.dijkstra(moves, indices=node, return_predecessors=True)
    ahead = np.where(following < 0, np.arange(len(following)), following)
    lengths = _between(roads, np.arange(len(ahead)), ahead)
    # Each round doubles how far ahead a node has added up the steps on its way.
    while (ahead != ahead[ahead]).any():
        lengths, ahead = lengths + lengths[ahead], ahead[ahead]
    lengths[np.isinf(costs)] = math.inf
    with np.errstate(invalid="ignore"):
        delays = np.maximum(0.0, np.nan_to_num(costs - lengths)) / _DETOUR
    return _Field(lengths, delays)


def _between(
    roads: _Roads, ends: NDArray[np.int64], starts: NDArray[np.int64]
) -> NDArray[np.float64]:
    """Return the straight lines between nodes [m]."""
    rows, columns = np.divmod(np.arange(roads.shape[0] * roads.shape[1]), roads.shape[1])
    lengths: NDArray[np.float64] = roads.side * np.hypot(
        rows[starts] - rows[ends], columns[starts] - columns[ends]
    )
    return lengths


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
