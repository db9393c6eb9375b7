# SPDX-License-Identifier: BSD-3-Clause
"""The joint planner on a grid: unit steps, no turning, and the classical conflicts."""

from __future__ import annotations

import math
import time
from typing import TYPE_CHECKING

import numpy as np

from hive_lab.mapf.grid_roadmap import roadmap_of
from hive_navigation.mapf.joint_planner import Agent, JointPlanner, PlannerSettings, Timetable
from hive_navigation.traffic.coordinator import IMPROVEMENTS

if TYPE_CHECKING:
    from collections.abc import Sequence

    from hive_common.geometry import Indices
    from hive_lab.mapf.grid_file import Grid

HORIZON = 30.0  # how far ahead robots are planned [steps]
TO_THE_END = 200  # how often a part of a plan to the end is made anew
TINY = 1e-6  # rounding of times [steps]


class RollingPlanner:
    """A `StepPlanner` that plans as the traffic planner does: again and again, with a horizon.

    It makes as many parts of each plan anew as that one. The robot with the oldest goal is planned
    first.

    Attributes:
        spent: The processor time of each plan [s].
    """

    def __init__(
        self, grid: Grid, robots: int, steps: int, settings: PlannerSettings | None = None
    ) -> None:
        """Begin without a plan.

        Args:
            grid: Where the robots drive.
            robots: How many.
            steps: How many steps of a plan are returned at most; 0 for all of it.
            settings: How to plan; its conflicts must be the classical ones.
        """
        self.spent: list[float] = []
        settings = settings or PlannerSettings(
            horizon=HORIZON, improvements=IMPROVEMENTS, classical=True
        )
        self._planner = JointPlanner(roadmap_of(grid), settings)
        self._steps = steps
        self._clock = 0
        self._goals: Indices = np.full(robots, -1)
        self._since = np.zeros(robots)
        self._planned: Indices | None = None
        self._tables: list[Timetable] = []

    @classmethod
    def to_the_end(cls, grid: Grid, robots: int) -> RollingPlanner:
        """Return a planner whose every plan leads all robots to their goals."""
        settings = PlannerSettings(horizon=math.inf, classical=True, improvements=TO_THE_END)
        return cls(grid, robots, 0, settings)

    def plan(self, cells: Indices, goals: Indices) -> Indices:
        """See `StepPlanner.plan`."""
        passed = self._passed(cells)
        self._clock += passed
        changed = goals != self._goals
        self._since[changed] = self._clock
        before = [
            None if new else _later(table, passed)
            for table, new in zip(self._tables, changed, strict=False)
        ]
        agents = [
            Agent(
                start=int(cell),
                ready=0.0,
                heading=0.0,
                goal=int(goal),
                radius=0.0,
                speed=1.0,
                acceleration=math.inf,
                yaw_rate=math.inf,
                priority=float(since),
            )
            for cell, goal, since in zip(cells, goals, self._since, strict=True)
        ]
        began = time.process_time()
        self._tables = self._planner.plan(agents, before)
        self.spent.append(time.process_time() - began)
        self._goals = goals.copy()
        self._planned = _step_by_step(self._tables, self._steps)
        return self._planned

    def _passed(self, cells: Indices) -> int:
        """Return how many steps of the last plan the robots have taken."""
        if self._planned is None:
            return 0
        taken = np.flatnonzero((self._planned[1:] == cells).all(axis=1))
        return 1 + int(taken[0]) if len(taken) else 0


def _step_by_step(tables: Sequence[Timetable], steps: int) -> Indices:
    """Return the cells of robots at each step, (steps + 1, robots); all steps if `steps` is 0."""
    last = max((table.arrives[-1] for table in tables), default=0.0)
    count = steps or max(1, math.ceil(last - TINY))
    times = np.arange(count + 1) + TINY
    return np.column_stack(
        [
            np.array(table.places)[np.searchsorted(table.arrives, times, side="right") - 1]
            for table in tables
        ]
    )


def _later(table: Timetable, passed: int) -> Timetable:
    """Return a timetable as it is some steps later."""
    return Timetable(
        table.places,
        tuple(arrives - passed for arrives in table.arrives),
        tuple(leaves - passed for leaves in table.leaves),
        table.complete,
    )
