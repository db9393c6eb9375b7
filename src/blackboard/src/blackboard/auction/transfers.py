# SPDX-License-Identifier: BSD-3-Clause
"""Tasks on their way from one robot's list to another's, because both are better off so.

Their robots are asked to hand them back. Each is kept out of auctions until all that change hands
with it are there: a swap of which only one half happens is no gain. Then they are given out as was
decided. Where that fails, because a robot has begun meanwhile, has won something else, or is out
of service, they are auctioned like any other.
"""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, NamedTuple

from blackboard.domain.task import TaskState

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable

    from blackboard.domain.bid import Bid
    from blackboard.domain.record import TaskRecord


class Move(NamedTuple):
    """A task, or some that follow each other, that another robot is to have.

    Attributes:
        records: The tasks, with the robot that has them.
        taker: What the robot has bid that is to have it.
        bids: What all have bid on them.
    """

    records: tuple[TaskRecord, ...]
    taker: Bid
    bids: tuple[Bid, ...]

    def __str__(self) -> str:
        tasks = " and ".join(record.task.id for record in self.records)
        return f"{tasks} from {self.giver} to {self.taker.robot_id}"

    @property
    def giver(self) -> str:
        """The robot that has them."""
        return self.records[0].robot

    @property
    def awards(self) -> tuple[Bid, ...]:
        """What the robot has bid that is to have them, as a bid on each."""
        return tuple(replace(self.taker, task_id=each.task.id, size=1) for each in self.records)


Exchange = tuple[Move, ...]
"""Moves that gain only together."""


class Transfers:
    """Knows what is on its way, and what of it can be given out.

    Args:
        get: Gives the record of a task by its id; None where it is unknown.
        recall: Has a robot hand a task back if it has not begun.
    """

    def __init__(
        self,
        get: Callable[[str], TaskRecord | None],
        recall: Callable[[TaskRecord], None],
    ) -> None:
        self._get = get
        self._recall = recall
        self._under_way: list[Exchange] = []
        self._recalled: dict[str, int] = {}

    def begin(self, exchanges: Iterable[Exchange]) -> None:
        """Ask for what is to change hands."""
        self._recalled = {
            task_id: assignment
            for task_id, assignment in self._recalled.items()
            if (record := self._get(task_id)) is not None and record.assignment == assignment
        }
        self._under_way = list(exchanges)
        asked_for = list(self._records())
        self._recalled |= {record.task.id: record.assignment for record in asked_for}
        for record in asked_for:
            self._recall(record)

    def give_up(self) -> None:
        """Leave what is under way to the next auction."""
        self._under_way.clear()

    def leave_out(self, robot: str) -> None:
        """Leave to the next auction what a robot is to have: its list is not what it bid for."""
        self._under_way = [
            exchange
            for exchange in self._under_way
            if all(move.taker.robot_id != robot for move in exchange)
        ]

    def ready(self, robots: frozenset[str]) -> list[Move]:
        """Return what can be given out now, and keep it no longer.

        Args:
            robots: Those that are in service.
        """
        can = [
            exchange
            for exchange in self._under_way
            if all(move.taker.robot_id in robots for move in exchange)
            and self._states(exchange) <= {TaskState.ASSIGNED, TaskState.WAITING}
        ]
        complete = [each for each in can if self._states(each) == {TaskState.WAITING}]
        self._under_way = [exchange for exchange in can if exchange not in complete]
        return [move for exchange in complete for move in exchange]

    @property
    def kept(self) -> frozenset[str]:
        """The ids of the tasks that are under way."""
        return frozenset(record.task.id for record in self._records())

    def has_recalled(self, record: TaskRecord) -> bool:
        """Return whether a task is handed back because of this, and was not tried in vain."""
        return self._recalled.get(record.task.id) == record.assignment

    def _records(self) -> Iterable[TaskRecord]:
        return (
            record for exchange in self._under_way for move in exchange for record in move.records
        )

    def _states(self, exchange: Exchange) -> set[TaskState | None]:
        """Return where the tasks of an exchange stand; None for one that was given out since."""
        return {self._state(record) for move in exchange for record in move.records}

    def _state(self, asked_for: TaskRecord) -> TaskState | None:
        record = self._get(asked_for.task.id)
        if record is None or record.assignment != asked_for.assignment:
            return None
        return record.state
