# SPDX-License-Identifier: BSD-3-Clause
"""Properties of tasks that must always hold, checked after every event of a `Hive`.

The checker compares what members say with what the robots really do, not with what the hive
believes.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from blackboard.domain.talker import SYNC, TASK_STATE
from blackboard.domain.task import StepKind, TaskState

if TYPE_CHECKING:
    from collections.abc import Collection, Mapping

    from blackboard.consensus.task_list import TaskList
    from blackboard.domain.record import TaskRecord, TaskUpdate
    from blackboard.robot.robot import Robot
    from hive_lab.virtual.hive import Hive

_WITH_A_ROBOT = {TaskState.ASSIGNED, TaskState.STARTED}


class TaskChecker:
    """Watches a hive and raises AssertionError as soon as a property breaks.

    1. No two robots work on one task, or on a task and a part of it, at the same time.
    2. A task is done once: after a robot says DONE, nobody reports DONE for another run or begins
       a step of the task, unless that robot's process has ended since or the task had been taken
       from it because it was lost.
    3. A task that was accepted stays on the task list until somebody says that it has ended. A
       part that nobody has may also leave it when its task is whole again.
    4. A terminal state never changes.
    5. An assigned or started task has a robot, unless it was split; a waiting task has none.
    6. Every assignment of a task has a new number.
    7. An unfinished task leaves a robot only after the robot has handed it back, or is lost and
       has stopped.
    8. An arm works only while its robot stands at the goal.
    """

    def __init__(self, hive: Hive) -> None:
        self._hive = hive
        self._read = 0
        self._records: dict[str, TaskRecord] = {}
        self._done_by: dict[str, tuple[Robot, int]] = {}
        self._handed_back: set[tuple[str, str, int]] = set()
        self._lost: set[str] = set()
        self._ended: set[str] = set()
        self.accepted: set[str] = set()
        hive.network.watch(self.check)

    def check(self) -> None:
        """Check the robots, and everything said since the last check."""
        self._check_robots()
        sent: list[tuple[str, Any]] = self._hive.network.sent[self._read :]
        self._read += len(sent)
        for topic, message in sent:
            if topic == TASK_STATE:
                self._check_update(message)
            elif topic == SYNC:
                self._check_list(message)

    def unfinished(self) -> dict[str, str]:
        """Return the accepted tasks that are not done, each with its reason."""
        return {
            name: record.reason
            for name, record in self._records.items()
            if record.state is not TaskState.DONE
        }

    def _check_robots(self) -> None:
        at_work: dict[str, str] = {}
        for name, command in self._hive.commands.items():
            step = command.running
            if step is None:
                continue
            other = at_work.setdefault(step.task_id, name)
            _hold(other == name, f"{other} and {name} work on {step.task_id}")
            both = [task for task in at_work if task.startswith(f"{step.task_id}.")]
            both += [task for task in at_work if step.task_id.startswith(f"{task}.")]
            _hold(not both, f"robots work on {step.task_id} and on {', '.join(both)}")
            _hold(
                step.kind is StepKind.MOVE or self._hive.robots[name].status.pose == step.goal,
                f"{name} does {step.kind.name} of {step.task_id} somewhere else",
            )

    def _check_update(self, update: TaskUpdate) -> None:
        if update.state.is_terminal:
            self._ended.add(update.task_id)
        if update.state is TaskState.WAITING and not update.robot_id:
            self.accepted.add(update.task_id)
            self._ended.discard(update.task_id)
        elif update.state is TaskState.WAITING:
            self._handed_back.add((update.task_id, update.robot_id, update.assignment))
        robot = self._hive.robots.get(update.robot_id)
        if robot is None or update.state not in {TaskState.STARTED, TaskState.DONE}:
            return
        run = (robot, update.assignment)
        first = self._done_by.get(update.task_id)
        superseded = first is None or first[0] not in self._hive.robots.values()
        superseded |= update.task_id in self._lost
        if update.state is TaskState.DONE and superseded:
            self._done_by[update.task_id] = run
        elif update.state is TaskState.DONE:
            _hold(first == run, f"{update.task_id} is done again by {update.robot_id}")
        else:
            _hold(superseded, f"{update.task_id} is done, and {update.robot_id} works on")

    def _check_list(self, known: TaskList) -> None:
        now = {record.task.id: record for record in known.records}
        gone = (self.accepted | self._records.keys()) - now.keys()
        lost = sorted(name for name in gone - self._ended if not self._is_joined(name, now))
        _hold(not lost, f"{lost} were accepted and are missing from the task list")
        for name in gone:
            self._done_by.pop(name, None)
            self.accepted.discard(name)
        self._ended |= {name for name, record in now.items() if record.state.is_terminal}
        for name, record in now.items():
            _check_record(record)
            if name in self._records:
                _check_change(self._records[name], record)
                self._check_holder(self._records[name], record)
        self._records = now

    def _is_joined(self, name: str, now: Mapping[str, TaskRecord]) -> bool:
        """Return whether a task is gone because that of which it was a part is whole again."""
        record = self._records.get(name)
        if record is None or not record.parent:
            return False
        whole = now.get(record.parent)
        return self._is_joined(record.parent, now) if whole is None else not whole.parts

    def _check_holder(self, before: TaskRecord, after: TaskRecord) -> None:
        name = before.task.id
        if not before.robot or not is_taken_away(before, after, self._handed_back):
            return
        self._lost.add(name)
        step = self._hive.commands[before.robot].running
        _hold(
            step is None or step.task_id != name,
            f"{name} was taken from {before.robot}, which still works on it",
        )


def is_taken_away(
    before: TaskRecord, after: TaskRecord, handed_back: Collection[tuple[str, str, int]]
) -> bool:
    """Return whether an unfinished task leaves its robot that has not handed it back."""
    holder = before.robot, before.assignment
    leaves = not after.state.is_terminal and (after.robot, after.assignment) != holder
    return leaves and (before.task.id, *holder) not in handed_back


def _check_record(record: TaskRecord) -> None:
    name, state = record.task.id, record.state
    _hold(
        bool(record.robot or record.parts) or state not in _WITH_A_ROBOT,
        f"{name} is {state.name} without a robot",
    )
    _hold(
        not record.robot or state is not TaskState.WAITING,
        f"{name} waits, yet {record.robot} has it",
    )


def _check_change(before: TaskRecord, after: TaskRecord) -> None:
    name = before.task.id
    _hold(
        not before.state.is_terminal or after.state is before.state,
        f"{name} had ended as {before.state.name} and is now {after.state.name}",
    )
    moved = after.state in _WITH_A_ROBOT and after.robot not in {before.robot, ""}
    _hold(
        not moved or after.assignment > before.assignment,
        f"{name} went from {before.robot!r} to {after.robot} under one number",
    )


def _hold(holds: bool, otherwise: str) -> None:
    """Raise AssertionError, also when Python runs without `assert`."""
    if not holds:
        raise AssertionError(otherwise)
