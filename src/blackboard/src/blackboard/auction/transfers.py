# SPDX-License-Identifier: BSD-3-Clause
"""Tasks on their way from one robot's schedule to another's, because the fleet gains by it.

The robots that have them are asked to hand them back. Each such task is kept out of auctions until
all tasks of its exchange are back, since half a swap is no gain; then they are awarded as decided.
If that fails because a robot has begun, has won another task, or is out of service, the tasks are
auctioned like any other.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, NamedTuple

from blackboard.domain.task import TaskState

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Mapping

    from blackboard.auction.auction import Bundle
    from blackboard.domain.bid import Bid
    from blackboard.domain.record import TaskRecord


class Move(NamedTuple):
    """A bundle that another robot gets."""

    records: Bundle  # its tasks, as the giver holds them
    taker: Bid  # the bid of the robot that gets it
    bids: tuple[Bid, ...]  # all bids on it
    place: int = 0  # where it goes in the taker's list, 1 is first; 0 if the taker decides

    def __str__(self) -> str:
        tasks = " and ".join(record.task.id for record in self.records)
        return f"{tasks} from {self.giver} to {self.taker.robot_id}"

    @property
    def giver(self) -> str:
        """The robot that has it."""
        return self.records[0].robot

    @property
    def awards(self) -> tuple[Bid, ...]:
        """The taker's bid as one bid on each task."""
        return tuple(replace(self.taker, task_id=each.task.id, size=1) for each in self.records)


Exchange = tuple[Move, ...]
"""Moves that gain only together."""


@dataclass(frozen=True, slots=True)
class Transfers:
    """The transfers under way."""

    exchanges: tuple[Exchange, ...] = ()  # those whose tasks have not all been handed back
    # Number of the assignment under which each task was recalled, by task id.
    recalled: Mapping[str, int] = field(default_factory=dict)
    decided_in: tuple[int, int, int] = (0, 0, 0)  # epoch, auction and round that decided on them

    def begin(
        self,
        exchanges: Iterable[Exchange],
        get: Callable[[str], TaskRecord | None],
        decided_in: tuple[int, int, int] = (0, 0, 0),
    ) -> Transfers:
        """Return transfers with new exchanges in place of the old; `records` is to be recalled."""
        recalled = {
            task_id: assignment
            for task_id, assignment in self.recalled.items()
            if (record := get(task_id)) is not None and record.assignment == assignment
        }
        begun = Transfers(tuple(exchanges), decided_in=decided_in)
        recalled |= {record.task.id: record.assignment for record in begun.records}
        return replace(begun, recalled=recalled)

    def give_up(self) -> Transfers:
        """Leave everything under way to the next auction."""
        return replace(self, exchanges=())

    def without_taker(self, robot: str) -> Transfers:
        """Leave what a robot would get to the next auction: its schedule differs from its bid."""
        return replace(
            self,
            exchanges=tuple(
                exchange
                for exchange in self.exchanges
                if all(move.taker.robot_id != robot for move in exchange)
            ),
        )

    def ready(
        self, in_service: frozenset[str], get: Callable[[str], TaskRecord | None]
    ) -> tuple[Transfers, list[Move]]:
        """Return the transfers that are still under way, and the moves to be awarded now."""
        pending: list[Exchange] = []
        moves: list[Move] = []
        for exchange in self.exchanges:
            records = [record for move in exchange for record in move.records]
            states = {_state(get, record) for record in records}
            if any(move.taker.robot_id not in in_service for move in exchange):
                continue
            if states == {TaskState.WAITING}:
                moves += exchange
            elif all(
                _state(get, record) in {record.state, TaskState.WAITING} for record in records
            ):
                pending.append(exchange)
        return replace(self, exchanges=tuple(pending)), moves

    @property
    def records(self) -> Iterable[TaskRecord]:
        """The tasks under way, as they were recalled."""
        return (
            record for exchange in self.exchanges for move in exchange for record in move.records
        )

    @property
    def task_ids(self) -> frozenset[str]:
        """Ids of the tasks under way, which no auction offers."""
        return frozenset(record.task.id for record in self.records)

    def has_recalled(self, record: TaskRecord) -> bool:
        """Return whether a task is handed back for a transfer rather than tried in vain."""
        return self.recalled.get(record.task.id) == record.assignment


def _state(get: Callable[[str], TaskRecord | None], recalled: TaskRecord) -> TaskState | None:
    """Return the state of a recalled task; None if it has been assigned again since."""
    record = get(recalled.task.id)
    if record is None or record.assignment != recalled.assignment:
        return None
    return record.state
