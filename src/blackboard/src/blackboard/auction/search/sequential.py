# SPDX-License-Identifier: BSD-3-Clause
"""The auction: one task after the other goes to the robot with the best bid of all.

It is a sequential single-item auction with bids for the cheapest insertion (Lagoudakis et al.,
"Auction-based multi-robot routing", 2005). Only the winner bids again, because all other lists are
unchanged.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from blackboard.auction.search.exchange import best_places
from blackboard.auction.search.timetable import Timetable, make_bundles

if TYPE_CHECKING:
    from blackboard.auction.search.objectives import Objective
    from blackboard.auction.search.plan import Plan
    from blackboard.auction.search.problem import Floats
    from blackboard.auction.search.timetable import Book


class Sequential:
    """An auction of all tasks that are on no list of a plan.

    A task that no robot may do stays there. The bids of all robots on all open tasks are kept
    while they are valid.

    Attributes:
        lists: Of each robot, as they are so far.
    """

    def __init__(self, book: Book, objective: Objective, plan: Plan) -> None:
        self.lists = [list(row) for row in plan]
        listed = {task for row in plan for task in row}
        tasks = np.array(sorted(set(range(book.nothing)) - listed), dtype=int)
        self._book = book
        self._objective = objective
        self._tasks = tasks
        self._open = np.ones(tasks.size, dtype=bool)
        shape = (len(plan), tasks.size)
        self._bids, self._places = np.full(shape, np.inf), np.zeros(shape, dtype=int)
        self._next = 0

    def step(self) -> bool:
        """Take one robot's first bids, or allocate one task; return whether more is to be done."""
        if self._next < len(self.lists):
            self._bid(self._next)
            self._next += 1
            return True
        return self._give_out()

    def _give_out(self) -> bool:
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
