# SPDX-License-Identifier: BSD-3-Clause
"""The planner's time, and the length of its paths over that of the shortest ones.

The reference is up to about 1 % too long, so a ratio slightly below 1 can occur.
"""

from __future__ import annotations

import statistics
import time
from typing import TYPE_CHECKING

import numpy as np

from hive_common.map_file import load_map
from hive_lab.bench.registry import BenchResult
from hive_lab.bench.shortest_paths import ShortestPaths, path_length, random_pairs
from hive_navigation.planning.ompl_planner import OmplPlanner
from robot_description.models import load_model

if TYPE_CHECKING:
    from pathlib import Path

    from hive_common.grid_map import GridMap

MAPS = ("lab", "warehouse")
PAIRS = 200
MODEL = "mir100"  # the widest of the default robots, with the least room in doors

AIMS = {"median": 0.005, "p95": 0.015, "length": 1.01}
"""Median and 95th percentile of the planning time [s]; median ratio of lengths."""


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
