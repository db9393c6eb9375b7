# SPDX-License-Identifier: BSD-3-Clause
"""What a person has sent and nobody has answered yet.

A publisher in ROS does not know whether anybody heard it, and the blackboard may change hands
between a message and its answer. So what is sent is kept here and repeated until the hive answers;
the blackboard takes the same task twice as one.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from enum import Enum
from typing import TYPE_CHECKING

from blackboard.consensus.task_list import TaskList
from blackboard.domain.record import TaskUpdate
from blackboard.domain.task import TaskState
from fleet_manager.desk.facts import CancelTask, PostTask, Told
from fleet_manager.desk.words import text

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable

    from blackboard.domain.record import TaskRecord
    from blackboard.domain.task import Task
    from fleet_manager.desk.facts import Command, Fact, Moment

REPEAT = 2.0  # [s], wall time between two sendings of the same thing
SHOWN = 20  # letters that are remembered after their answer


class Answer(Enum):
    """What became of a task that was sent."""

    KEPT = "kept"
    """Nobody carries the blackboard; it has not been sent."""
    WAITS = "waits"
    """Sent, not answered."""
    TAKEN = "taken"
    """On the list."""
    REFUSED = "refused"
    """Not on the list; the reason says why."""


@dataclass(frozen=True, slots=True)
class Letter:
    """A task that was sent from here.

    Attributes:
        task: What was sent.
        answer: What became of it.
        reason: Why it was refused; empty otherwise.
        sent: When it was last sent [s, wall]; None before the first time.
    """

    task: Task
    answer: Answer = Answer.KEPT
    reason: str = ""
    sent: float | None = None

    @property
    def is_open(self) -> bool:
        """Whether no answer has come yet."""
        return self.answer in {Answer.KEPT, Answer.WAITS}

    def __str__(self) -> str:
        reason = self.reason or text("sent.no_reason")
        return text(f"sent.{self.answer.name}", id=self.task.id, reason=reason)


class Outbox:
    """Sends tasks and cancellations until they are answered.

    Args:
        send: Hands a command to the hive's link.
    """

    def __init__(self, send: Callable[[Command], None]) -> None:
        self._send = send
        self._letters: dict[str, Letter] = {}
        self._cancels: dict[str, float | None] = {}

    @property
    def letters(self) -> tuple[Letter, ...]:
        """What was sent from here, newest first."""
        return tuple(reversed(self._letters.values()))

    @property
    def unanswered(self) -> int:
        """The number of tasks that have not been answered."""
        return sum(letter.is_open for letter in self._letters.values())

    def post(self, task: Task) -> None:
        """Take a task to be sent; the next `tick` sends it."""
        self._letters.pop(task.id, None)
        self._letters[task.id] = Letter(task)
        ended = [name for name, letter in self._letters.items() if not letter.is_open]
        for name in ended[: max(0, len(self._letters) - SHOWN)]:
            del self._letters[name]

    def cancel(self, task_id: str) -> None:
        """Take a cancellation to be sent; the next `tick` sends it."""
        self._cancels[task_id] = None

    def hear(self, fact: Fact, find: Callable[[str], TaskRecord | None]) -> bool:
        """Look for answers in a fact.

        Args:
            fact: What has arrived.
            find: Gives the record of a task by id; None where it is not on the list.

        Returns:
            Whether a letter changed.
        """
        report = fact.report if isinstance(fact, Told) else None
        if isinstance(report, TaskUpdate):
            return self._hear_update(report, find)
        if isinstance(report, TaskList):
            return self._hear_list(report.records)
        return False

    def tick(self, now: Moment, someone_listens: bool) -> bool:
        """Send what is due.

        Args:
            now: The time.
            someone_listens: Whether a blackboard is active.

        Returns:
            Whether a letter changed.
        """
        changed = False
        for name, letter in self._letters.items():
            if letter.is_open and someone_listens and _is_due(letter.sent, now):
                self._send(PostTask(letter.task))
                self._letters[name] = replace(letter, answer=Answer.WAITS, sent=now.wall)
                changed |= letter.answer is not Answer.WAITS
            elif letter.answer is Answer.WAITS and not someone_listens:
                self._letters[name] = replace(letter, answer=Answer.KEPT)
                changed = True
        for name, sent in self._cancels.items():
            if someone_listens and _is_due(sent, now):
                self._send(CancelTask(name))
                self._cancels[name] = now.wall
        return changed

    def _hear_update(self, update: TaskUpdate, find: Callable[[str], TaskRecord | None]) -> bool:
        if update.state.is_terminal:
            self._cancels.pop(update.task_id, None)
        letter = self._letters.get(update.task_id)
        if letter is None or not letter.is_open:
            return False
        if update.state is TaskState.REJECTED:
            return self._settle(letter, Answer.REFUSED, update.reason)
        record = find(update.task_id)
        if record is not None and not record.task.asks_the_same_as(letter.task):
            return False  # news of somebody else's task of the same name
        return self._settle(letter, Answer.TAKEN)

    def _hear_list(self, records: Iterable[TaskRecord]) -> bool:
        if not (self._cancels or self.unanswered):
            return False
        listed = {record.task.id: record for record in records}
        for name in list(self._cancels):
            if name not in listed or listed[name].state.is_terminal:
                del self._cancels[name]
        changed = False
        for name, letter in list(self._letters.items()):
            same = name in listed and listed[name].task.asks_the_same_as(letter.task)
            if letter.is_open and same:
                changed = self._settle(letter, Answer.TAKEN)
        return changed

    def _settle(self, letter: Letter, answer: Answer, reason: str = "") -> bool:
        self._letters[letter.task.id] = replace(letter, answer=answer, reason=reason)
        return True


def _is_due(sent: float | None, now: Moment) -> bool:
    return sent is None or now.wall - sent >= REPEAT
