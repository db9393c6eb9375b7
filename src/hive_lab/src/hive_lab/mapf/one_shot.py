# SPDX-License-Identifier: BSD-3-Clause
"""One-shot path finding on a grid: every robot drives to one goal and stays there."""

from __future__ import annotations

import time
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from hive_lab.mapf.grid_paths import mistakes, steps_to, sum_of_costs

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from hive_common.geometry import Indices
    from hive_lab.mapf.grid_file import Grid, Trip
    from hive_lab.mapf.step_planner import StepPlanner


class Solved(NamedTuple):
    """How a problem was solved.

    Attributes:
        solved: Whether all stand at their goals and the paths have no mistake.
        ratio: The sum of costs over that of the shortest paths.
        wall: Time taken, without the making of the planner [s].
        cpu: Processor time taken, the same way [s].
        paths: (steps + 1, robots) cells.
    """

    solved: bool
    ratio: float
    wall: float
    cpu: float
    paths: Indices


def solve(
    grid: Grid,
    trips: Sequence[Trip],
    planner_of: Callable[[Grid, int], StepPlanner],
    most_steps: int,
) -> Solved:
    """Let a planner take all robots to their goals; it plans again from where its steps end.

    Args:
        grid: Where they drive.
        trips: From where to where.
        planner_of: Makes the planner.
        most_steps: A run that takes longer is not solved.
    """
    cells = np.array([grid.number(trip.start) for trip in trips])
    goals = np.array([grid.number(trip.goal) for trip in trips])
    bound = float(steps_to(grid, goals)[np.arange(len(goals)), cells].sum())
    planner = planner_of(grid, len(trips))
    wall, cpu = time.perf_counter(), time.process_time()
    parts = [cells[None]]
    while (cells != goals).any() and sum(map(len, parts)) <= most_steps:
        planned = planner.plan(cells, goals)
        parts.append(planned[1:])
        cells = planned[-1]
    wall, cpu = time.perf_counter() - wall, time.process_time() - cpu
    paths = np.concatenate(parts)
    solved = bool((cells == goals).all()) and not any(mistakes(grid, paths))
    return Solved(solved, sum_of_costs(paths) / bound, wall, cpu, paths)
