# SPDX-License-Identifier: BSD-3-Clause
"""How well robots predict the charge that a task takes.

The default fleet does random tasks in the lab, in the simulator and with its own navigation, on
virtual time. The winning bid is compared with what the robot's battery lost from start to end.
"""

from __future__ import annotations

import itertools
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import numpy as np
from attrs import evolve

from blackboard.domain.task import TaskState
from fleet_manager.config.fleet_file import read_fleet
from fleet_manager.config.load import random_tasks
from hive_lab.bench.registry import BenchResult
from hive_lab.fleets.simulated_bodies import SimulatedBodies
from hive_lab.fleets.virtual_fleet import VirtualFleet

if TYPE_CHECKING:
    from blackboard.domain.record import TaskUpdate

FIRST = 20  # tasks measured apart: robots do not know yet how long their drives take
TASKS = 100  # tasks measured after those
APART = 30.0  # time between tasks [s]
PATIENCE = 600.0  # longest wait after the last task [s]
AIMS = {"median_error": 0.05}


@dataclass
class Ledger:
    """Predicted and used charge [Ah], by task; `used` only of those that are done."""

    fleet: VirtualFleet
    predicted: dict[str, float] = field(default_factory=dict)
    used: dict[str, float] = field(default_factory=dict)
    _before: dict[str, float] = field(default_factory=dict)

    def note(self, update: TaskUpdate) -> None:
        """Record an update."""
        task, robot = update.task_id, update.robot_id
        if update.state is TaskState.STARTED and task not in self._before:
            self.predicted[task] = self.fleet.bids[task, robot].energy_cost
            self._before[task] = self.fleet.batteries[robot].charge_left
        elif update.state is TaskState.DONE and task not in self.used:
            self.used[task] = self._before[task] - self.fleet.batteries[robot].charge_left

    def errors(self, first: int, last: int) -> list[float]:
        """Return the relative errors of the tasks from `first` up to before `last`."""
        tasks = [f"T{number + 1}" for number in range(first, last)]
        return [
            self.predicted[task] / self.used[task] - 1.0 for task in tasks if task in self.used
        ]


def run(first: int = FIRST, tasks: int = TASKS, seed: int = 1) -> BenchResult:
    """Measure the relative errors of `tasks` tasks after the `first` ones.

    Returns:
        `median_error` and `error_95` without sign, `bias`, the median with its sign,
        `first_median_error` of the first tasks, `tasks` that were done, `collisions`, and
        `simulated` time [s].
    """
    bodies = SimulatedBodies("lab", seed)
    # Its predictions are what robots bid; a leader that decides alone tells no bids.
    robots = evolve(read_fleet("lab"), decision="distributed")
    fleet = VirtualFleet(robots, "lab", bodies, {})
    ledger = Ledger(fleet)
    fleet.watch(ledger.note)
    source = random_tasks(fleet.grid, np.random.default_rng(seed))
    for task in itertools.islice(source, first + tasks):
        fleet.post(task)
        fleet.run(APART)
    end = fleet.network.now + PATIENCE
    while len(ledger.used) < first + tasks and fleet.network.now < end:
        fleet.run(1.0)
    errors = ledger.errors(first, first + tasks)
    figures = {
        "median_error": float(np.median(np.abs(errors))),
        "error_95": float(np.quantile(np.abs(errors), 0.95)),
        "bias": float(np.median(errors)),
        "first_median_error": float(np.median(np.abs(ledger.errors(0, first)))),
        "tasks": float(len(errors)),
        "collisions": float(bodies.simulation.collisions),
        "simulated": fleet.network.now,
    }
    return BenchResult(figures, AIMS)
