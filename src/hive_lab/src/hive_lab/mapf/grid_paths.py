# SPDX-License-Identifier: BSD-3-Clause
"""Robots' paths on a grid, step by step: their lower bound, and an independent check.

The check shares no code with any planner: it looks at nothing but cells and steps.
"""

from __future__ import annotations

import itertools
from typing import TYPE_CHECKING

import numpy as np
from scipy import sparse
from scipy.sparse import csgraph

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from hive_common.geometry import Array, Indices
    from hive_lab.mapf.grid_file import Grid


def neighbours(grid: Grid) -> sparse.csr_matrix:
    """Return the graph of a grid: an edge of length 1 between free cells that share a side."""
    numbers = grid.numbers
    pairs = np.concatenate(
        [
            np.stack([numbers[:, :-1].ravel(), numbers[:, 1:].ravel()], axis=1),
            np.stack([numbers[:-1].ravel(), numbers[1:].ravel()], axis=1),
        ]
    )
    pairs = pairs[(pairs >= 0).all(axis=1)]
    ends = np.concatenate([pairs, pairs[:, ::-1]])
    size = (len(grid.cells), len(grid.cells))
    return sparse.csr_matrix((np.ones(len(ends)), (ends[:, 0], ends[:, 1])), shape=size)


def steps_to(grid: Grid, goals: Sequence[int] | Indices) -> Array:
    """Return the least number of steps from each goal to each free cell, (goals, cells).

    It is infinite where there is no path.
    """
    found: Array = csgraph.dijkstra(neighbours(grid), indices=np.asarray(goals), unweighted=True)
    return found


def sum_of_costs(paths: Indices) -> int:
    """Return the sum over all robots of the first step from which on they stay where they end.

    Args:
        paths: (steps + 1, robots) array of numbers of cells.
    """
    away = paths != paths[-1]
    last = len(paths) - np.argmax(away[::-1], axis=0)
    return int(np.sum(np.where(away.any(axis=0), last, 0)))


def mistakes(grid: Grid, paths: Indices) -> Iterator[str]:
    """Yield what is wrong with robots' paths, each in a line.

    Args:
        grid: Where they are.
        paths: (steps + 1, robots) array of numbers of cells.
    """
    if paths.size and (paths.min() < 0 or paths.max() >= len(grid.cells)):
        yield "a robot is in a cell that is not free"
        return
    for step, here in enumerate(paths):
        cells, counts = np.unique(here, return_counts=True)
        for cell in cells[counts > 1]:
            robots = np.flatnonzero(here == cell)
            yield f"step {step}: robots {robots.tolist()} are in cell {_name(grid, cell)}"
    for step, (here, there) in enumerate(itertools.pairwise(paths), start=1):
        moved = np.abs(grid.cells[there] - grid.cells[here]).sum(axis=1)
        for robot in np.flatnonzero(moved > 1):
            yield f"step {step}: robot {robot} jumps to cell {_name(grid, there[robot])}"
        owner = {int(cell): robot for robot, cell in enumerate(here)}
        for robot in np.flatnonzero(moved == 1):
            other = owner.get(int(there[robot]))
            if other is not None and other > robot and there[other] == here[robot]:
                yield f"step {step}: robots {robot} and {other} change places"


def _name(grid: Grid, cell: int) -> str:
    column, row = grid.cells[cell]
    return f"({column}, {row})"
