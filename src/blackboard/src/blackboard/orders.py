# SPDX-License-Identifier: BSD-3-Clause
"""What robots have been told to do, told again until their status shows that they have heard."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

from blackboard.record import Order
from blackboard.talker import TASK_ASSIGN
from blackboard.task import Task

if TYPE_CHECKING:
    from collections.abc import Iterable

    from blackboard.backup import Backup
    from blackboard.characteristics import RobotStatus
    from blackboard.record import TaskRecord
    from blackboard.talker import Talker

# Above the number of any assignment that a robot may have of a task that nobody knows.
_ANY_ASSIGNMENT = 2**32 - 1


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
        self._heard: dict[str, float] = {}

    def resume(self, records: Iterable[TaskRecord]) -> None:
        """Take over what another blackboard has ordered, as if it had done so now."""
        now = self._talker.now()
        self._given = {record.task.id: now for record in records if record.is_held}

    def give(self, record: TaskRecord) -> None:
        """Tell the robot of a record to take its task into its list."""
        self._given[record.task.id] = self._talker.now()
        self._tell(self._order(record))

    def take_back(self, record: TaskRecord) -> None:
        """Have the robot that holds a task, if one does, drop it."""
        if record.robot:
            self._tell(replace(self._order(record), take_back=True))

    def recall(self, record: TaskRecord) -> None:
        """Have the robot that holds a task drop it and report how far it has come."""
        self._tell(replace(self._order(record), take_back=True, hand_back=True))

    def recall_unbegun(self, record: TaskRecord) -> None:
        """Have the robot that holds a task hand it back if it has not begun with it."""
        recall = replace(self._order(record), take_back=True, hand_back=True, if_unbegun=True)
        self._tell(recall)

    def forget(self, task_id: str) -> None:
        """Note that no robot has to have a task any more."""
        self._given.pop(task_id, None)

    def held(self) -> list[TaskRecord]:
        """Return the records of all that robots have to have in their lists."""
        records = (self._backup.get(task_id) for task_id in self._given)
        return [record for record in records if record is not None and record.is_held]

    def given_to(self, robot_id: str) -> tuple[TaskRecord, ...]:
        """Return the records of all that one robot has to have in its list."""
        return tuple(record for record in self.held() if record.robot == robot_id)

    def compare(self, status: RobotStatus) -> bool:
        """Mend what differs between a robot's list and what it has to have in it.

        It is given again what it has had the time to hear and does not have, and told to drop what
        is not its own.

        Returns:
            Whether everything in its list is its own.
        """
        self._heard[status.robot_id] = status.sent
        now = self._talker.now()
        for record in self.given_to(status.robot_id):
            overdue = now - self._given[record.task.id] > self._timeout
            if overdue and record.task.id not in status.tasks:
                self.give(record)
        strays = [task for task in status.tasks if not self._is_own(task, status.robot_id)]
        for task_id in strays:
            self._send_away(task_id, status.robot_id)
        return not strays

    def _is_own(self, task_id: str, robot_id: str) -> bool:
        record = self._backup.get(task_id)
        return record is not None and record.is_held and record.robot == robot_id

    def _send_away(self, task_id: str, robot_id: str) -> None:
        record = self._backup.get(task_id)
        task = Task(task_id, 0, ()) if record is None else record.task
        assignment = _ANY_ASSIGNMENT if record is None else record.assignment
        order = Order(
            task,
            robot_id,
            take_back=True,
            epoch=self._backup.epoch,
            assignment=assignment,
            hive=self._backup.hive,
        )
        self._tell(order)

    def _tell(self, order: Order) -> None:
        self._talker.publish(TASK_ASSIGN, order, (order.robot_id,))

    def _order(self, record: TaskRecord) -> Order:
        return Order(
            record.task,
            record.robot,
            step=record.step,
            epoch=self._backup.epoch,
            assignment=record.assignment,
            heard=self._heard.get(record.robot, 0.0),
            hive=self._backup.hive,
        )
