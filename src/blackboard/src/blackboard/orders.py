# SPDX-License-Identifier: BSD-3-Clause
"""What robots have been told to do, told again until their status shows that they have heard."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

from blackboard.record import Order
from blackboard.talker import TASK_ASSIGN

if TYPE_CHECKING:
    from blackboard.backup import Backup
    from blackboard.characteristics import RobotStatus
    from blackboard.record import TaskRecord
    from blackboard.talker import Talker


class Orders:
    """Gives robots their tasks and takes them back.

    Args:
        talker: How it speaks.
        backup: Knows where each task stands.
        timeout: An order that a robot's status does not show by then is given again [s].
    """

    def __init__(self, talker: Talker, backup: Backup, timeout: float) -> None:
        self._talker = talker
        self._backup = backup
        self._timeout = timeout
        self._given: dict[str, float] = {}

    def give(self, record: TaskRecord) -> None:
        """Tell the robot of a record to take its task into its list."""
        self._given[record.task.id] = self._talker.now()
        self._talker.publish(TASK_ASSIGN, self._order(record))

    def take_back(self, record: TaskRecord) -> None:
        """Have the robot that holds a task, if one does, drop it."""
        if record.robot:
            self._talker.publish(TASK_ASSIGN, replace(self._order(record), take_back=True))

    def forget(self, task_id: str) -> None:
        """Note that no robot has to have a task any more."""
        self._given.pop(task_id, None)

    def given_to(self, robot_id: str) -> tuple[TaskRecord, ...]:
        """Return the records of all that a robot has to have in its list."""
        records = [self._backup.get(task_id) for task_id in self._given]
        return tuple(record for record in records if record and record.robot == robot_id)

    def compare(self, status: RobotStatus) -> None:
        """Give again what a robot has had the time to hear and does not have in its list."""
        now = self._talker.now()
        for record in self.given_to(status.robot_id):
            overdue = now - self._given[record.task.id] > self._timeout
            if overdue and record.task.id not in status.tasks:
                self.give(record)

    def _order(self, record: TaskRecord) -> Order:
        return Order(
            record.task,
            record.robot,
            step=record.step,
            epoch=self._backup.epoch,
            assignment=record.assignment,
        )
