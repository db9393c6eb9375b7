# SPDX-License-Identifier: BSD-3-Clause
"""The auction: one task after the other goes to the robot with the best bid of all.

It is a sequential single-item auction with bids for the cheapest insertion (Lagoudakis et al.,
"Auction-based multi-robot routing", 2005). Only the winner bids again, because all other lists are
unchanged.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from hive_lab.allocation.exchange import best_places
from hive_lab.allocation.timetable import Book, Timetable, make_bundles

if TYPE_CHECKING:
    from collections.abc import Iterable

    from hive_lab.allocation.instance import Instance
    from hive_lab.allocation.objectives import Objective
    from hive_lab.allocation.plan import Plan
    from hive_lab.allocation.timetable import Floats, Numbers


def auction(
    instance: Instance,
    objective: Objective,
    plan: Plan | None = None,
    tasks: Iterable[int] | None = None,
) -> Plan:
    """Allocate tasks, by default all that are on no list; one that no robot may do stays there."""
    lists = [list(row) for row in plan or [()] * len(instance.robots)]
    listed = {task for row in lists for task in row}
    open_tasks = np.array(
        sorted(set(range(len(instance.tasks)) if tasks is None else tasks) - listed), dtype=int
    )
    rounds = _Rounds(Book(instance), objective, lists, open_tasks)
    while rounds.give_out():
        pass
    return tuple(tuple(row) for row in rounds.lists)


class _Rounds:
    """The bids of all robots on all open tasks, kept while they are valid."""

    def __init__(
        self, book: Book, objective: Objective, lists: list[list[int]], tasks: Numbers
    ) -> None:
        self.lists = lists
        self._book = book
        self._objective = objective
        self._tasks = tasks
        self._open = np.ones(tasks.size, dtype=bool)
        shape = (len(lists), tasks.size)
        self._bids, self._places = np.full(shape, np.inf), np.zeros(shape, dtype=int)
        for robot in range(len(lists)):
            self._bid(robot)

    def give_out(self) -> bool:
        """Allocate the best of the most urgent tasks; return whether there was one."""
        if not self._open.any():
            return False
        bids = self._urgent() if self._book.has_order else self._bids
        robot, column = divmod(int(bids.argmin()), self._tasks.size)
        if not np.isfinite(bids[robot, column]):
            return False
        self.lists[robot].insert(int(self._places[robot, column]), int(self._tasks[column]))
        self._open[column] = False
        self._bids[:, column] = np.inf
        self._bid(robot)
        return True

    def _urgent(self) -> Floats:
        """Return the bids on the most urgent tasks that some robot can do."""
        urgency = self._book.priority[self._tasks]
        able = np.isfinite(self._bids).any(axis=0)
        return np.where(urgency == urgency[able].max(initial=0), self._bids, np.inf)

    def _bid(self, robot: int) -> None:
        """Request a robot's bids on all open tasks."""
        columns = np.flatnonzero(self._open)
        if not columns.size:
            return
        order = np.array([[*self.lists[robot], self._book.nothing]])
        table = Timetable(self._book, np.array([robot]), order)
        bundles = make_bundles(self._book, self._tasks[columns, None])
        cost, place = best_places(table, bundles, self._objective)
        self._bids[robot, columns], self._places[robot, columns] = cost[:, 0], place[:, 0]
