# SPDX-License-Identifier: BSD-3-Clause
"""What robots have been told to do, told again until their status shows that they have heard."""

from __future__ import annotations

from collections import defaultdict
from typing import TYPE_CHECKING

from blackboard.domain.record import ANY_ASSIGNMENT, Order, OrderKind
from blackboard.domain.talker import TASK_ASSIGN
from blackboard.domain.task import Task

if TYPE_CHECKING:
    from collections.abc import Iterable

    from blackboard.consensus.node import RaftNode
    from blackboard.domain.characteristics import RobotStatus
    from blackboard.domain.record import TaskRecord
    from blackboard.domain.talker import Talker


class Orders:
    """Gives robots their tasks and takes them back.

    Args:
        talker: How it speaks.
        backup: Knows where each task stands.
        timeout: An order that a robot's status does not show by then is given again [s].
    """

    def __init__(self, talker: Talker, backup: RaftNode, timeout: float) -> None:
        self._talker = talker
        self._backup = backup
        self._timeout = timeout
        self._holders: dict[str, str] = {}
        self._given: dict[str, dict[str, float]] = defaultdict(dict)
        self._heard: dict[str, float] = {}

    def resume(self, records: Iterable[TaskRecord]) -> None:
        """Take over what another blackboard has ordered, as if it had done so now."""
        self._holders.clear()
        self._given.clear()
        for record in records:
            if record.is_held:
                self._note(record)

    def give(self, record: TaskRecord) -> None:
        """Tell the robot of a record to take its task into its list."""
        self._note(record)
        self._tell(self._order(record))

    def take_back(self, record: TaskRecord) -> None:
        """Have the robot that holds a task, if any, drop it."""
        if record.robot:
            self._tell(self._order(record, OrderKind.TAKE_BACK))

    def recall(self, record: TaskRecord) -> None:
        """Have the robot that holds a task drop it and report how far it has come."""
        self._tell(self._order(record, OrderKind.HAND_BACK))

    def recall_unbegun(self, record: TaskRecord) -> None:
        """Have the robot that holds a task hand it back unless it has begun."""
        self._tell(self._order(record, OrderKind.HAND_BACK_UNBEGUN))

    def forget(self, task_id: str) -> None:
        """Note that no robot has to have a task any more."""
        if (robot_id := self._holders.pop(task_id, None)) is not None:
            del self._given[robot_id][task_id]

    def held(self) -> list[TaskRecord]:
        """Return the records of all that robots have to have in their lists."""
        return self._held(self._holders)

    def given_to(self, robot_id: str) -> tuple[TaskRecord, ...]:
        """Return the records of all that one robot has to have in its list."""
        listed = self._held(self._given[robot_id])
        return tuple(record for record in listed if record.robot == robot_id)

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
            overdue = now - self._given[status.robot_id][record.task.id] > self._timeout
            if overdue and record.task.id not in status.tasks:
                self.give(record)
        strays = [task for task in status.tasks if not self._is_own(task, status.robot_id)]
        for task_id in strays:
            self._send_away(task_id, status.robot_id)
        return not strays

    def _note(self, record: TaskRecord) -> None:
        """Note that from now on a robot has to have a task."""
        self.forget(record.task.id)
        self._holders[record.task.id] = record.robot
        self._given[record.robot][record.task.id] = self._talker.now()

    def _held(self, task_ids: Iterable[str]) -> list[TaskRecord]:
        records = map(self._backup.get, task_ids)
        return [record for record in records if record is not None and record.is_held]

    def _is_own(self, task_id: str, robot_id: str) -> bool:
        record = self._backup.get(task_id)
        return record is not None and record.is_held and record.robot == robot_id

    def disown(self, task_id: str, robot_id: str, assignment: int = ANY_ASSIGNMENT) -> None:
        """Have a robot drop a task that the hive has forgotten, and report on it no more.

        Args:
            task_id: The task; another one of that id may be on the list by now.
            robot_id: Who has it, or reports on it.
            assignment: Only under numbers up to this one.
        """
        order = self._away(Task(task_id, 0, ()), robot_id, assignment, OrderKind.FORGOTTEN)
        self._tell(order)

    def _send_away(self, task_id: str, robot_id: str) -> None:
        record = self._backup.get(task_id)
        if record is None:
            self.disown(task_id, robot_id)
        else:
            self._tell(self._away(record.task, robot_id, record.assignment, OrderKind.TAKE_BACK))

    def _away(self, task: Task, robot_id: str, assignment: int, kind: OrderKind) -> Order:
        return Order(
            task,
            robot_id,
            kind,
            epoch=self._backup.epoch,
            assignment=assignment,
            heard=self._heard.get(robot_id, 0.0),
            hive=self._backup.hive,
        )

    def _tell(self, order: Order) -> None:
        self._talker.publish(TASK_ASSIGN, order, (order.robot_id,))

    def _order(self, record: TaskRecord, kind: OrderKind = OrderKind.ASSIGN) -> Order:
        return Order(
            record.task,
            record.robot,
            kind,
            step=record.step,
            epoch=self._backup.epoch,
            assignment=record.assignment,
            heard=self._heard.get(record.robot, 0.0),
            hive=self._backup.hive,
        )
