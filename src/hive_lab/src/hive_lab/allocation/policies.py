# SPDX-License-Identifier: BSD-3-Clause
"""Simple rules for tasks that arrive over time, to compare the hive with."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from hive_lab.allocation.rules import Ends, append

if TYPE_CHECKING:
    from collections.abc import Callable

    from blackboard.auction.search.problem import Floats, Plan
    from hive_lab.allocation.stream import StreamState


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
        lists: Plan = tuple(map(tuple, ends.lists))
        return lists
