# SPDX-License-Identifier: BSD-3-Clause
"""Time and memory of everything that knows the map, with one of 4,000 x 4,000 cells.

The map is the warehouse again and again, 200 m x 200 m, with doors between the copies. Each part
is measured in a process of its own, as each is one on ROS.
"""

from __future__ import annotations

import multiprocessing
import re
import time
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from blackboard.costing.grid_path_lengths import GridPathLengths
from hive_common.grid_map import GridMap
from hive_common.map_file import load_map
from hive_common.pose import Pose
from hive_lab.bench.registry import BenchResult
from hive_navigation.localization.amcl_settings import AmclSettings
from hive_navigation.localization.likelihood_field import LikelihoodField
from hive_navigation.mapf.roadmap_builder import build_roadmap
from hive_navigation.planning.clearance import ClearanceField
from hive_navigation.planning.ompl_planner import OmplPlanner

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

    from numpy.typing import NDArray

    from hive_navigation.planning.path import Point

CELLS = 4000  # on each side
RADIUS = 0.3  # of the robots [m]
_DOOR = 80, 24  # width of a door, and thickness of the walls that it opens [cells]
_GIGA = 1e9

AIMS = {"time": 10.0, "memory": 0.5}  # [s], [GB]


def large_map() -> GridMap:
    """Return the map."""
    tile = load_map("warehouse")
    high, wide = tile.cells.shape
    copies = (-(-CELLS // high), -(-CELLS // wide))
    blocked = np.tile(tile.blocked, copies)[:CELLS, :CELLS].copy()
    along, across = _DOOR[0] // 2, _DOOR[1] // 2
    for row in range(0, CELLS, high):
        for column in range(0, CELLS, wide):
            middle_row, middle_column = row + high // 2, column + wide // 2
            if row:
                door = np.s_[middle_column - along : middle_column + along]
                blocked[row - across : row + across, door] = False
            if column:
                door = np.s_[middle_row - along : middle_row + along]
                blocked[door, column - across : column + across] = False
    return GridMap.of_blocked(blocked, tile.resolution)


def _corners(free: NDArray[np.bool_], resolution: float) -> tuple[Point, Point]:
    """Return the first and the last free place of a map [m]."""
    cells = (int(free.argmax()), free.size - 1 - int(free[::-1, ::-1].argmax()))
    first, last = (divmod(cell, free.shape[1]) for cell in cells)
    return (
        ((first[1] + 0.5) * resolution, (first[0] + 0.5) * resolution),
        ((last[1] + 0.5) * resolution, (last[0] + 0.5) * resolution),
    )


def _planner(grid: GridMap) -> Iterator[str]:
    planner = OmplPlanner(grid, RADIUS)
    yield "move_base"
    planner.plan(*_corners(planner.field.clearance >= planner.goal_need, grid.resolution))
    yield "first_path"


def _roadmap(grid: GridMap) -> Iterator[str]:
    build_roadmap(ClearanceField.of(grid), [RADIUS])
    yield "traffic_planner"


def _path_lengths(grid: GridMap) -> Iterator[str]:
    lengths = GridPathLengths(grid, RADIUS)
    start, goal = _corners(~grid.blocked, grid.resolution)
    lengths.length(Pose(*start), Pose(*goal))
    yield "robot"


def _localization(grid: GridMap) -> Iterator[str]:
    LikelihoodField(grid.cells, grid.resolution, (0.0, 0.0), AmclSettings())
    yield "amcl"


PARTS = (_planner, _roadmap, _path_lengths, _localization)


def run() -> BenchResult:
    """Measure.

    Returns:
        For each node of which a part depends on the size of the map: the time [s] until this part
        is ready, and the greatest memory of its process so far [GB]; and the same of the first
        path right across the map.
    """
    figures: dict[str, float] = {}
    for part in PARTS:
        # A new process: its peak of memory is its own.
        with multiprocessing.get_context("spawn").Pool(1) as pool:
            figures |= pool.apply(_measured, (part,))
    aims = {name: AIMS[name.rsplit("_", 1)[1]] for name in figures}
    return BenchResult(figures, aims)


def _measured(part: Callable[[GridMap], Iterator[str]]) -> dict[str, float]:
    grid = large_map()
    figures, began = {}, time.perf_counter()
    for name in part(grid):
        figures[f"{name}_time"] = time.perf_counter() - began
        figures[f"{name}_memory"] = _peak() / _GIGA
        began = time.perf_counter()
    return figures


def _peak() -> float:
    """Return the greatest memory that this process has had [byte]."""
    status = Path("/proc/self/status").read_text(encoding="ascii")
    found = re.search(r"VmHWM:\s+(\d+) kB", status)
    return 1024.0 * float(found[1]) if found else 0.0
