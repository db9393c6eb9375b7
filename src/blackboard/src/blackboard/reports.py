# SPDX-License-Identifier: BSD-3-Clause
"""What a robot has to report of tasks that have left its list, until the blackboard knows."""

from __future__ import annotations

from typing import TYPE_CHECKING

from blackboard.talker import TASK_STATE

if TYPE_CHECKING:
    from blackboard.backup import TaskList
    from blackboard.record import Order, TaskUpdate
    from blackboard.talker import Talker


class Reports:
    """Tells each report at once, and again and again until it is acknowledged.

    Args:
        talker: How it speaks.
        robot_id: Whose reports they are.
    """

    def __init__(self, talker: Talker, robot_id: str) -> None:
        self._talker = talker
        self._robot_id = robot_id
        self._open: dict[str, TaskUpdate] = {}

    def add(self, report: TaskUpdate) -> None:
        """Tell of a task that has left the list."""
        self._open[report.task_id] = report
        self._talker.publish(TASK_STATE, report)

    def repeat(self) -> None:
        """Tell again what nobody has acknowledged."""
        for report in self._open.values():
            self._talker.publish(TASK_STATE, report)

    def answer(self, order: Order) -> bool:
        """Repeat the report that answers an order already; return whether there is one."""
        report = self._open.get(order.task.id)
        if report is None or report.assignment < order.assignment:
            return False
        self._talker.publish(TASK_STATE, report)
        return True

    def acknowledge(self, known: TaskList) -> None:
        """Forget what a copy of the task list shows to be known."""
        for record in known.records:
            report = self._open.get(record.task.id)
            gone = record.state.is_terminal or record.robot != self._robot_id
            if report is not None and gone and record.assignment >= report.assignment:
                del self._open[record.task.id]
