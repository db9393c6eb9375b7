# SPDX-License-Identifier: BSD-3-Clause
"""What a robot reports about tasks that have left its schedule, until the hive knows."""

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
    """Sends each report at once, and again until the hive acknowledges it.

    The journal keeps the open reports, so that a robot which restarts still sends them. Without a
    hive filter, which knows the leader, they go to everybody.
    """

    def __init__(
        self,
        talker: Talker,
        robot_id: str,
        journal: Journal,
        hive_filter: HiveFilter | None = None,
    ) -> None:
        self._talker = talker
        self._filter = hive_filter
        self._robot_id = robot_id
        self._journal = journal
        self._open = {report.task_id: report for report in journal.load_reports()}
        self._saved = True
        self._newest: TaskList | None = None
        self._known: Mapping[str, TaskRecord] = {}

    def add(self, report: TaskUpdate) -> None:
        """Report on a task that has left the schedule."""
        self._open[report.task_id] = report
        self._save()
        self._send(report)

    def repeat(self) -> None:
        """Send again what nobody has acknowledged, and write it if that failed before."""
        if not self._saved:
            self._save()
        for report in self._open.values():
            self._send(report)

    def answer(self, order: Order) -> bool:
        """Return whether an order comes too late: it was reported on, or the list is newer.

        A robot never repeats what it has done, whatever the assignment number. The report is sent
        again, unless the hive is known to have it: then the order was just slower than the task
        list.
        """
        report = self._open.get(order.task.id)
        if report is not None and (
            report.state is TaskState.DONE or report.assignment >= order.assignment
        ):
            self._send(report)
            return True
        record = self._known.get(order.task.id)
        if record is None:
            # Tasks that this list does not know yet have higher numbers than all it has forgotten.
            return self._newest is not None and order.assignment <= self._newest.earlier
        return record.has_ended(self._robot_id, order.assignment)

    def forget(self, order: Order) -> None:
        """Stop reporting on a task that the hive has forgotten, up to the order's assignment."""
        report = self._open.get(order.task.id)
        if report is not None and report.assignment <= order.assignment:
            del self._open[order.task.id]
            self._save()

    def acknowledge(self, known: TaskList) -> None:
        """Drop the reports that a copy of the task list shows to be known.

        A copy older than one before is ignored: it shows orders as open that are not.
        """
        if self._newest is not None and known.is_before(self._newest):
            return
        if self._newest is not None and self._newest.hive not in {"", known.hive}:
            self._change_hive()
        self._newest = known
        self._known = known.by_id
        heard = [report for report in self._open.values() if self._is_known(report)]
        for report in heard:
            del self._open[report.task_id]
        if heard:
            self._save()

    def known_of(self, task_ids: Iterable[str]) -> list[TaskRecord]:
        """Return the records of some tasks in the newest copy of the list."""
        return [self._known[task_id] for task_id in task_ids if task_id in self._known]

    def _change_hive(self) -> None:
        """Report to another hive only what is done: it has given this robot no task yet."""
        self._open = {
            report.task_id: replace(report, assignment=ANY_ASSIGNMENT)
            for report in self._open.values()
            if report.state is TaskState.DONE
        }
        self._save()

    def _send(self, report: TaskUpdate) -> None:
        to = None if self._filter is None else self._filter.leader
        self._talker.publish(TASK_STATE, report, to)

    def _save(self) -> None:
        try:
            self._journal.save_reports(self._open.values())
            self._saved = True
        except JournalError as error:
            self._saved = False
            self._talker.warn(f"{self._robot_id} may forget its reports if it restarts: {error}")

    def _is_known(self, report: TaskUpdate) -> bool:
        record = self._known.get(report.task_id)
        if record is None:
            return False
        if report.state is TaskState.DONE:
            # Whoever has the task by now: the report counts until the hive believes it.
            return record.state.is_terminal
        return record.has_ended(self._robot_id, report.assignment)
