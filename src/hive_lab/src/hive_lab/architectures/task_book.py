# SPDX-License-Identifier: BSD-3-Clause
"""The tasks that one node has taken on, in its memory only, and the orders it has given."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

from blackboard.domain.record import Order, OrderKind, TaskRecord, TaskUpdate
from blackboard.domain.talker import TASK_ASSIGN, TASK_STATE
from blackboard.domain.task import TaskEvent, TaskState, analyze_task
from blackboard.errors import TaskRefusedError

if TYPE_CHECKING:
    from collections.abc import Iterator

    from blackboard.domain.characteristics import RobotStatus
    from blackboard.domain.path_lengths import PathLengths
    from blackboard.domain.talker import Talker
    from blackboard.domain.task import Task

LOST = 5.0
"""A robot that is silent for longer is lost, as with the default `reassign` of the hive [s]."""

_REPEAT = 2.0  # an order that a robot does not show after this time is repeated, as the hive's [s]

_EVENTS = {
    TaskState.WAITING: TaskEvent.RELEASE,
    TaskState.STARTED: TaskEvent.START,
    TaskState.DONE: TaskEvent.FINISH,
    TaskState.FAILED: TaskEvent.FAIL,
}
_ENDS_REPORTS = {TaskState.WAITING, TaskState.DONE, TaskState.FAILED}


class TaskBook:
    """Gives tasks to robots and follows them, for a node that nobody replaces.

    Args:
        talker: Of the node.
        node: Its name; orders carry it, so that robots know whom to report to.
        path_lengths: Tell which goals nobody can reach.

    Attributes:
        records: The tasks by id, in the order in which they came.
    """

    def __init__(self, talker: Talker, node: str, path_lengths: PathLengths) -> None:
        self.records: dict[str, TaskRecord] = {}
        self._talker = talker
        self._node = node
        self._path_lengths = path_lengths
        self._ordered: dict[str, float] = {}  # when each held task was ordered last [s]
        self._heard: dict[str, float] = {}

    def take_in(self, task: Task) -> bool:
        """Take a task on, and tell the operator; return whether it is new."""
        known = self.records.get(task.id)
        if known is not None:
            self._tell(known)
            return False
        try:
            analyze_task(task, self._path_lengths)
        except TaskRefusedError as error:
            update = TaskUpdate(task.id, TaskState.REJECTED, reason=str(error))
            self._talker.publish(TASK_STATE, update, ())
            return False
        record = TaskRecord.new(replace(task, posted=self._talker.date()), 0)
        self._note(record)
        return True

    def waiting(self) -> list[TaskRecord]:
        """Return the tasks that no robot has."""
        return [each for each in self.records.values() if each.state is TaskState.WAITING]

    def held_by(self, robot: str) -> Iterator[TaskRecord]:
        """Yield the tasks that a robot has."""
        return (each for each in self.records.values() if each.is_held and each.robot == robot)

    def give(self, task_id: str, robot: str) -> None:
        """Give a waiting task to a robot."""
        record = self.records[task_id]
        changed = record.after(TaskEvent.ASSIGN, robot=robot, assignment=record.assignment + 1)
        if changed is not None:
            # It counts as heard now: the time in which it has to answer begins.
            self._heard[robot] = self._talker.now()
            self._note(changed)
            self._order(changed, OrderKind.ASSIGN)

    def hear_status(self, status: RobotStatus) -> None:
        """Note that a robot lives, and repeat orders that it should show by now."""
        now = self._talker.now()
        self._heard[status.robot_id] = now
        for record in self.held_by(status.robot_id):
            late = now - self._ordered[record.task.id] > _REPEAT
            if late and record.task.id not in status.tasks:
                self._order(record, OrderKind.ASSIGN)

    def hear_update(self, update: TaskUpdate) -> TaskRecord | None:
        """Follow a robot's report; return the record if that has changed."""
        record, event = self.records.get(update.task_id), _EVENTS.get(update.state)
        if record is None or event is None or not update.robot_id:
            return None
        self._heard[update.robot_id] = self._talker.now()
        if update.state in _ENDS_REPORTS:
            self._acknowledge(record.task, update)
        holds = (update.robot_id, update.assignment) == (record.robot, record.assignment)
        if not holds and event is not TaskEvent.FINISH:
            return None
        if event is TaskEvent.START and not record.gets_on(update):
            return None
        changed = record.reported(event, update, self._talker.date())
        if changed is None:
            return None
        if not holds and record.is_held:
            self._order(record, OrderKind.TAKE_BACK)  # another robot has done it
        self._note(changed)
        return changed

    def release_lost(self) -> bool:
        """Take the tasks of robots back that are lost; return whether there were any."""
        now, found = self._talker.now(), False
        for record in list(self.records.values()):
            if record.is_held and now - self._heard.get(record.robot, now) > LOST:
                changed = record.after(TaskEvent.RELEASE, robot="", reason="its robot is lost")
                if changed is not None:
                    found = True
                    self._note(changed)
        return found

    def repeat(self) -> None:
        """Repeat the orders to robots of which nothing was heard since."""
        now = self._talker.now()
        for record in self.records.values():
            if record.state is TaskState.ASSIGNED:
                ordered = self._ordered[record.task.id]
                if now - ordered > _REPEAT and self._heard.get(record.robot, 0.0) <= ordered:
                    self._order(record, OrderKind.ASSIGN)

    def _order(self, record: TaskRecord, kind: OrderKind) -> None:
        self._ordered[record.task.id] = self._talker.now()
        order = Order(
            record.task,
            record.robot,
            kind,
            step=record.step,
            assignment=record.assignment,
            hive=self._node,
        )
        self._talker.publish(TASK_ASSIGN, order, (record.robot,))

    def _acknowledge(self, task: Task, update: TaskUpdate) -> None:
        order = Order(
            task,
            update.robot_id,
            OrderKind.FORGOTTEN,
            assignment=update.assignment,
            hive=self._node,
        )
        self._talker.publish(TASK_ASSIGN, order, (update.robot_id,))

    def _note(self, record: TaskRecord) -> None:
        self.records[record.task.id] = record
        self._tell(record)

    def _tell(self, record: TaskRecord) -> None:
        """Tell the operator, and no other node."""
        self._talker.publish(TASK_STATE, record.told(0), ())
