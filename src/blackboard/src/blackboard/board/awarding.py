# SPDX-License-Identifier: BSD-3-Clause
"""Carries out what an auction has decided: gives tasks away, splits what is too heavy for all."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, Protocol

from blackboard.auction.advice import what_would_help
from blackboard.auction.decision import Decision
from blackboard.auction.splitting import split
from blackboard.domain.task import TaskEvent, TaskState, unused_goals
from blackboard.errors import JournalError, SplitRefusedError

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable

    from blackboard.auction.auction import Result
    from blackboard.auction.decision_log import DecisionBook
    from blackboard.board.orders import Orders
    from blackboard.consensus.node import RaftNode
    from blackboard.domain.bid import Bid
    from blackboard.domain.record import TaskRecord
    from blackboard.domain.talker import Talker


class Commit(Protocol):
    """Has changes of the task list written down and told; see `Blackboard`."""

    def __call__(self, *records: TaskRecord, then: Callable[[], None]) -> None:
        """Write down; `then` is called once it cannot be lost any more."""


class Awarding:
    """Carries out the results of auctions.

    Args:
        backup: Knows where each task stands.
        orders: Tells robots what they have won.
        in_service: Says which robots take tasks.
        commit: Has changes written down.
        talker: Knows the time, and whom to tell that the book cannot be written.
        book: Where decisions are noted, with all that was bid.
    """

    def __init__(
        self,
        backup: RaftNode,
        orders: Orders,
        in_service: Callable[[], frozenset[str]],
        commit: Commit,
        talker: Talker,
        book: DecisionBook,
    ) -> None:
        self._backup = backup
        self._orders = orders
        self._in_service = in_service
        self._commit = commit
        self._talker = talker
        self._book = book

    def carry_out(self, result: Result, then: Callable[[], None]) -> None:
        """Give tasks to the robots that have won them, and split what is too heavy for all.

        All of it is one change of the task list.

        Args:
            result: Of a round.
            then: Called when robots have been told.
        """
        assigned = [record for bid in result.awards for record in self._assigned(bid)]
        changed = list(assigned)
        for task_id, reason in result.impossible:
            record = self._backup.get(task_id)
            if record is not None and record.state is TaskState.WAITING:
                changed += self._impossible(record, result.bids.get(task_id, ()), reason, changed)

        def tell() -> None:
            for record in assigned:
                self._orders.give(record)
            then()

        if changed:
            self._commit(*changed, then=tell)
        else:
            then()
        # While the others write the change down.
        self._note(result, changed)

    def _note(self, result: Result, changed: Iterable[TaskRecord]) -> None:
        """Write down why; what nobody could take again for the same reason is there already."""
        refusals = {
            record.task.id: record.reason
            for record in changed
            if record.state is TaskState.WAITING and not record.parts
        }
        given = [(bid.task_id, bid.robot_id, result.reason) for bid in result.awards]
        refused = [(task_id, "", reason) for task_id, reason in refusals.items()]
        epoch, auction, round_ = result.auction
        try:
            self._book.note(
                Decision(
                    task_id,
                    epoch,
                    auction,
                    round_,
                    self._talker.now(),
                    winner,
                    reason,
                    tuple(result.bids.get(task_id, ())),
                    tuple(sorted(result.silent)),
                )
                for task_id, winner, reason in given + refused
            )
        except JournalError as error:
            self._talker.warn(f"it will not be known why tasks were given out: {error}")

    def _assigned(self, bid: Bid) -> Iterable[TaskRecord]:
        record = self._backup.get(bid.task_id)
        if record is None:
            return
        assigned = record.after(
            TaskEvent.ASSIGN,
            robot=bid.robot_id,
            assignment=record.assignment + 1,
            eta=bid.eta,
            step_eta=0.0,
            reason=unused_goals(record.task),
        )
        if assigned is not None:
            yield assigned

    def _impossible(
        self, record: TaskRecord, bids: Iterable[Bid], reason: str, changed: Iterable[TaskRecord]
    ) -> Iterable[TaskRecord]:

        def is_taken(task_id: str) -> bool:
            listed = self._backup.get(task_id) is not None
            return listed or any(other.task.id == task_id for other in changed)

        robots, earlier = self._in_service(), self._backup.earlier
        try:
            if divided := split(record, bids, robots, is_taken, earlier):
                return divided
        except SplitRefusedError as error:
            reason = f"{reason}; {error}"
        if helps := what_would_help(record.task, bids):
            reason = f"{reason}; what would help: {helps}"
        return () if record.reason == reason else (replace(record, reason=reason),)
