# SPDX-License-Identifier: BSD-3-Clause
"""What a robot has to report of tasks that have left its list, until the blackboard knows."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

from blackboard.domain.record import ANY_ASSIGNMENT
from blackboard.domain.talker import TASK_STATE
from blackboard.domain.task import TaskState
from blackboard.errors import JournalError

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping

    from blackboard.consensus.hive_filter import HiveFilter
    from blackboard.consensus.journal import Journal
    from blackboard.consensus.task_list import TaskList
    from blackboard.domain.record import Order, TaskRecord, TaskUpdate
    from blackboard.domain.talker import Talker


class Reports:
    """Tells each report at once, and again and again until it is acknowledged.

    Args:
        talker: How it speaks.
        robot_id: Whose reports they are.
        journal: Keeps the open ones, so that a robot which starts again still tells them.
        fence: Knows which member has to hear them; all have to, where it is left out.
    """

    def __init__(
        self, talker: Talker, robot_id: str, journal: Journal, fence: HiveFilter | None = None
    ) -> None:
        self._talker = talker
        self._fence = fence
        self._robot_id = robot_id
        self._journal = journal
        self._open = {report.task_id: report for report in journal.load_reports()}
        self._newest: TaskList | None = None
        self._known: Mapping[str, TaskRecord] = {}

    def add(self, report: TaskUpdate) -> None:
        """Tell of a task that has left the list."""
        self._open[report.task_id] = report
        self._write_down()
        self._tell(report)

    def repeat(self) -> None:
        """Tell again what nobody has acknowledged."""
        for report in self._open.values():
            self._tell(report)

    def answer(self, order: Order) -> bool:
        """Return whether an order comes too late, because its task was reported on before.

        What it has done a robot does not do again, under whatever number.
        The report is told again unless the blackboard is known to have heard it: then the order
        was only slower on its way than the task list.
        """
        report = self._open.get(order.task.id)
        if report is not None and (
            report.state is TaskState.DONE or report.assignment >= order.assignment
        ):
            self._tell(report)
            return True
        record = self._known.get(order.task.id)
        return record is not None and record.has_ended(self._robot_id, order.assignment)

    def forget(self, order: Order) -> None:
        """Report no more on a task that the hive has forgotten, under the numbers up to its."""
        report = self._open.get(order.task.id)
        if report is not None and report.assignment <= order.assignment:
            del self._open[order.task.id]
            self._write_down()

    def acknowledge(self, known: TaskList) -> None:
        """Forget what a copy of the task list shows to be known.

        One that comes after a newer one is left out: it shows orders as open that are not.
        """
        if self._newest is not None and known.is_before(self._newest):
            return
        if self._newest is not None and self._newest.hive not in {"", known.hive}:
            self._go_over()
        self._newest = known
        self._known = known.by_id
        heard = [report for report in self._open.values() if self._has_been_heard(report)]
        for report in heard:
            del self._open[report.task_id]
        if heard:
            self._write_down()

    def _go_over(self) -> None:
        """Report to another hive only what is done: it has given no task to this robot yet."""
        self._open = {
            report.task_id: replace(report, assignment=ANY_ASSIGNMENT)
            for report in self._open.values()
            if report.state is TaskState.DONE
        }
        self._write_down()

    def known_of(self, task_ids: Iterable[str]) -> list[TaskRecord]:
        """Return where some tasks stand by the newest copy of the list that was acknowledged."""
        return [self._known[task_id] for task_id in task_ids if task_id in self._known]

    def _tell(self, report: TaskUpdate) -> None:
        to = None if self._fence is None else self._fence.leader
        self._talker.publish(TASK_STATE, report, to)

    def _write_down(self) -> None:
        try:
            self._journal.save_reports(self._open.values())
        except JournalError as error:
            self._talker.warn(f"{self._robot_id} may forget what it reports: {error}")

    def _has_been_heard(self, report: TaskUpdate) -> bool:
        record = self._known.get(report.task_id)
        return record is not None and self._is_known(report, record)

    def _is_known(self, report: TaskUpdate, record: TaskRecord) -> bool:
        if report.state is TaskState.DONE:
            # Whoever has the task by now: that it is done is worth telling until it is believed.
            return record.state.is_terminal
        return record.has_ended(self._robot_id, report.assignment)
