# SPDX-License-Identifier: BSD-3-Clause
"""How lists are kept while tasks arrive: simple rules, and the auction that goes on improving."""

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
    """Every task goes to the end of one list when it arrives, and stays there.

    Args:
        cost: Of one task for all robots; see `rules`.
    """

    def __init__(self, cost: Callable[[Ends, int], Floats]) -> None:
        self._cost = cost

    def decide(self, state: StreamState) -> Plan:
        """Return the lists; see `Policy`."""
        new = [len(state.instance.tasks) - 1] if state.has_arrival else []
        return append(state.instance, self._cost, state.plan, new)


class IdleTakesNearest:
    """No lists: a robot that becomes free takes the nearest task, of those that wait."""

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
    """A new task is auctioned; all that has not begun is offered again in a few rounds.

    Args:
        objective: What is to be made small.
        random: Chooses the offers.
        rounds: Of offers, at every event.
        aging: A task that has waited this long [s] counts twice as much as a new one, one that
            has waited twice as long counts four times; infinite where age does not count.
        afresh: Whether all that has not begun is auctioned anew at every event.
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
            instance,
            self._objective,
            plan,
            self._random,
            lambda: next(rounds, None) is not None,
        )

    def _aged(self, state: StreamState) -> Instance:
        if np.isinf(self._aging):
            return state.instance
        return state.instance.weighted(aged(state.instance.tasks.weight, state.age, self._aging))


def aged(weight: Floats, age: Floats, aging: float) -> Floats:
    """Return what a second of waiting counts for tasks that have waited.

    Doubles with every `aging`, up to a million times, so that whoever waits long enough goes
    before all that is new.

    Args:
        weight: (tasks,) of new ones.
        age: (tasks,) since each was posted [s].
        aging: In which the weight doubles [s].
    """
    return weight * 2.0 ** np.minimum(age / aging, 20.0)
