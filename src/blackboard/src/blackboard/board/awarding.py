# SPDX-License-Identifier: BSD-3-Clause
"""Carries out what an auction decides: assigns tasks, splits what is too heavy for every robot."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, Protocol

from blackboard.auction.decision import Decision, what_would_help
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
    """Has changes of the task list committed and told; see `Blackboard`."""

    def __call__(self, *records: TaskRecord, then: Callable[[], None]) -> None:
        """Commit records; `then` is called once they cannot be lost any more."""


class Awarding:
    """Carries out the results of auctions.

    Args:
        node: Has the task list.
        orders: Tells robots what they have won.
        in_service: Says which robots take tasks.
        commit: Has changes committed.
        talker: Knows the time, and whom to warn that decisions cannot be written.
        book: Where decisions are noted, with all bids.
    """

    def __init__(
        self,
        node: RaftNode,
        orders: Orders,
        in_service: Callable[[], frozenset[str]],
        commit: Commit,
        talker: Talker,
        book: DecisionBook,
    ) -> None:
        self._node = node
        self._orders = orders
        self._in_service = in_service
        self._commit = commit
        self._talker = talker
        self._book = book

    def carry_out(self, result: Result, then: Callable[[], None]) -> None:
        """Assign tasks to their winners and split tasks that are too heavy, as one change.

        Args:
            result: Of a round.
            then: Called when the winners have their orders.
        """
        assigned = [record for bid in result.awards for record in self._assigned(bid)]
        changed = list(assigned)
        for task_id, reason in result.impossible:
            record = self._node.get(task_id)
            if record is not None and record.state is TaskState.WAITING:
                changed += self._impossible(record, result.bids.get(task_id, ()), reason, changed)

        def order() -> None:
            for record in assigned:
                self._orders.give(record)
            then()

        if changed:
            self._commit(*changed, then=order)
        else:
            then()
        # While the other members write the change to disk.
        self._note(result, changed)

    def _assigned(self, bid: Bid) -> Iterable[TaskRecord]:
        record = self._node.get(bid.task_id)
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
        """Return the records of a task that was split, or else the task with a new reason."""

        def is_taken(task_id: str) -> bool:
            listed = self._node.get(task_id) is not None
            return listed or any(other.task.id == task_id for other in changed)

        try:
            if divided := split(record, bids, self._in_service(), is_taken, self._node.earlier):
                return divided
        except SplitRefusedError as error:
            reason = f"{reason}; {error}"
        if helps := what_would_help(record.task, bids):
            reason = f"{reason}; what would help: {helps}"
        return () if record.reason == reason else (replace(record, reason=reason),)

    def _note(self, result: Result, changed: Iterable[TaskRecord]) -> None:
        """Note the decisions, but not again for the same reason that nobody can take a task."""
        given = [(bid.task_id, bid.robot_id, result.reason) for bid in result.awards]
        refused = {
            record.task.id: record.reason
            for record in changed
            if record.state is TaskState.WAITING and not record.parts
        }
        now, silent = self._talker.now(), tuple(sorted(result.silent))
        try:
            self._book.note(
                Decision(
                    task_id,
                    *result.auction,
                    at=now,
                    winner=winner,
                    reason=reason,
                    bids=tuple(result.bids.get(task_id, ())),
                    silent=silent,
                )
                for task_id, winner, reason in [
                    *given,
                    *((task_id, "", reason) for task_id, reason in refused.items()),
                ]
            )
        except JournalError as error:
            self._talker.warn(f"the reasons for these assignments are lost: {error}")
