# SPDX-License-Identifier: BSD-3-Clause
"""The planner's time, and the length of its paths over that of the shortest ones.

The reference is independent of the planner: Dijkstra's algorithm on a grid with moves to 32
neighbours, pulled taut afterwards. It is at most about 1 % longer than the shortest any-angle
path, so a ratio slightly below 1 can occur.
"""

from __future__ import annotations

import itertools
import math
import statistics
import time
from typing import TYPE_CHECKING, Any

import numpy as np
from scipy import sparse
from scipy.sparse import csgraph

from hive_common.map_file import load_map
from hive_lab.bench.registry import BenchResult
from robot_description.models import load_model

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator
    from pathlib import Path

    from numpy.typing import NDArray

    from hive_common.grid_map import GridMap
    from robot_navigation.planning.clearance import ClearanceField

Point = tuple[float, float]

MAPS = ("lab", "warehouse")
PAIRS = 200
MODEL = "mir100"  # the widest of the default robots, with the least room in doors

AIMS = {"median": 0.005, "p95": 0.015, "length": 1.01}
"""Median and 95th percentile of the planning time [s]; median ratio of lengths."""

REACH = 4  # largest move of the reference [cells]; 4 gives 32 directions


def run(maps: Path | None = None, pairs: int = PAIRS, seed: int = 1) -> BenchResult:
    """Return planning times [s] and ratios of lengths between random reachable places of each map.

    `maps` holds `lab.yaml` and `warehouse.yaml`; the default is the repository's own folder.
    """
    figures: dict[str, float] = {}
    aims: dict[str, float] = {}
    for name in MAPS:
        grid = load_map(str(maps / f"{name}.yaml") if maps else name)
        figures |= {f"{name}_{key}": value for key, value in _measure(grid, pairs, seed).items()}
        aims |= {
            f"{name}_time_median": AIMS["median"],
            f"{name}_time_p95": AIMS["p95"],
            f"{name}_length_median": AIMS["length"],
        }
    return BenchResult(figures, aims)


def _measure(grid: GridMap, pairs: int, seed: int) -> dict[str, float]:
    # Only a measurement needs OMPL; reading the aims does not.
    from robot_navigation.planning.ompl_planner import OmplPlanner  # noqa: PLC0415

    began = time.perf_counter()
    planner = OmplPlanner(grid, load_model(MODEL).base.circumscribed_radius, seed=seed)
    prepared = time.perf_counter() - began
    shortest = ShortestPaths(planner.field, planner.need, planner.goal_need)
    times, ratios = [], []
    for start, goal, length in random_pairs(shortest, pairs, seed):
        began = time.perf_counter()
        corners = planner.plan(start, goal)
        times.append(time.perf_counter() - began)
        ratios.append(path_length(corners) / length)
    return {
        "prepare": prepared,
        "time_median": statistics.median(times),
        "time_p95": float(np.percentile(times, 95)),
        "time_worst": max(times),
        "length_median": statistics.median(ratios),
        "length_p95": float(np.percentile(ratios, 95)),
        "length_worst": max(ratios),
    }


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
