# SPDX-License-Identifier: BSD-3-Clause
"""The search: rounds of exchanges between robots, as long as there is time.

Chance decides which bundles are offered. A round never makes the plan worse, so the search can
stop at any time. With few robots, several copies of the plan are searched side by side: a numpy
call for twenty lists takes hardly longer than one for four.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from blackboard.auction.search.exchange import exchange
from blackboard.auction.search.plan import narrow, to_order, to_plan
from blackboard.auction.search.timetable import Timetable

if TYPE_CHECKING:
    from blackboard.auction.search.objectives import Objective
    from blackboard.auction.search.plan import Plan
    from blackboard.auction.search.problem import Floats, Numbers
    from blackboard.auction.search.timetable import Book


@dataclass(frozen=True)
class Search:
    """Parameters of the search, tuned on the benchmark's instances.

    Attributes:
        lists: Approximate number of lists searched side by side, in copies of the plan.
        longest: A bundle is the whole rest of a list, or has at most this many tasks.
        ends: Share of the rounds in which every robot offers the rest of its list (2-opt*).
        idle: Share of the other offers that are empty: such a robot only receives.
        heat: With several copies, bids are distorted by up to this share at the start of a period,
            so that copies leave local optima.
        period: Rounds after which all copies restart from the best plan so far.
        cool: Share of a period after which bids are exact.
    """

    lists: int = 24
    longest: int = 3
    ends: float = 0.35
    idle: float = 0.3
    heat: float = 1.0
    period: int = 40
    cool: float = 0.5

    def heat_in(self, number: int) -> float:
        """Return the share by which bids are distorted in a round."""
        phase = number % self.period / self.period
        return self.heat * max(0.0, 1.0 - phase / self.cool)


class Improvement:
    """Improves a plan round by round; a task that is on no list stays on none.

    Args:
        random: Chooses the offers.

    Attributes:
        best: The best lists so far, (robots, places).
        best_score: What the objective makes of them.
    """

    def __init__(
        self,
        book: Book,
        objective: Objective,
        plan: Plan,
        random: np.random.Generator,
        search: Search | None = None,
    ) -> None:
        self._book = book
        self._search = search or Search()
        self.best = to_order(plan, book.nothing)
        self._objective = objective
        self._random = random
        self._number = 0
        self._copies = max(1, self._search.lists // len(plan))
        self._robots = np.tile(np.arange(len(plan)), (self._copies, 1))
        self._lists = np.tile(self.best, (self._copies, 1, 1))
        self.best_score = float(self._scores()[0])

    @property
    def plan(self) -> Plan:
        """The best plan so far."""
        return to_plan(self.best, self._book.nothing)

    @property
    def cells(self) -> int:
        """How many places a round evaluates, about."""
        return int(self._lists.size * self._lists.shape[1])

    @property
    def can_improve(self) -> bool:
        """Whether there is anything to choose: a robot and two tasks, or two robots and one."""
        tasks = int((self.best != self._book.nothing).sum())
        return tasks > 1 or (tasks == 1 and self.best.shape[0] > 1)

    def step(self) -> None:
        """Hold a round in each copy."""
        heat = self._search.heat_in(self._number) if self._copies > 1 else 0.0
        if self._number % self._search.period == 0:
            self.note_best()
            if self._copies > 1:
                self._lists = np.tile(self.best, (self._copies, 1, 1))
        self._number += 1
        start, size = self._offers()
        shape = (*self._robots.shape, self._robots.shape[-1])
        factor = 1.0 + heat * self._random.random(shape) if heat else 1.0
        lists = exchange(
            self._book, self._objective, self._robots, self._lists, start, size, factor
        )
        self._lists = narrow(lists, self._book.nothing)

    def note_best(self) -> None:
        """Keep the best of the copies if it is better than all before."""
        scores = self._scores()
        if scores.min() < self.best_score:
            self.best = self._lists[int(scores.argmin())]
            self.best_score = float(scores.min())

    def _scores(self) -> Floats:
        """Return the score of each copy: the sum over its lists."""
        table = Timetable(self._book, self._robots, self._lists)
        scores: Floats = self._objective(table).sum(axis=-1)
        return scores

    def _offers(self) -> tuple[Numbers, Numbers]:
        """Return the start and the size of each offered bundle."""
        search = self._search
        length = (self._lists != self._book.nothing).sum(axis=-1)
        where, how_many, who = self._random.random((3, *length.shape))
        if self._random.random() < search.ends:
            start = (where * (length + 1)).astype(int)
            return start, length - start
        start = (where * length).astype(int)
        size = 1 + (how_many * search.longest).astype(int)
        return start, np.where(who < search.idle, 0, np.minimum(size, length - start))
