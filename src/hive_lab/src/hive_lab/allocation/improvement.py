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

from hive_lab.allocation.exchange import exchange
from hive_lab.allocation.plan import narrow, to_order, to_plan
from hive_lab.allocation.timetable import Book, Timetable

if TYPE_CHECKING:
    from collections.abc import Callable

    from hive_lab.allocation.instance import Instance
    from hive_lab.allocation.objectives import Objective
    from hive_lab.allocation.plan import Plan
    from hive_lab.allocation.timetable import Floats, Numbers


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
        threshold: A plan changes only for a gain above this share of its score, so that
        assignments
            do not flutter.
    """

    lists: int = 24
    longest: int = 3
    ends: float = 0.35
    idle: float = 0.3
    heat: float = 1.0
    period: int = 40
    cool: float = 0.5
    threshold: float = 0.0

    def heat_in(self, number: int) -> float:
        """Return the share by which bids are distorted in a round."""
        phase = number % self.period / self.period
        return self.heat * max(0.0, 1.0 - phase / self.cool)


def improve(
    instance: Instance,
    objective: Objective,
    plan: Plan,
    random: np.random.Generator,
    go_on: Callable[[], bool],
    search: Search | None = None,
) -> Plan:
    """Return a plan that is at least as good; a task on no list stays on none.

    `random` chooses the offers. `go_on` is asked before each round whether to continue.
    """
    if not any(plan):
        return plan
    hunt = _Hunt(Book(instance), objective, plan, random, search or Search())
    before = hunt.best_score
    while go_on():
        hunt.step()
    hunt.note_best()
    if before - hunt.best_score <= hunt.search.threshold * before:
        return plan
    return to_plan(hunt.best, hunt.book.nothing)


class _Hunt:
    """The copies of a plan that are searched side by side, and the best one seen."""

    def __init__(
        self,
        book: Book,
        objective: Objective,
        plan: Plan,
        random: np.random.Generator,
        search: Search,
    ) -> None:
        self.book = book
        self.search = search
        self.best = to_order(plan, book.nothing)
        self._objective = objective
        self._random = random
        self._number = 0
        self._copies = max(1, search.lists // len(plan))
        self._robots = np.tile(np.arange(len(plan)), (self._copies, 1))
        self._lists = np.tile(self.best, (self._copies, 1, 1))
        self.best_score = float(self._scores()[0])

    def step(self) -> None:
        """Hold a round in each copy."""
        heat = self.search.heat_in(self._number) if self._copies > 1 else 0.0
        if self._copies > 1 and self._number % self.search.period == 0:
            self.note_best()
            self._lists = np.tile(self.best, (self._copies, 1, 1))
        self._number += 1
        start, size = self._offers()
        shape = (*self._robots.shape, self._robots.shape[-1])
        factor = 1.0 + heat * self._random.random(shape) if heat else 1.0
        lists = exchange(
            self.book, self._objective, self._robots, self._lists, start, size, factor
        )
        self._lists = narrow(lists, self.book.nothing)

    def note_best(self) -> None:
        """Keep the best of the copies if it is better than all before."""
        scores = self._scores()
        if scores.min() < self.best_score:
            self.best = self._lists[int(scores.argmin())]
            self.best_score = float(scores.min())

    def _scores(self) -> Floats:
        """Return the score of each copy: the sum over its lists."""
        table = Timetable(self.book, self._robots, self._lists)
        scores: Floats = self._objective(table).sum(axis=-1)
        return scores

    def _offers(self) -> tuple[Numbers, Numbers]:
        """Return the start and the size of each offered bundle."""
        search = self.search
        length = (self._lists != self.book.nothing).sum(axis=-1)
        where, how_many, who = self._random.random((3, *length.shape))
        if self._random.random() < search.ends:
            start = (where * (length + 1)).astype(int)
            return start, length - start
        start = (where * length).astype(int)
        size = 1 + (how_many * search.longest).astype(int)
        return start, np.where(who < search.idle, 0, np.minimum(size, length - start))
