# SPDX-License-Identifier: BSD-3-Clause
"""A plan in the making, in pieces of work so small that nothing else has to wait for them.

First the situation is surveyed, then what is on no list is auctioned, then the plan is improved
for as long as that pays. Work is counted in what is evaluated, not measured by a clock: the same
situation leads to the same plan on any machine.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import numpy as np

from blackboard.auction.search.improvement import Improvement, Search
from blackboard.auction.search.objectives import OBJECTIVES
from blackboard.auction.search.plan import to_order
from blackboard.auction.search.sequential import Sequential
from blackboard.auction.search.survey import Surveyed, survey
from blackboard.auction.search.timetable import Book, Timetable

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping

    from blackboard.auction.search.survey import Situation
    from blackboard.domain.record import TaskRecord

ROUND_TIME, CELL_TIME = 3e-4, 2.5e-8
"""Processor time of a round, and of each place that it evaluates [s]; measured with 4 to 100
robots (docs/benchmarks.md)."""

NOTICEABLE = 0.001
"""A smaller share of the measure is not worth waiting for."""


@dataclass(frozen=True, slots=True)
class Patience:
    """How long a plan is improved, in processor time [s].

    Attributes:
        longest: At most this long.
        without_gain: And this long after the last noticeable gain.
    """

    longest: float
    without_gain: float


@dataclass(frozen=True, slots=True)
class Place:
    """Where a task goes by a plan.

    Attributes:
        record: The task as it was when the plan was begun.
        robot: Who gets it.
        place: In the robot's list; 1 is first.
        eta: Time from then on until it is done [s].
    """

    record: TaskRecord
    robot: str
    place: int
    eta: float


@dataclass(frozen=True, slots=True)
class Planned:
    """A plan, and how good it is.

    Attributes:
        places: Where each task goes, list by list.
        left: Tasks that are on no list.
        before: The measure of the lists as they were; infinite if something was on none.
        after: The measure of the plan.
        was: The lists as they were, by robot.
    """

    places: tuple[Place, ...] = ()
    left: tuple[TaskRecord, ...] = ()
    before: float = 0.0
    after: float = 0.0
    was: Mapping[str, tuple[str, ...]] = field(default_factory=dict)

    @property
    def gain(self) -> float:
        """The share by which the measure falls."""
        if math.isinf(self.before):
            return 1.0
        return (self.before - self.after) / self.before if self.before > self.after else 0.0


class Planner:
    """Makes one plan.

    Args:
        measure: What it minimizes, a name of `OBJECTIVES`.
        seed: Of the choices that are left to chance.

    Attributes:
        spent: Processor time so far [s], as it is counted.
    """

    def __init__(
        self,
        situation: Situation,
        measure: str,
        patience: Patience,
        seed: tuple[int, ...],
        search: Search | None = None,
    ) -> None:
        self._situation = situation
        self._objective = OBJECTIVES[measure]
        self._patience = patience
        self._random = np.random.default_rng(seed)
        self._search = search
        self._work = self._pieces()
        self._planned = Planned(left=tuple(situation.records))
        self.spent = 0.0

    def advance(self, seconds: float) -> Planned | None:
        """Work for a processor time [s]; return the plan once it is made."""
        until = self.spent + seconds
        for taken in self._work:
            self.spent += taken
            if self.spent >= until:
                return None
        return self._planned

    def _pieces(self) -> Iterator[float]:
        found: Surveyed | None = None
        for piece in survey(self._situation):
            if isinstance(piece, Surveyed):
                found = piece
            else:
                yield piece
        if found is None:
            return
        book = Book(found.problem)
        auction = Sequential(book, self._objective, found.plan)
        open_tasks = book.nothing - sum(map(len, found.plan))
        while auction.step():
            yield ROUND_TIME / 3 + CELL_TIME * open_tasks * (1 + max(map(len, auction.lists)))
        improvement = Improvement(
            book,
            self._objective,
            tuple(map(tuple, auction.lists)),
            self._random,
            self._search,
        )
        before = np.inf if open_tasks else improvement.best_score
        yield from self._improve(improvement)
        self._planned = _planned(found, book, improvement, float(before))

    def _improve(self, improvement: Improvement) -> Iterator[float]:
        """Improve a plan for as long as it pays."""
        begun = last = self.spent
        noted = improvement.best_score
        while (
            improvement.can_improve
            and self.spent - begun < self._patience.longest
            and self.spent - last < self._patience.without_gain
        ):
            improvement.step()
            yield ROUND_TIME + CELL_TIME * improvement.cells
            if improvement.best_score < noted * (1 - NOTICEABLE):
                noted, last = improvement.best_score, self.spent
        improvement.note_best()


def _planned(found: Surveyed, book: Book, improvement: Improvement, before: float) -> Planned:
    plan = improvement.plan
    table = Timetable(book, np.arange(len(plan)), to_order(plan, book.nothing))
    places = tuple(
        Place(
            found.records[task],
            found.robots[robot],
            found.fixed[robot] + position + 1,
            float(table.done[robot, position + 1]),
        )
        for robot, row in enumerate(plan)
        for position, task in enumerate(row)
    )
    listed = {place.record.task.id for place in places}
    left = tuple(record for record in found.records if record.task.id not in listed)
    was = {
        robot: tuple(found.records[task].task.id for task in row)
        for robot, row in zip(found.robots, found.plan, strict=True)
    }
    return Planned(places, left, before, improvement.best_score, was)
