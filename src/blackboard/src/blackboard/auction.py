# SPDX-License-Identifier: BSD-3-Clause
"""One round of bidding: who was asked for what, who answered, and who gets which task.

A round gives each robot one task at most, because a bid holds only for the list that the robot had
when it was made; what is left goes into the next round.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from operator import attrgetter
from typing import TYPE_CHECKING

from blackboard.cost import MAX_COST
from blackboard.errors import BidRefusedError
from blackboard.preemption import best_bid

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping

    from blackboard.cost import Bid, Bids
    from blackboard.record import TaskRecord


@dataclass(frozen=True, slots=True)
class Result:
    """What a round has decided.

    Attributes:
        awards: The winning bids, no two of one robot.
        impossible: Tasks that nobody can take, each with the reason.
        bids: What was bid on those, by their ids.
    """

    awards: tuple[Bid, ...]
    impossible: tuple[tuple[str, str], ...]
    bids: Mapping[str, tuple[Bid, ...]] = field(default_factory=dict)


class Auction:
    """One round of bidding.

    Args:
        epoch: Of the blackboard that asks.
        number: Of the round within the epoch.
        records: The tasks that are offered.
        expected: The robots whose answers are waited for.
    """

    def __init__(
        self, epoch: int, number: int, records: Iterable[TaskRecord], expected: Iterable[str]
    ) -> None:
        self.epoch = epoch
        self.number = number
        self._records = {record.task.id: record for record in records}
        self._offered = frozenset(self._records)
        self._missing = set(expected)
        self._bids: dict[str, dict[str, Bid]] = {}
        self._answered: set[str] = set()

    @property
    def missing(self) -> frozenset[str]:
        """The robots that have not answered yet."""
        return frozenset(self._missing)

    def take(self, answer: Bids) -> None:
        """Take in a robot's bids; a second answer of the same robot replaces its first.

        A robot whose answer is refused is not waited for any longer: it would send the same again.

        Raises:
            BidRefusedError: It answers another round, or one of its bids is no cost.
        """
        if (answer.epoch, answer.auction) != (self.epoch, self.number):
            raise BidRefusedError(
                f"{answer.robot_id} answers auction {answer.epoch}/{answer.auction}, "
                f"open is {self.epoch}/{self.number}"
            )
        if not answer.robot_id:
            raise BidRefusedError("bids without a robot's name; robot_id says who bids")
        self._missing.discard(answer.robot_id)
        self._answered.add(answer.robot_id)
        for bid in answer.bids:
            self._check(bid)
        self._bids[answer.robot_id] = {bid.task_id: bid for bid in answer.bids}

    def _check(self, bid: Bid) -> None:
        if bid.task_id not in self._offered:
            raise BidRefusedError(f"{bid.robot_id} bids on {bid.task_id[:64]!r}: not offered")
        if not 0.0 <= bid.cost <= MAX_COST:
            raise BidRefusedError(
                f"{bid.robot_id} bids {bid.cost:g} on {bid.task_id}; "
                f"allowed: from 0 to {MAX_COST:.0f}"
            )
        if bid.is_able and not 0.0 <= bid.eta < math.inf:
            raise BidRefusedError(
                f"{bid.robot_id} would have {bid.task_id} done in {bid.eta:g} s; "
                "allowed: at least 0 s"
            )

    def withdraw(self, task_id: str) -> None:
        """Offer a task no more; bids on it are still heard, and change nothing."""
        self._records.pop(task_id, None)

    def result(self) -> Result:
        """Decide on what has been bid so far: the best robot gets the most urgent task."""
        awards: dict[str, Bid] = {}
        impossible = []
        urgent_first = sorted(self._records.values(), key=lambda record: -record.task.priority)
        for record in urgent_first:
            best = best_bid(record, filter(attrgetter("is_able"), self._of(record.task.id)))
            if best is None:
                impossible.append((record.task.id, self._refusals(record.task.id)))
            elif best.robot_id not in awards:
                awards[best.robot_id] = best
        bids = {task_id: tuple(self._of(task_id)) for task_id, _ in impossible}
        return Result(tuple(awards.values()), tuple(impossible), bids)

    def _refusals(self, task_id: str) -> str:
        given = {bid.robot_id: bid.reason for bid in self._of(task_id)}
        reasons = [
            f"{robot}: {given.get(robot) or 'has made no valid bid'}"
            for robot in sorted(self._answered)
        ]
        reasons += [f"{robot}: has not answered" for robot in sorted(self._missing)]
        return "nobody can take it now: " + "; ".join(reasons)

    def _of(self, task_id: str) -> list[Bid]:
        return [bids[task_id] for robot, bids in sorted(self._bids.items()) if task_id in bids]
