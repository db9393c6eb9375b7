# SPDX-License-Identifier: BSD-3-Clause
"""Policies for tasks that arrive over time: simple rules, and the auction with reallocation."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from hive_lab.allocation.improvement import improve
from hive_lab.allocation.rules import Ends, append
from hive_lab.allocation.sequential import auction

if TYPE_CHECKING:
    from collections.abc import Callable

    from hive_lab.allocation.instance import Instance
    from hive_lab.allocation.objectives import Objective
    from hive_lab.allocation.plan import Plan
    from hive_lab.allocation.stream import StreamState
    from hive_lab.allocation.timetable import Floats


class Append:
    """Appends every task to one list when it arrives, by a cost of `rules`, and never moves it."""

    def __init__(self, cost: Callable[[Ends, int], Floats]) -> None:
        self._cost = cost

    def decide(self, state: StreamState) -> Plan:
        """Return the lists; see `Policy`."""
        new = [len(state.instance.tasks) - 1] if state.has_arrival else []
        return append(state.instance, self._cost, state.plan, new)


class IdleTakesNearest:
    """Keeps no lists: a robot that becomes free takes the nearest waiting task."""

    def decide(self, state: StreamState) -> Plan:
        """Return the lists; see `Policy`."""
        instance = state.instance
        ends = Ends(instance, [()] * len(instance.robots))
        idle = instance.robots.ready == 0.0
        ways = np.array([ends.way(task) for task in range(len(instance.tasks))])
        ways[:, ~idle] = np.inf
        while np.isfinite(ways).any():
            task, robot = divmod(int(ways.argmin()), ways.shape[1])
            ends.append(robot, task)
            ways[task], ways[:, robot] = np.inf, np.inf
        return tuple(map(tuple, ends.lists))


class Reallocation:
    """Auctions each new task, and reallocates all tasks that have not begun in a few rounds.

    Args:
        rounds: Number of rounds at every event.
        aging: Waiting time that doubles a task's weight [s]; infinite if age does not count.
        afresh: Whether to auction all tasks that have not begun anew at every event.
    """

    def __init__(
        self,
        objective: Objective,
        random: np.random.Generator,
        rounds: int = 8,
        aging: float = np.inf,
        *,
        afresh: bool = False,
    ) -> None:
        self._objective = objective
        self._random = random
        self._rounds = rounds
        self._aging = aging
        self._afresh = afresh

    def decide(self, state: StreamState) -> Plan:
        """Return the lists; see `Policy`."""
        instance = self._aged(state)
        plan = auction(instance, self._objective, None if self._afresh else state.plan)
        rounds = iter(range(self._rounds))
        return improve(
            instance, self._objective, plan, self._random, lambda: next(rounds, None) is not None
        )

    def _aged(self, state: StreamState) -> Instance:
        if np.isinf(self._aging):
            return state.instance
        return state.instance.weighted(aged(state.instance.tasks.weight, state.age, self._aging))


def aged(weight: Floats, age: Floats, aging: float) -> Floats:
    """Return the weights of tasks that have waited for a time [s].

    They double with every `aging` [s], up to a million times, so that a task that waits long
    enough goes before all new ones.
    """
    return weight * 2.0 ** np.minimum(age / aging, 20.0)
