# SPDX-License-Identifier: BSD-3-Clause
"""Multi-agent pickup and delivery (MAPD) on a grid, with a rolling horizon.

Tasks arrive over time. A robot takes one from its place of pickup to its place of delivery, and
then the next one. What is measured, as by Ma et al. (Lifelong Multi-Agent Path Finding for Online
Pickup and Delivery Tasks, AAMAS 2017): the makespan, the step in which the last task is done, and
the service time, the mean number of steps from a task's arrival until it is done.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from hive_lab.mapf.grid_paths import steps_to
from hive_lab.mapf.task_assignment import OpenTasks, assign

if TYPE_CHECKING:
    from collections.abc import Callable

    from hive_common.geometry import Array, Indices
    from hive_lab.mapf.grid_file import Grid, TaskPlaces
    from hive_lab.mapf.step_planner import StepPlanner

NOBODY = -1
MOST_STEPS = 20_000  # a run that takes longer has locked up


@dataclass(frozen=True)
class Tasks:
    """What is to be done.

    Attributes:
        arrives: (tasks,) the step in which each becomes known.
        pickup, delivery: (tasks,) cells.
    """

    arrives: Indices
    pickup: Indices
    delivery: Indices


class Served(NamedTuple):
    """How a run went.

    Attributes:
        makespan: The step in which the last task was done.
        service_time: Mean over all tasks [steps].
        paths: (steps + 1, robots) cells.
        done: Whether all tasks were done.
    """

    makespan: int
    service_time: float
    paths: Indices
    done: bool


def draw_tasks(places: TaskPlaces, count: int, frequency: float, seed: int) -> Tasks:
    """Draw tasks between two places each; `frequency` of them arrive in each step."""
    random = np.random.default_rng(seed)
    pairs = np.array([random.choice(places.task, 2, replace=False) for _ in range(count)])
    arrives = np.floor(np.arange(count) / frequency).astype(np.intp)
    return Tasks(arrives, pairs[:, 0], pairs[:, 1])


def serve(
    grid: Grid,
    places: TaskPlaces,
    tasks: Tasks,
    robots: int,
    planner_of: Callable[[Grid, int], StepPlanner],
    steps_per_plan: int = 1,
) -> Served:
    """Let robots do all tasks.

    Args:
        grid: Where they drive.
        places: They start in the first ones for parking.
        tasks: What they do.
        robots: How many.
        planner_of: Makes the planner.
        steps_per_plan: After how many steps a new plan is made; also after an arrival.
    """
    run = _Run(grid, places, tasks, robots)
    planner = planner_of(grid, robots)
    while not run.all_done and run.step < MOST_STEPS:
        planned = planner.plan(run.cells, run.goals())
        for cells in planned[1 : 1 + steps_per_plan]:
            if run.advance(cells):
                break
    return run.result()


class _Run:
    """The robots, and what each does."""

    def __init__(self, grid: Grid, places: TaskPlaces, tasks: Tasks, robots: int) -> None:
        self.step = 0
        self.cells: Indices = places.parking[:robots].copy()
        self._places, self._tasks = places, tasks
        self._steps: Array = steps_to(grid, np.arange(len(grid.cells)))
        self._task: Indices = np.full(robots, NOBODY)
        self._carries = np.zeros(robots, dtype=np.bool_)
        self._picked = np.zeros(len(tasks.arrives), dtype=np.bool_)
        self._done_at: Indices = np.full(len(tasks.arrives), NOBODY)
        self._paths = [self.cells]

    @property
    def all_done(self) -> bool:
        """Whether every task is done."""
        return bool((self._done_at >= 0).all())

    def goals(self) -> Indices:
        """Assign the tasks that have arrived, and return where each robot goes."""
        tasks = self._tasks
        waiting = np.flatnonzero((tasks.arrives <= self.step) & ~self._picked)
        here, ready = self.cells.copy(), np.zeros(len(self.cells))
        busy = np.flatnonzero(self._carries)
        here[busy] = tasks.delivery[self._task[busy]]
        ready[busy] = self._steps[self.cells[busy], here[busy]]
        chosen = assign(
            self._steps,
            here,
            ready,
            OpenTasks(waiting, tasks.pickup[waiting], tasks.delivery[waiting]),
            last=bool((tasks.arrives <= self.step).all()),
        )
        self._task = np.where(self._carries, self._task, chosen)
        goals = np.where(self._carries, tasks.delivery[self._task], tasks.pickup[self._task])
        idle = np.flatnonzero(self._task == NOBODY)
        goals[idle] = self._parking(idle)
        return goals

    def advance(self, cells: Indices) -> bool:
        """Take a step; return whether somebody has arrived or a task has become known."""
        self.step += 1
        self.cells = cells
        self._paths.append(cells)
        changed = bool((self._tasks.arrives == self.step).any())
        for robot in np.flatnonzero(self._task != NOBODY):
            changed |= self._arrive(int(robot))
        return changed

    def result(self) -> Served:
        """Return what is measured."""
        done = self._done_at >= 0
        waits = (self._done_at - self._tasks.arrives)[done]
        return Served(
            int(self._done_at.max()),
            float(waits.mean()) if len(waits) else np.inf,
            np.array(self._paths),
            self.all_done,
        )

    def _arrive(self, robot: int) -> bool:
        """Pick up or deliver if the robot is where it goes; return whether it is."""
        task, cell = self._task[robot], self.cells[robot]
        arrived = False
        if not self._carries[robot] and cell == self._tasks.pickup[task]:
            self._carries[robot] = self._picked[task] = arrived = True
        if self._carries[robot] and cell == self._tasks.delivery[task]:
            self._carries[robot] = False
            self._done_at[task], self._task[robot] = self.step, NOBODY
            arrived = True
        return arrived

    def _parking(self, idle: Indices) -> Indices:
        """Return a place to wait for each idle robot, the nearest that is left."""
        left = list(self._places.parking)
        chosen = []
        for robot in idle:
            far = self._steps[self.cells[robot]][left]
            chosen.append(left.pop(int(np.argmin(far))))
        return np.array(chosen, dtype=np.intp)
