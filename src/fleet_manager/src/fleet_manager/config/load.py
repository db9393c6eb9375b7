# SPDX-License-Identifier: BSD-3-Clause
"""The load generator: random tasks that arrive over time, for simulated and for live hives."""

import itertools
import math
from collections.abc import Collection, Iterator
from pathlib import Path
from typing import Annotated

import attrs
import numpy as np
from numpy.random import Generator
from numpy.typing import NDArray

from blackboard.domain.task import Task, TaskType
from fleet_manager.config.scenario import PlannedTask, Scenario
from hive_common.distances import distances
from hive_common.grid_map import GridMap
from hive_common.pose import Pose
from hive_common.structuring import Allowed, NotAllowedError, between

ROOM = 0.9  # least distance of a goal from anything that is not free [m]
LONGEST = 1440.0  # tasks arrive for a day at most [min]
MOST_WEIGHT = 1e6  # sum of the weights of a mix
KEEP_OFF = 1.5  # least distance of a goal from a pose to be avoided [m]

PAYLOADS = {TaskType.GA: 0.0, TaskType.GAB: 40.0, TaskType.GPA: 0.4, TaskType.GPAB: 0.4}
"""Largest payload by task type [kg]; any arm of the default fleet can lift the least."""

TYPES = tuple(kind.name for kind in TaskType)


def _are_weights(mix: dict[str, float]) -> bool:
    weights = mix.values()
    return set(mix) <= set(TYPES) and min(weights, default=0.0) >= 0 < sum(weights) <= MOST_WEIGHT


@attrs.frozen(kw_only=True)
class Load:
    """How many tasks of which types arrive.

    Raises:
        NotAllowedError: No task would arrive.
    """

    at_once: Annotated[int, between(0, 1000, "a number of tasks")] = 0
    """Posted at the start."""
    per_hour: Annotated[float, between(0, 3600, "a number of tasks")] = 0.0
    """Posted later, at random times with this mean rate (a Poisson process) [1/h]."""
    minutes: Annotated[float, between(0, LONGEST, "a number of minutes")] = 10.0
    """How long tasks are posted [min]."""
    mix: Annotated[
        dict[str, float],
        Allowed(
            f"a weight from 0 by type, of {', '.join(TYPES)}; "
            f"together above 0, at most {MOST_WEIGHT:g}",
            _are_weights,
        ),
    ] = attrs.field(factory=lambda: dict.fromkeys(TYPES, 1.0))
    """How frequent each task type is, relative to the others."""

    def __attrs_post_init__(self) -> None:
        if not self.at_once and not (self.per_hour and self.minutes):
            raise NotAllowedError(
                (), "no task would arrive; set at_once, or per_hour and minutes, above 0"
            )

    def draw(
        self, grid: GridMap, seed: int, avoid: Collection[Pose] = ()
    ) -> tuple[PlannedTask, ...]:
        """Draw the tasks; the same seed on the same map draws the same.

        Args:
            grid: The map whose free floor holds the goals.
            seed: At least 0.
            avoid: Poses, such as those of chargers, that goals keep 1.5 m away from.

        Returns:
            The tasks in the order in which they are posted.
        """
        random = np.random.default_rng(seed)
        times = itertools.chain(itertools.repeat(0.0, self.at_once), self._arrivals(random))
        drawn = tuple(times)
        names = [name for name, weight in self.mix.items() if weight > 0]
        weights = np.array([self.mix[name] for name in names])
        kinds = random.choice(len(names), size=len(drawn), p=weights / weights.sum())
        types = (TaskType[names[kind]] for kind in kinds)
        tasks = random_tasks(grid, random, avoid, types)
        return tuple(PlannedTask(task, after) for task, after in zip(tasks, drawn, strict=False))

    def scenario(
        self, *, world: str, chart: str, fleet: str, tasks: tuple[PlannedTask, ...], limit: float
    ) -> Scenario:
        """Return tasks that were drawn as a scenario; `limit` is its time limit [s]."""
        return Scenario(
            path=Path("load"),
            description=f"{len(tasks)} random tasks.",
            world=world,
            map=chart,
            fleet=fleet,
            time_limit=limit,
            tasks=tasks,
        )

    def _arrivals(self, random: Generator) -> Iterator[float]:
        """Yield the times of tasks that are posted later [s]."""
        now = 0.0
        while self.per_hour > 0:
            now += float(random.exponential(3600.0 / self.per_hour))
            if now > 60.0 * self.minutes:
                return
            yield now


def random_tasks(
    grid: GridMap,
    random: Generator,
    avoid: Collection[Pose] = (),
    kinds: Iterator[TaskType] | None = None,
) -> Iterator[Task]:
    """Yield tasks T1, T2, ... with goals evenly over the free floor.

    Args:
        grid: The map; goals keep 0.9 m away from anything that is not free.
        random: The source of goals and payloads.
        avoid: Poses, such as those of chargers, that goals keep 1.5 m away from.
        kinds: The types of the tasks; None for all types in turn, for ever.
    """
    rows, columns = _floor(grid, avoid)
    turns = itertools.cycle(TaskType(number % len(TaskType)) for number in range(1, 5))
    for number, kind in enumerate(kinds or turns, start=1):
        chosen = random.integers(len(rows), size=kind.goals_needed)
        goals = tuple(
            Pose(
                grid.origin.x + (float(columns[cell]) + 0.5) * grid.resolution,
                grid.origin.y + (float(rows[cell]) + 0.5) * grid.resolution,
                float(random.uniform(-math.pi, math.pi)),
            )
            for cell in chosen
        )
        payload = float(random.uniform(0.0, PAYLOADS[kind]))
        yield Task(f"T{number}", kind, goals, payload=payload)


def _floor(grid: GridMap, avoid: Collection[Pose]) -> tuple[NDArray[np.intp], ...]:
    """Return rows and columns of the cells in which goals may be.

    Raises:
        NotAllowedError: There is none.
    """
    clear = np.empty(grid.blocked.shape, dtype=np.bool_)
    for strip, apart in distances(grid.blocked, ROOM / grid.resolution + 1):
        clear[strip] = apart * grid.resolution >= ROOM
    for pose in avoid:
        rows, columns = np.ogrid[: clear.shape[0], : clear.shape[1]]
        x, y = columns * grid.resolution + grid.origin.x, rows * grid.resolution + grid.origin.y
        clear[np.hypot(x - pose.x, y - pose.y) < KEEP_OFF] = False
    cells = np.nonzero(clear)
    if not len(cells[0]):
        raise NotAllowedError((), f"no place on the map is {ROOM} m away from all walls")
    return cells
