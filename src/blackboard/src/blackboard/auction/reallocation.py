# SPDX-License-Identifier: BSD-3-Clause
"""Goes on improving who does what: tasks that have not begun are offered again.

In each step every robot offers a piece of its list, one task or all from some task on, and every
robot bids on all of these for a list without what it offers itself. They are given out so that the
sum of what is measured is least, one to each robot at most (the assignment problem); so a step
moves tasks, swaps them, exchanges the ends of lists (2-opt*), or passes them on in a ring, as in
`allocation.exchange`. What gains enough `transfers.py` carries out: a task is with nobody until
its robot has let go of it, and a robot that has begun keeps it.

What is measured is not what was bid: that says whom a task is to go to, but not with every cost
model whether to take it from the one that has it. Where only its own time counts, for example,
each could be put before all others again and again.
"""

from __future__ import annotations

from collections import defaultdict
from itertools import takewhile
from typing import TYPE_CHECKING

import numpy as np
from scipy.sparse import csr_array
from scipy.sparse.csgraph import min_weight_full_bipartite_matching

from blackboard.auction.transfers import Move
from blackboard.costing.cost import MEASURES
from blackboard.domain.record import TaskRecord
from blackboard.domain.task import TaskState

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Mapping, Sequence

    from blackboard.auction.transfers import Exchange
    from blackboard.domain.bid import Bid, CostTerms
    from blackboard.domain.characteristics import RobotStatus


PASSES = 3
"""In one of so many passes through its list a robot only takes."""


Bundle = tuple[TaskRecord, ...]
"""Tasks of one robot that are offered as one, in the order of its list."""


class Reallocation:
    """Chooses what is offered, and which of it is to change hands.

    Steps follow each other until every robot has offered all of its list a few times without a
    gain; then they rest until something changes.

    Args:
        held: Gives the records of all that robots have on their lists.
        last: Gives the last status of a robot, with its list in order; None if it was never heard.
        measure: A name of `MEASURES`.
        threshold: Tasks change hands only where that lowers what is measured by more than this
            share, so that assignments do not flutter.
    """

    def __init__(
        self,
        held: Callable[[], Iterable[TaskRecord]],
        last: Callable[[str], RobotStatus | None],
        measure: str,
        threshold: float,
    ) -> None:
        self._held = held
        self._last = last
        self._measure = MEASURES[measure]
        self._threshold = threshold
        self._turn = 0
        self._quiet_steps = 0

    def note_change(self) -> None:
        """Begin to offer again: what was best may be so no longer."""
        self._quiet_steps = 0

    def offers(self, robots: frozenset[str], most: int) -> list[Bundle]:
        """Return what is offered in the next step, one piece of each robot; nothing at rest.

        Args:
            robots: Those that are in service.
            most: So many of them offer at a time; of a larger fleet others in each step.
        """
        lists = self._lists(robots)
        longest = max(map(len, lists), default=0)
        groups = -(-len(lists) // most)
        steps = PASSES * longest * groups
        if len(robots) < 2 or self._quiet_steps >= steps:  # noqa: PLR2004  (two can exchange)
            return []
        self._turn += 1
        self._quiet_steps += 1
        turn, group = divmod(self._turn, groups)
        # In each pass the same task of one robot meets another task of the next, and other robots
        # only take: who offers something as well cannot take without giving.
        number, turn = divmod(turn, longest)
        take = _rest if number % 2 else _one
        return [
            take(records, (turn + number // 2 * place) % len(records))
            for place, records in enumerate(lists[group::groups])
            if (place + number) % PASSES
        ]

    def _lists(self, robots: frozenset[str]) -> list[Bundle]:
        """Return what each robot has that has not begun, in the order of its list."""
        lists = defaultdict(list)
        for record in self._held():
            if record.state is TaskState.ASSIGNED and record.robot in robots:
                lists[record.robot].append(record)
        return [self._in_order(robot, records) for robot, records in sorted(lists.items())]

    def _in_order(self, robot: str, records: Iterable[TaskRecord]) -> Bundle:
        """Return the tasks of a robot in the order of its list; what it has not shown yet last."""
        status = self._last(robot)
        known = status.tasks if status is not None else ()
        place = {task_id: number for number, task_id in enumerate(known)}
        return tuple(sorted(records, key=lambda each: place.get(each.task.id, len(place))))

    def decide(self, offers: Iterable[tuple[Bundle, Sequence[Bid]]]) -> list[Exchange]:
        """Return what is to change hands.

        Args:
            offers: Each with what was bid on it, by the robot that has it too.
        """
        found = exchanges(offers, self._measure, self._threshold)
        if found:
            self.note_change()
        return found


def _one(records: Bundle, place: int) -> Bundle:
    """Return one task of a list."""
    return records[place : place + 1]


def _rest(records: Bundle, place: int) -> Bundle:
    """Return a list from a task on, as far as it is of one priority."""
    priority = records[place].task.priority
    return tuple(takewhile(lambda each: each.task.priority == priority, records[place:]))


def exchanges(
    offers: Iterable[tuple[Bundle, Sequence[Bid]]],
    measure: Callable[[CostTerms], float],
    threshold: float,
) -> list[Exchange]:
    """Return which offers other robots are to have, put together where one gains by another.

    Args:
        offers: One of each robot at most, with what was bid on it; one that its own robot does not
            bid on stays there.
        measure: What of the bids is to become less.
        threshold: It has to become less by more than this share of what changes hands.
    """
    rows = [(bundle, bids, _worth(bids, bundle, measure)) for bundle, bids in offers]
    rows = [row for row in rows if row[0][0].robot in row[2]]
    if not rows:
        return []
    takers = _takers([worth for _, _, worth in rows])
    moves = {}
    gains = {}
    for (bundle, bids, worth), taker in zip(rows, takers, strict=True):
        giver = bundle[0].robot
        if taker != giver:
            taken = next(bid for bid in bids if bid.robot_id == taker)
            moves[giver] = Move(bundle, taken, tuple(bids))
            gains[giver] = worth[giver] - worth[taker] - threshold * worth[giver]
    return [
        exchange for exchange in _linked(moves) if sum(gains[move.giver] for move in exchange) > 0
    ]


def _worth(
    bids: Iterable[Bid], bundle: Bundle, measure: Callable[[CostTerms], float]
) -> dict[str, float]:
    """Return what is measured, by robot, without those that have tried in vain to do a task."""
    tried = {robot for record in bundle for robot in record.tried} - {bundle[0].robot}
    return {
        bid.robot_id: measure(bid.terms)
        for bid in bids
        if bid.is_able and bid.terms is not None and bid.robot_id not in tried
    }


def _takers(worths: Sequence[Mapping[str, float]]) -> list[str]:
    """Return who is to have each, nobody two, so that what is measured is least in all.

    Args:
        worths: By robot; each has to have a robot of its own that could take it.
    """
    robots = sorted({robot for worth in worths for robot in worth})
    rows = [row for row, worth in enumerate(worths) for _ in worth]
    columns = [robots.index(robot) for worth in worths for robot in worth]
    values = np.array([value for worth in worths for value in worth.values()])
    # Zero would say that a robot cannot; what is added to all changes nothing in who takes what.
    weights = csr_array((values - values.min() + 1.0, (rows, columns)))
    return [robots[column] for column in min_weight_full_bipartite_matching(weights)[1]]


def _linked(moves: dict[str, Move]) -> list[Exchange]:
    """Return moves, by the robots that give something away, as chains and rings."""
    takers = {move.taker.robot_id for move in moves.values()}
    found = []
    # Chains begin where nothing is taken; what is left are rings, and begin anywhere.
    for first in sorted(moves, key=lambda giver: (giver in takers, giver)):
        chain, giver = [], first
        while giver in moves:
            chain.append(moves.pop(giver))
            giver = chain[-1].taker.robot_id
        found.append(tuple(chain))
    return [exchange for exchange in found if exchange]
