# SPDX-License-Identifier: BSD-3-Clause
"""What a program outside the hive knows of it, from what the hive says on its topics.

The blackboard's list is the truth and comes whole; updates only make the picture newer until the
next list. A list that is older than one seen already is dropped, because lists may overtake each
other when the blackboard moves to another robot. A hive that was founded anew begins with a list
of its own. What has ended leaves the list after a while; its last word is kept for longer here.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING

from blackboard.consensus.messages import Heartbeat
from blackboard.consensus.task_list import TaskList
from blackboard.domain.characteristics import RobotStatus
from blackboard.domain.record import TaskUpdate
from blackboard.domain.task import TaskState
from fleet_manager.client.samples import BatteryReading, Collisions, TruePlace

if TYPE_CHECKING:
    from blackboard.domain.record import TaskRecord


MAX_ANSWERS = 10_000
"""Tasks that are on no list and whose last word is kept; the oldest make way."""

Report = TaskList | TaskUpdate | RobotStatus | Heartbeat | TruePlace | BatteryReading | Collisions
"""Whatever comes over a link: what the hive says, and what a recorder asked for as well."""


@dataclass
class HiveView:
    """The picture of a hive that grows with every report. Not for several threads.

    Attributes:
        tasks: Where each task stands, by id, in the order they were posted.
        robots: How each robot is, by name.
        answers: The last word on tasks that are on no list yet, never will be, or no longer are,
            by id.
        heartbeat: Who carries the blackboard; None until it was heard.
        version: Epoch and version of the newest list; None until one came.
        hive: Id of the hive that it is from. Epochs of another hive are not comparable.
    """

    tasks: dict[str, TaskRecord] = field(default_factory=dict)
    robots: dict[str, RobotStatus] = field(default_factory=dict)
    answers: dict[str, TaskUpdate] = field(default_factory=dict)
    heartbeat: Heartbeat | None = None
    version: tuple[int, int] | None = None
    hive: str = ""

    def take_in(self, report: Report) -> None:
        """Make the picture newer by one report."""
        if isinstance(report, TaskList):
            self._take_in_list(report)
        elif isinstance(report, TaskUpdate):
            self._take_in_update(report)
        elif isinstance(report, RobotStatus):
            self.robots[report.robot_id] = report
        elif isinstance(report, Heartbeat) and not self._is_old(report):
            self.heartbeat = report

    def is_stale(self, task_list: TaskList) -> bool:
        """Return whether a newer list than this one was seen already."""
        if self.version is None or task_list.hive != self.hive:
            return False
        return (task_list.epoch, task_list.version) < self.version

    def is_late(self, update: TaskUpdate) -> bool:
        """Return whether what an update tells was so before: robots overtake the blackboard."""
        known = self.tasks.get(update.task_id)
        if known is None or update.state is TaskState.REJECTED:
            return False
        if known.state.is_terminal or update.state.is_terminal:
            return known.state.is_terminal
        before = (known.assignment, known.state is TaskState.STARTED)
        return (update.assignment, update.state is not TaskState.ASSIGNED) < before

    def newest(self, record: TaskRecord) -> TaskRecord:
        """Return where a task stands: as the list says, unless its robot has said more since."""
        known = self.tasks.get(record.task.id)
        if known is None or known.assignment != record.assignment or not record.is_held:
            return record
        return max(record, known, key=lambda each: (each.state, each.step))

    def state_of(self, task_id: str) -> TaskState | None:
        """Return where a task stands, or None where the hive has said nothing of it."""
        known = self.tasks.get(task_id) or self.answers.get(task_id)
        return known.state if known else None

    def _is_old(self, beat: Heartbeat) -> bool:
        known = self.heartbeat
        return known is not None and beat.hive == known.hive and beat.epoch < known.epoch

    def _take_in_list(self, task_list: TaskList) -> None:
        if not self.is_stale(task_list):
            if task_list.hive != self.hive:
                self.tasks.clear()
            self.hive = task_list.hive
            self.version = (task_list.epoch, task_list.version)
            before = self.tasks
            self.tasks = {record.task.id: self.newest(record) for record in task_list.records}
            for task_id in self.tasks.keys() & self.answers.keys():
                del self.answers[task_id]
            for task_id, record in before.items():
                if task_id not in self.tasks and record.state.is_terminal:
                    self._answer(record.told(task_list.epoch))

    def _answer(self, update: TaskUpdate) -> None:
        self.answers.pop(update.task_id, None)
        self.answers[update.task_id] = update
        if len(self.answers) > MAX_ANSWERS:
            del self.answers[next(iter(self.answers))]

    def _take_in_update(self, update: TaskUpdate) -> None:
        record = self.tasks.get(update.task_id)
        if record is None or update.state is TaskState.REJECTED:
            self._answer(update)
        elif not self.is_late(update):
            waiting = update.state is TaskState.WAITING
            self.tasks[update.task_id] = replace(
                record,
                state=update.state,
                robot="" if waiting else update.robot_id,
                step=update.step,
                eta=update.eta,
                reason=update.reason,
                assignment=update.assignment,
            )
