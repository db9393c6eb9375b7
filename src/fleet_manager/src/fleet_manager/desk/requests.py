# SPDX-License-Identifier: BSD-3-Clause
"""What a person has asked of the hive and nobody has answered yet.

A publisher in ROS does not know whether anybody heard it, and the leader may change between a
request and its answer. So a request is repeated until the hive answers; the blackboard takes the
same task twice as one. The traffic planner answers by telling which zones are closed.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from enum import Enum
from typing import TYPE_CHECKING

from blackboard.consensus.task_list import TaskList
from blackboard.domain.record import TaskUpdate
from blackboard.domain.task import TaskState
from fleet_manager.client.reports import HiveMessage
from fleet_manager.client.traffic import TrafficState, ZoneCommand
from fleet_manager.desk.facts import CancelTask, PostTask

if TYPE_CHECKING:
    from collections.abc import Callable

    from blackboard.domain.record import TaskRecord
    from blackboard.domain.task import Task
    from fleet_manager.desk.facts import Command, Fact

REPEAT = 2.0  # [s, wall] between two repetitions of a request
MAX_SHOWN = 20  # sent tasks that are remembered after their answer


class Answer(Enum):
    """What became of a task that was sent."""

    KEPT = "kept here; it is sent as soon as there is a blackboard"
    """There is no leader; the task has not been sent."""
    WAITS = "sent, waiting for the answer"
    """The task was sent and not answered."""
    TAKEN = "accepted"
    """The task is on the task list."""
    REFUSED = "rejected"
    """The task is not on the task list; the reason says why."""


@dataclass(frozen=True, slots=True)
class SentTask:
    """A task that was sent from here."""

    task: Task
    answer: Answer = Answer.KEPT  # what became of it
    reason: str = ""  # why it was rejected; empty otherwise
    sent: float | None = None  # when it was last sent [s, wall]; None before the first time

    @property
    def is_open(self) -> bool:
        """Whether no answer has come yet."""
        return self.answer in {Answer.KEPT, Answer.WAITS}

    def __str__(self) -> str:
        because = f": {self.reason}" if self.reason else ""
        return f"{self.task.id}: {self.answer.value}{because}"


class RequestQueue:
    """Sends tasks, cancellations and commands for zones to the link until they are answered."""

    def __init__(self, send: Callable[[Command], None]) -> None:
        self._send = send
        self._tasks: dict[str, SentTask] = {}
        self._cancels: dict[str, float | None] = {}
        self._zones: dict[ZoneCommand, float | None] = {}

    @property
    def sent_tasks(self) -> tuple[SentTask, ...]:
        """The tasks that were sent from here, newest first."""
        return tuple(reversed(self._tasks.values()))

    @property
    def unanswered(self) -> int:
        """The number of tasks without an answer."""
        return sum(sent.is_open for sent in self._tasks.values())

    def post(self, task: Task) -> None:
        """Add a task; the next `tick` sends it."""
        self._tasks.pop(task.id, None)
        self._tasks[task.id] = SentTask(task)
        ended = [name for name, sent in self._tasks.items() if not sent.is_open]
        for name in ended[: max(0, len(self._tasks) - MAX_SHOWN)]:
            del self._tasks[name]

    def cancel(self, task_id: str) -> None:
        """Add a cancellation; the next `tick` sends it."""
        self._cancels[task_id] = None

    def switch(self, command: ZoneCommand) -> None:
        """Add a zone to close or open, in place of what was asked for it before."""
        self._zones.pop(ZoneCommand(command.zone, not command.closed), None)
        self._zones[command] = None

    def hear(self, fact: Fact, find: Callable[[str], TaskRecord | None]) -> bool:
        """Look for answers in a fact, and return whether a sent task changed.

        `find` returns the record of a task by id; None where it is not known.
        """
        report = fact.report if isinstance(fact, HiveMessage) else None
        if isinstance(report, TaskUpdate):
            return self._hear_update(report, find)
        if isinstance(report, TaskList):
            return self._hear_list(report)
        if isinstance(report, TrafficState):
            done = [each for each in self._zones if (each.zone in report.closed) is each.closed]
            for command in done:
                del self._zones[command]
        return False

    def tick(self, now: float, someone_listens: bool) -> bool:
        """Send what is due at `now` [s, wall]; return whether a sent task changed.

        `someone_listens` says whether there is a leader.
        """
        changed = False
        for name, sent in self._tasks.items():
            if sent.is_open and someone_listens and _is_due(sent.sent, now):
                self._send(PostTask(sent.task))
                self._tasks[name] = replace(sent, answer=Answer.WAITS, sent=now)
                changed |= sent.answer is not Answer.WAITS
            elif sent.answer is Answer.WAITS and not someone_listens:
                self._tasks[name] = replace(sent, answer=Answer.KEPT)
                changed = True
        for name, asked in self._cancels.items():
            if someone_listens and _is_due(asked, now):
                self._send(CancelTask(name))
                self._cancels[name] = now
        for command, asked in self._zones.items():
            if someone_listens and _is_due(asked, now):
                self._send(command)
                self._zones[command] = now
        return changed

    def _hear_update(self, update: TaskUpdate, find: Callable[[str], TaskRecord | None]) -> bool:
        if update.state.is_terminal:
            self._cancels.pop(update.task_id, None)
        sent = self._tasks.get(update.task_id)
        if sent is None or not sent.is_open:
            return False
        if update.state is TaskState.REJECTED:
            return self._settle(sent, Answer.REFUSED, update.reason or "no reason was given")
        record = find(update.task_id)
        if record is not None and not record.task.asks_the_same_as(sent.task):
            return False  # news of somebody else's task of the same id
        return self._settle(sent, Answer.TAKEN)

    def _hear_list(self, task_list: TaskList) -> bool:
        if not (self._cancels or self.unanswered):
            return False
        listed = task_list.by_id
        for name in list(self._cancels):
            if name not in listed or listed[name].state.is_terminal:
                del self._cancels[name]
        changed = False
        for name, sent in list(self._tasks.items()):
            if sent.is_open and name in listed and listed[name].task.asks_the_same_as(sent.task):
                changed = self._settle(sent, Answer.TAKEN)
        return changed

    def _settle(self, sent: SentTask, answer: Answer, reason: str = "") -> bool:
        self._tasks[sent.task.id] = replace(sent, answer=answer, reason=reason)
        return True


def _is_due(sent: float | None, now: float) -> bool:
    return sent is None or now - sent >= REPEAT
