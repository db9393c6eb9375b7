# SPDX-License-Identifier: BSD-3-Clause
"""Robots and tasks as arrays of numbers.

A task is one leg from its start to its end, whatever it visits in between, so the legs of one task
stay together. A robot's current work is not a task here: it defines where and when the robot is
free.
"""

from __future__ import annotations

from dataclasses import dataclass, fields, replace
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

from blackboard.auction.search.problem import Problem
from blackboard.errors import AllocationError

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray


@dataclass(frozen=True)
class Tasks:
    """Tasks that have not started, each named by its number.

    Attributes:
        inner: (tasks,) path length from start to end [m].
        work: (tasks,) time beside driving [s].
        weight: (tasks,) cost of a second of waiting, above 0; usually 1.
        priority: (tasks,) higher ones stand before lower ones in every list.
    """

    inner: NDArray[np.float64]
    work: NDArray[np.float64]
    weight: NDArray[np.float64]
    priority: NDArray[np.int64]

    @classmethod
    def plain(cls, inner: Sequence[float] | NDArray[np.float64]) -> Tasks:
        """Return tasks of one priority that take only driving [m]."""
        ways = np.asarray(inner, dtype=float)
        return cls(ways, np.zeros_like(ways), np.ones_like(ways), np.zeros(ways.size, dtype=int))

    def __len__(self) -> int:
        return int(self.inner.size)


@dataclass(frozen=True)
class Robots:
    """Robots, each named by its number.

    Attributes:
        speed: (robots,) mean speed [m/s], above 0.
        ready: (robots,) time until the current work is done [s].
        draw: (robots,) energy per metre [J/m]; only the ratios between robots count.
    """

    speed: NDArray[np.float64]
    ready: NDArray[np.float64]
    draw: NDArray[np.float64]

    @classmethod
    def alike(cls, robots: int) -> Robots:
        """Return robots that drive at 1 m/s and are free now."""
        return cls(np.ones(robots), np.zeros(robots), np.ones(robots))

    def __len__(self) -> int:
        return int(self.speed.size)


@dataclass(frozen=True)
class Instance:
    """One allocation problem; raises AllocationError for a wrong shape or a number not allowed.

    Attributes:
        way: (tasks + robots, tasks) path length [m] from the end of each task, then from where
            each robot becomes free, to the start of each task.
        able: (robots, tasks) whether a robot may do a task. It may not where there is no path.
    """

    robots: Robots
    tasks: Tasks
    way: NDArray[np.float64]
    able: NDArray[np.bool_]

    def __post_init__(self) -> None:
        robots, tasks = len(self.robots), len(self.tasks)
        _check_shape("way", self.way, (tasks + robots, tasks))
        _check_shape("able", self.able, (robots, tasks))
        for part, size in ((self.robots, robots), (self.tasks, tasks)):
            for each in fields(part):
                values = getattr(part, each.name)
                _check_shape(each.name, values, (size,))
                _check_range(each.name, values, above=each.name in {"speed", "weight"})
        if np.isnan(self.way).any() or (self.way < 0).any():
            raise AllocationError("way holds a number that is negative or NaN; allowed: from 0 m")

    @classmethod
    def plain(
        cls, way: NDArray[np.float64], inner: Sequence[float] | NDArray[np.float64]
    ) -> Instance:
        """Return robots that are alike and free now, and tasks that all of them may do.

        `inner` is the path length from the start of each task to its end [m].
        """
        tasks = Tasks.plain(inner)
        robots = way.shape[0] - len(tasks)
        return cls(Robots.alike(robots), tasks, way, np.ones((robots, len(tasks)), dtype=bool))

    @property
    def nothing(self) -> int:
        """The number that stands for no task at the end of a list."""
        return len(self.tasks)

    @cached_property
    def table(self) -> NDArray[np.float64]:
        """(tasks + 1 + robots, tasks + 1) path lengths [m]; `nothing` has a row and column of 0.

        Missing paths are as long as all others together: no list gets shorter with them.
        """
        tasks, robots = len(self.tasks), len(self.robots)
        table = np.zeros((tasks + 1 + robots, tasks + 1))
        table[:tasks, :tasks], table[tasks + 1 :, :tasks] = self.way[:tasks], self.way[tasks:]
        finite = np.isfinite(table)
        table[~finite] = table[finite].sum()
        return table

    def problem(self) -> Problem:
        """Return the same for the search of the hive."""
        speeds, kind = np.unique(
            np.column_stack([self.robots.speed, self.robots.draw]), axis=0, return_inverse=True
        )
        speed, draw = speeds[:, 0], speeds[:, 1]
        inner, work = self.column("inner"), self.column("work")
        return Problem(
            kind.ravel(),
            self.table / speed[:, None, None],
            self.table * draw[:, None, None],
            inner / speed[:, None] + work,
            inner * draw[:, None],
            self.robots.ready,
            np.full(len(self.robots), np.inf),
            self.tasks.weight,
            self.tasks.priority,
            self.able,
        )

    def column(self, name: str) -> NDArray[np.float64]:
        """Return an array of `Tasks` with a 0 for `nothing` at its end."""
        return np.append(getattr(self.tasks, name), 0).astype(float)

    def weighted(self, weight: NDArray[np.float64]) -> Instance:
        """Return the same instance with other weights."""
        return replace(self, tasks=replace(self.tasks, weight=weight))


def _check_shape(name: str, values: NDArray[np.generic], shape: tuple[int, ...]) -> None:
    if values.shape != shape:
        raise AllocationError(f"{name} is an array of {values.shape}; needed: {shape}")


def _check_range(name: str, values: NDArray[np.float64], *, above: bool) -> None:
    bad = ~np.isfinite(values) | (values < 0) | (above & (values == 0))
    if bad.any():
        allowed = "above 0" if above else "from 0"
        raise AllocationError(f"{name} holds {values[bad][0]}; allowed: numbers {allowed}")
