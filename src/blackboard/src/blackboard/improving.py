# SPDX-License-Identifier: BSD-3-Clause
"""Goes on improving who does what: tasks that have not begun are offered again.

In each step every robot offers one task of its list, and every robot bids on all of these for a
list without what it offers itself. The offers are given out so that the sum of the bids is least,
one to each robot at most (the assignment problem); so a step moves tasks, swaps them, or passes
them on in a ring, as in `allocation.exchange`. Where that gains enough, the robots that are to
lose a task are asked to hand it back, and it is auctioned like any other: it is with nobody until
its robot has let go of it, and a robot that has begun keeps it.
"""

from __future__ import annotations

from collections import defaultdict
from typing import TYPE_CHECKING

import numpy as np
from scipy.optimize import linear_sum_assignment

from blackboard.cost import MAX_COST
from blackboard.task import TaskState

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Sequence

    from blackboard.cost import Bid
    from blackboard.record import TaskRecord

_REFUSED = 1e6 * MAX_COST
"""What stands for a bid that there is none of; the assignment needs finite numbers."""


class Improving:
    """Chooses what is offered, and which of it is to change hands.

    Steps follow each other until every task has been offered once without a gain; then they rest
    until something changes.

    Args:
        held: Gives the records of all that robots have on their lists.
        recall: Has a robot hand a task back if it has not begun.
        threshold: Tasks change hands only where that lowers the sum of the bids by more than this
            share, so that assignments do not flutter.
    """

    def __init__(
        self,
        held: Callable[[], Iterable[TaskRecord]],
        recall: Callable[[TaskRecord], None],
        threshold: float,
    ) -> None:
        self._held = held
        self._recall = recall
        self._threshold = threshold
        self._turn = 0
        self._quiet_steps = 0
        self._recalled: set[tuple[str, int]] = set()

    def note_change(self) -> None:
        """Begin to offer again: what was best may be so no longer."""
        self._quiet_steps = 0

    def offers(self, robots: frozenset[str], most: int) -> list[TaskRecord]:
        """Return what is offered in the next step, one task of each robot; nothing at rest.

        Args:
            robots: Those that are in service.
            most: So many of them offer at a time; of a larger fleet others in each step.
        """
        lists = defaultdict(list)
        for record in self._held():
            if record.state is TaskState.ASSIGNED and record.robot in robots:
                lists[record.robot].append(record)
        longest = max(map(len, lists.values()), default=0)
        groups = -(-len(lists) // most)
        if len(robots) < 2 or self._quiet_steps >= longest * groups:  # noqa: PLR2004  (two can exchange)
            return []
        self._turn += 1
        self._quiet_steps += 1
        turn, group = divmod(self._turn, groups)
        return [
            records[turn % len(records)] for _, records in sorted(lists.items())[group::groups]
        ]

    def decide(self, offers: Iterable[tuple[TaskRecord, Sequence[Bid]]]) -> None:
        """Have what is to change hands handed back.

        Args:
            offers: Each with what was bid on it, by the robot that has it too.
        """
        moves = moved(offers, self._threshold)
        for record in moves:
            self._recalled.add((record.task.id, record.assignment))
            self._recall(record)
        if moves:
            self.note_change()

    def has_recalled(self, record: TaskRecord) -> bool:
        """Return whether a task is handed back because of this, and was not tried in vain."""
        return (record.task.id, record.assignment) in self._recalled


def moved(
    offers: Iterable[tuple[TaskRecord, Sequence[Bid]]], threshold: float
) -> list[TaskRecord]:
    """Return the offers that another robot is to have.

    Args:
        offers: Each with what was bid on it; one that its own robot does not bid on stays there.
        threshold: The sum of the bids has to become less by more than this share.
    """
    rows = [(record, {bid.robot_id: bid.cost for bid in bids}) for record, bids in offers]
    rows = [
        (record, costs) for record, costs in rows if costs.get(record.robot, MAX_COST) < MAX_COST
    ]
    robots = sorted({robot for _, costs in rows for robot in costs})
    if not rows:
        return []
    cost = np.full((len(rows), len(robots)), _REFUSED)
    for row, (record, costs) in enumerate(rows):
        for robot, value in costs.items():
            if value < MAX_COST and (robot == record.robot or robot not in record.tried):
                cost[row, robots.index(robot)] = value
    now = sum(costs[record.robot] for record, costs in rows)
    order, takers = linear_sum_assignment(cost)
    if now - cost[order, takers].sum() <= threshold * now:
        return []
    return [
        rows[row][0]
        for row, taker in zip(order, takers, strict=True)
        if robots[taker] != rows[row][0].robot
    ]
