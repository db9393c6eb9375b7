# SPDX-License-Identifier: BSD-3-Clause
"""Simple allocation rules for comparison, the report's among them.

All but the last take the tasks in posting order, append each to one robot's list, and never move
it.
"""

from __future__ import annotations

from types import MappingProxyType
from typing import TYPE_CHECKING

import numpy as np
from scipy.optimize import linear_sum_assignment

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping, Sequence

    from blackboard.auction.search.problem import Floats, Plan
    from hive_lab.allocation.instance import Instance


class Ends:
    """The ends of all lists of a plan, and what one more task would cost there."""

    def __init__(self, instance: Instance, plan: Sequence[Sequence[int]]) -> None:
        self.instance = instance
        self.lists = [list(row) for row in plan]
        robots = len(instance.robots)
        self._node = np.arange(robots) + len(instance.tasks) + 1
        self._free = instance.robots.ready.copy()
        for robot, row in enumerate(plan):
            for task in row:
                self._go(robot, task)

    def way(self, task: int) -> Floats:
        """Return each robot's path length to a task's start [m]; infinite if it may not do it."""
        able = self.instance.able[:, task]
        way: Floats = np.where(able, self.instance.table[self._node, task], np.inf)
        return way

    def place(self) -> Floats:
        """Return the next place of each list, from 1."""
        return np.array([len(row) + 1.0 for row in self.lists])

    def finish(self, task: int) -> Floats:
        """Return when each robot would have done a task [s]."""
        tasks = self.instance.tasks
        way = self.way(task) + tasks.inner[task]
        done: Floats = self._free + way / self.instance.robots.speed + tasks.work[task]
        return done

    def append(self, robot: int, task: int) -> None:
        """Append a task to a list."""
        self.lists[robot].append(task)
        self._go(robot, task)

    def _go(self, robot: int, task: int) -> None:
        self._free[robot] = self.finish(task)[robot]
        self._node[robot] = task


def nearest(ends: Ends, task: int) -> Floats:
    """Cost for the nearest robot: the path from the end of its list."""
    return ends.way(task)


def report(ends: Ends, task: int) -> Floats:
    """Cost by the report's rule: place in the list times path length."""
    cost: Floats = ends.place() * (ends.way(task) + ends.instance.tasks.inner[task])
    return cost


def soonest(ends: Ends, task: int) -> Floats:
    """Cost by the time at which the task would be done."""
    return ends.finish(task)


def append(
    instance: Instance,
    cost: Callable[[Ends, int], Floats],
    plan: Sequence[Sequence[int]] | None = None,
    tasks: Sequence[int] | None = None,
) -> Plan:
    """Append each task, by default all in posting order, to the list where it costs least."""
    ends = Ends(instance, plan or [()] * len(instance.robots))
    for task in range(len(instance.tasks)) if tasks is None else tasks:
        costs = cost(ends, task)
        if np.isfinite(costs).any():
            ends.append(int(costs.argmin()), task)
    return tuple(map(tuple, ends.lists))


def idle_robots_matched(instance: Instance) -> Plan:
    """Match idle robots with open tasks by the least sum of paths, whenever one becomes idle."""
    ends = Ends(instance, [()] * len(instance.robots))
    free = instance.robots.ready.copy()
    still_open = list(range(len(instance.tasks)))
    while still_open:
        idle = np.flatnonzero(free == free.min())
        if not np.isfinite(free.min()):
            break
        ways = np.array([ends.way(task)[idle] for task in still_open])
        rows, columns = linear_sum_assignment(np.minimum(ways, 1e12))
        pairs = [(idle[c], still_open[r], ways[r, c]) for r, c in zip(rows, columns, strict=True)]
        taken = {robot: task for robot, task, way in pairs if np.isfinite(way)}
        for robot in idle:
            free[robot] = ends.finish(taken[robot])[robot] if robot in taken else np.inf
            if robot in taken:
                ends.append(int(robot), taken[robot])
        still_open = [task for task in still_open if task not in set(taken.values())]
    return tuple(map(tuple, ends.lists))


RULES: Mapping[str, Callable[[Instance], Plan]] = MappingProxyType(
    {
        "nearest": lambda instance: append(instance, nearest),
        "report": lambda instance: append(instance, report),
        "soonest": lambda instance: append(instance, soonest),
        "hungarian": idle_robots_matched,
    }
)
"""The rules by name."""
