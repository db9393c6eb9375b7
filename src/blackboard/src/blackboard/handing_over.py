# SPDX-License-Identifier: BSD-3-Clause
"""Tasks on their way from one robot's list to another's, because both are better off so.

Their robots are asked to hand them back. Each is kept out of auctions until all that change hands
with it are there: a swap of which only one half happens is no gain. Then they are given out as was
decided. Where that fails, because a robot has begun meanwhile, or has won or lost something else,
they are auctioned like any other.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

from blackboard.task import TaskState

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable

    from blackboard.cost import Bid
    from blackboard.record import TaskRecord


class Move(NamedTuple):
    """A task that another robot is to have.

    Attributes:
        record: The task, with the robot that has it.
        taker: What the robot has bid that is to have it.
        bids: What all have bid on it.
    """

    record: TaskRecord
    taker: Bid
    bids: tuple[Bid, ...]


Exchange = tuple[Move, ...]
"""Moves that gain only together."""


class HandingOver:
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
        for move in self._moves():
            self._recalled[move.record.task.id] = move.record.assignment
        for move in self._moves():
            self._recall(move.record)

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
            if all(
                move.taker.robot_id in robots and self._is_on_its_way(move) for move in exchange
            )
        ]
        complete = [exchange for exchange in can if all(map(self._is_back, exchange))]
        self._under_way = [exchange for exchange in can if exchange not in complete]
        return [move for exchange in complete for move in exchange]

    @property
    def kept(self) -> frozenset[str]:
        """The ids of the tasks that are under way."""
        return frozenset(move.record.task.id for move in self._moves())

    def has_recalled(self, record: TaskRecord) -> bool:
        """Return whether a task is handed back because of this, and was not tried in vain."""
        return self._recalled.get(record.task.id) == record.assignment

    def _moves(self) -> Iterable[Move]:
        return (move for exchange in self._under_way for move in exchange)

    def _is_on_its_way(self, move: Move) -> bool:
        return self._state(move) in {TaskState.ASSIGNED, TaskState.WAITING}

    def _is_back(self, move: Move) -> bool:
        return self._state(move) is TaskState.WAITING

    def _state(self, move: Move) -> TaskState | None:
        """Return where a task stands; None where it has been given out since."""
        record = self._get(move.record.task.id)
        if record is None or record.assignment != move.record.assignment:
            return None
        return record.state
