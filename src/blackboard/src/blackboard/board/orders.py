# SPDX-License-Identifier: BSD-3-Clause
"""Orders to robots, repeated until the robot's status shows that it has heard them."""

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
        timeout: An order whose effect a robot's status does not show within this time is repeated
            [s].
    """

    def __init__(self, talker: Talker, node: RaftNode, timeout: float) -> None:
        self._talker = talker
        self._node = node
        self._timeout = timeout
        self._holders: dict[str, str] = {}
        self._given: dict[str, dict[str, float]] = defaultdict(dict)
        # When a robot was told to drop a task, by its id and its assignment number; 0 for a task
        # that is on no list.
        self._dropped: dict[str, dict[tuple[str, int], float]] = defaultdict(dict)
        self._heard: dict[str, float] = {}

    def resume(self, records: Iterable[TaskRecord]) -> None:
        """Take over what another blackboard has ordered, as if it had done so now."""
        self._holders.clear()
        self._given.clear()
        self._dropped.clear()
        for record in records:
            if record.is_held:
                self._note(record)

    def give(self, record: TaskRecord, place: int = 0) -> None:
        """Order the robot of a record to take its task into its schedule, or to move it there.

        `place` is where, 1 is first; by default the robot finds the best place, as it does if the
        order is lost and repeated.
        """
        self._note(record)
        self.send(record, OrderKind.ASSIGN, place)

    def send(self, record: TaskRecord, kind: OrderKind, place: int = 0) -> None:
        """Order the robot of a record, if it has one, to do something with its task."""
        if record.robot:
            if kind is OrderKind.TAKE_BACK:
                self._dropped[record.robot][record.task.id, record.assignment] = self._talker.now()
            self._tell(record.task, record.robot, kind, record.assignment, record.step, place)

    def disown(self, task_id: str, robot_id: str, assignment: int) -> None:
        """Have a robot drop a task that the hive has forgotten, and stop reporting on it.

        Only assignments up to a number are meant: another task of that id may be on the list.
        """
        self._tell(Task(task_id, 0, ()), robot_id, OrderKind.FORGOTTEN, assignment)

    def forget(self, task_id: str) -> None:
        """Note that no robot holds a task any more."""
        if (robot_id := self._holders.pop(task_id, None)) is not None:
            del self._given[robot_id][task_id]

    def forget_robot(self, robot_id: str) -> None:
        """Forget a robot that has left and holds nothing."""
        self._heard.pop(robot_id, None)
        self._given.pop(robot_id, None)
        self._dropped.pop(robot_id, None)

    def held(self) -> list[TaskRecord]:
        """Return the records of all tasks that robots hold by order."""
        return self._held(self._holders)

    def given_to(self, robot_id: str) -> tuple[TaskRecord, ...]:
        """Return the records of all tasks that one robot holds by order."""
        listed = self._held(self._given[robot_id])
        return tuple(record for record in listed if record.robot == robot_id)

    def compare(self, status: RobotStatus, *, is_lost: bool = False) -> bool:
        """Mend what differs between a robot's schedule and its orders.

        Repeats orders that the robot should show by now, and has it drop what is not its own. A
        lost robot, which no longer does anything, drops it whatever number its assignment has: it
        may be one that this hive has never given.

        Returns whether everything in its schedule is its own.
        """
        robot_id = status.robot_id
        self._heard[robot_id] = status.sent
        now = self._talker.now()
        for record in self.given_to(robot_id):
            overdue = now - self._given[robot_id][record.task.id] > self._timeout
            if overdue and record.task.id not in status.tasks:
                self.give(record)
        strays = [task_id for task_id in status.tasks if not self._is_own(task_id, robot_id)]
        self._have_dropped(robot_id, strays, is_lost=is_lost)
        return not strays

    def _have_dropped(self, robot_id: str, strays: list[str], *, is_lost: bool) -> None:
        """Have a robot drop what is not its own; it has time to do so before it is told again.

        A robot tells its status after each task that it drops. Told each time to drop all others,
        one with fifty of them would get a thousand orders.
        """
        before, now = self._dropped[robot_id], self._talker.now()
        told = self._dropped[robot_id] = {}
        for task_id in strays:
            stray = self._node.get(task_id)
            number = ANY_ASSIGNMENT if is_lost else 0 if stray is None else stray.assignment
            told_at = before.get((task_id, number))
            if told_at is not None and now - told_at <= self._timeout:
                told[task_id, number] = told_at
                continue
            told[task_id, number] = now
            if stray is not None:
                self._tell(stray.task, robot_id, OrderKind.TAKE_BACK, number)
            else:
                # Not any number: another task may get the id before a late order comes.
                self.disown(task_id, robot_id, number or self._node.earlier)

    def _note(self, record: TaskRecord) -> None:
        """Note that a robot holds a task from now on."""
        self.forget(record.task.id)
        self._holders[record.task.id] = record.robot
        self._given[record.robot][record.task.id] = self._talker.now()

    def _held(self, task_ids: Iterable[str]) -> list[TaskRecord]:
        records = map(self._node.get, task_ids)
        return [record for record in records if record is not None and record.is_held]

    def _is_own(self, task_id: str, robot_id: str) -> bool:
        record = self._node.get(task_id)
        return record is not None and record.is_held and record.robot == robot_id

    def _tell(
        self,
        task: Task,
        robot_id: str,
        kind: OrderKind,
        assignment: int,
        step: int = 0,
        place: int = 0,
    ) -> None:
        order = Order(
            task,
            robot_id,
            kind,
            step=step,
            epoch=self._node.epoch,
            assignment=assignment,
            heard=self._heard.get(robot_id, 0.0),
            hive=self._node.hive,
            place=place,
        )
        self._talker.publish(TASK_ASSIGN, order, (robot_id,))
