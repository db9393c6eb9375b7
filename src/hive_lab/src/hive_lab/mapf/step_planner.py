# SPDX-License-Identifier: BSD-3-Clause
"""What moves robots on a grid step by step, and PIBT as a reference that is independent of ours.

PIBT: Okumura et al., Priority inheritance with backtracking for iterative multi-agent path
finding, Artificial Intelligence 310, 2022.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Protocol

import numpy as np

from hive_lab.mapf.grid_paths import neighbours, steps_to

if TYPE_CHECKING:
    from hive_common.geometry import Array, Indices
    from hive_lab.mapf.grid_file import Grid


class StepPlanner(Protocol):
    """Plans the next steps of all robots on a grid."""

    def plan(self, cells: Indices, goals: Indices) -> Indices:
        """Return the cells of the next steps, (steps + 1, robots), from where the robots are.

        Args:
            cells: (robots,) where each is.
            goals: (robots,) where each should go; two may have one goal.
        """
        ...


class Pibt:
    """Plans one step; a robot inherits the priority of one that it is in the way of."""

    def __init__(self, grid: Grid, robots: int, seed: int = 1) -> None:
        graph = neighbours(grid)
        self._beside = [
            graph.indices[graph.indptr[cell] : graph.indptr[cell + 1]].tolist()
            for cell in range(graph.shape[0])
        ]
        self._steps = steps_to(grid, np.arange(len(grid.cells)))
        self._random = np.random.default_rng(seed)
        self._waited: Array = self._random.random(robots)

    def plan(self, cells: Indices, goals: Indices) -> Indices:
        """See `StepPlanner.plan`."""
        arrived = cells == goals
        self._waited = np.where(arrived, self._waited % 1.0, self._waited + 1.0)
        step = _Step(self._beside, self._steps, cells.tolist(), goals.tolist(), self._random)
        for robot in np.argsort(-self._waited):
            if step.chosen[robot] < 0:
                step.choose(int(robot), -1)
        return np.array([cells, step.chosen])


class _Step:
    """One step of PIBT.

    Attributes:
        chosen: The next cell of each robot; -1 as long as it has none.
    """

    def __init__(
        self,
        beside: list[list[int]],
        steps: Array,
        cells: list[int],
        goals: list[int],
        random: np.random.Generator,
    ) -> None:
        self.chosen = [-1] * len(cells)
        self._beside, self._steps, self._cells, self._goals = beside, steps, cells, goals
        self._random = random
        self._here = {cell: robot for robot, cell in enumerate(cells)}
        self._taken: dict[int, int] = {}

    def choose(self, robot: int, pushed_by: int) -> bool:
        """Choose a robot's next cell; return whether the one that pushes it may have its cell."""
        here = self._cells[robot]
        options = [*self._beside[here], here]
        ties = self._random.random(len(options)).tolist()
        far = self._steps[self._goals[robot]]
        # A cell that nobody is in comes first among equals: nobody has to be pushed.
        order = sorted(
            range(len(options)),
            key=lambda at: (far[options[at]], options[at] in self._here, ties[at]),
        )
        for cell in (options[at] for at in order):
            if cell in self._taken or (pushed_by >= 0 and cell == self._cells[pushed_by]):
                continue
            self._take(robot, cell)
            other = self._here.get(cell)
            if other is None or other == robot or self.chosen[other] >= 0:
                return True
            if self.choose(other, robot):
                return True
        self._take(robot, here)
        return False

    def _take(self, robot: int, cell: int) -> None:
        if self._taken.get(self.chosen[robot]) == robot:
            del self._taken[self.chosen[robot]]
        self.chosen[robot] = cell
        self._taken[cell] = robot
