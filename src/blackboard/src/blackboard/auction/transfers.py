# SPDX-License-Identifier: BSD-3-Clause
"""Tasks on their way from one robot's schedule to another's, because the fleet gains by it.

The robots that have them are asked to hand them back. Each such task is kept out of auctions until
all of them are back, since half a swap is no gain; then they are awarded as decided. If that fails
because a robot has begun, has won another task, or is out of service, the tasks are auctioned like
any other.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, NamedTuple

from blackboard.domain.task import TaskState

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping

    from blackboard.domain.bid import Bid
    from blackboard.domain.record import TaskRecord


class Move(NamedTuple):
    """A task that another robot gets."""

    record: TaskRecord  # as the giver holds it
    taker: Bid  # the bid of the robot that gets it
    bids: tuple[Bid, ...]  # all bids on it
    place: int = 0  # where it goes in the taker's list, 1 is first; 0 if the taker decides

    def __str__(self) -> str:
        return f"{self.record.task.id} from {self.record.robot} to {self.taker.robot_id}"


Moves = tuple[Move, ...]
"""Moves that gain only together."""


@dataclass(frozen=True, slots=True)
class Transfers:
    """The transfers under way."""

    moves: Moves = ()  # until all tasks have been handed back
    # Number of the assignment under which each task was recalled, by task id.
    recalled: Mapping[str, int] = field(default_factory=dict)
    decided_in: tuple[int, int, int] = (0, 0, 0)  # epoch, auction and round that decided on them

    def begin(
        self,
        moves: Moves,
        get: Callable[[str], TaskRecord | None],
        decided_in: tuple[int, int, int],
    ) -> Transfers:
        """Return transfers with new moves in place of the old; their tasks are to be recalled."""
        recalled = {
            task_id: assignment
            for task_id, assignment in self.recalled.items()
            if (record := get(task_id)) is not None and record.assignment == assignment
        }
        recalled |= {move.record.task.id: move.record.assignment for move in moves}
        return Transfers(moves, recalled, decided_in)

    def give_up(self) -> Transfers:
        """Leave everything under way to the next auction."""
        return replace(self, moves=())

    def without_taker(self, robot: str) -> Transfers:
        """Give up if a robot takes part whose schedule differs from what was decided on."""
        takes_part = any(move.taker.robot_id == robot for move in self.moves)
        return self.give_up() if takes_part else self

    def ready(
        self, in_service: frozenset[str], get: Callable[[str], TaskRecord | None]
    ) -> tuple[Transfers, Moves]:
        """Return the transfers that are still under way, and the moves to be awarded now."""
        states = [_state(get, move.record) for move in self.moves]
        if any(move.taker.robot_id not in in_service for move in self.moves):
            return self.give_up(), ()
        if all(state is TaskState.WAITING for state in states):
            return self.give_up(), self.moves
        is_pending = all(
            state in {move.record.state, TaskState.WAITING}
            for move, state in zip(self.moves, states, strict=True)
        )
        return (self if is_pending else self.give_up()), ()

    @property
    def task_ids(self) -> frozenset[str]:
        """Ids of the tasks under way, which no auction offers."""
        return frozenset(move.record.task.id for move in self.moves)

    def has_recalled(self, record: TaskRecord) -> bool:
        """Return whether a task is handed back for a transfer rather than tried in vain."""
        return self.recalled.get(record.task.id) == record.assignment


def _state(get: Callable[[str], TaskRecord | None], recalled: TaskRecord) -> TaskState | None:
    """Return the state of a recalled task; None if it has been assigned again since."""
    record = get(recalled.task.id)
    if record is None or record.assignment != recalled.assignment:
        return None
    return record.state
