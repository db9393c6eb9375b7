# SPDX-License-Identifier: BSD-3-Clause
"""What must always hold of a hive, looked at after everything that happens in it.

A `Hive` on virtual time shows both what its members say and what its robots really do, so these
properties are checked against the truth and not against what the hive believes.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from blackboard.domain.talker import SYNC, TASK_STATE
from blackboard.domain.task import StepKind, TaskState

if TYPE_CHECKING:
    from blackboard.consensus.task_list import TaskList
    from blackboard.domain.record import TaskRecord, TaskUpdate
    from blackboard.robot.robot import Robot
    from hive_lab.virtual.hive import Hive

_WITH_A_ROBOT = {TaskState.ASSIGNED, TaskState.STARTED}


class TaskChecker:
    """Watches a hive and raises AssertionError as soon as something does not hold.

    1. No task is under way with two robots at once.
    2. A task is done once: when a robot has said DONE, nobody says DONE for another run or begins
       a step of the task, unless that robot's process has ended since or it had been given up for
       lost.
    3. What was said to be taken in stays on the list until it was said that it has ended.
    4. What has ended stays as it ended.
    5. A task that is assigned or started has a robot, unless it was split, and one that waits has
       none.
    6. A task goes to a robot under a new number each time.
    7. A task that has not ended leaves a robot only when that robot has handed it back, or is lost
       and has stopped.
    8. An arm works only where the robot stands at the goal.

    Args:
        hive: To be watched from now on.

    Attributes:
        accepted: The tasks that were said to be taken in.
    """

    def __init__(self, hive: Hive) -> None:
        self._hive = hive
        self._read = 0
        self._known: dict[str, TaskRecord] = {}
        self._done_by: dict[str, tuple[Robot, int]] = {}
        self._handed_back: set[tuple[str, str, int]] = set()
        self._lost: set[str] = set()
        self._ended: set[str] = set()
        self.accepted: set[str] = set()
        hive.network.watch(self.check)

    def check(self) -> None:
        """Look at the robots, and at all that was said since the last time."""
        self._check_robots()
        sent: list[tuple[str, Any]] = self._hive.network.sent[self._read :]
        self._read += len(sent)
        for topic, message in sent:
            if topic == TASK_STATE:
                self._check_update(message)
            elif topic == SYNC:
                self._check_list(message)

    def unfinished(self) -> dict[str, str]:
        """Return what was taken in and is not done by now, each with the reason."""
        return {
            name: record.reason
            for name, record in self._known.items()
            if record.state is not TaskState.DONE
        }

    def _check_robots(self) -> None:
        at_work: dict[str, str] = {}
        for name, command in self._hive.commands.items():
            step = command.running
            if step is None:
                continue
            other = at_work.setdefault(step.task_id, name)
            _hold(other == name, f"{other} and {name} are at work on {step.task_id}")
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
        forgotten = first is None or first[0] not in self._hive.robots.values()
        forgotten |= update.task_id in self._lost
        if update.state is TaskState.DONE and forgotten:
            self._done_by[update.task_id] = run
        elif update.state is TaskState.DONE:
            _hold(first == run, f"{update.task_id} is done again by {update.robot_id}")
        else:
            _hold(forgotten, f"{update.task_id} is done, and {update.robot_id} goes on with it")

    def _check_list(self, known: TaskList) -> None:
        now = {record.task.id: record for record in known.records}
        gone = (self.accepted | self._known.keys()) - now.keys()
        lost = sorted(gone - self._ended)
        _hold(not lost, f"{lost} had been taken in and are on the list no more")
        for name in gone:
            self._done_by.pop(name, None)
            self.accepted.discard(name)
        self._ended |= {name for name, record in now.items() if record.state.is_terminal}
        for name, record in now.items():
            _check_record(record)
            if name in self._known:
                _check_change(self._known[name], record)
                self._check_holder(self._known[name], record)
        self._known = now

    def _check_holder(self, before: TaskRecord, after: TaskRecord) -> None:
        holder = before.robot, before.assignment
        name = before.task.id
        left = not after.state.is_terminal and (after.robot, after.assignment) != holder
        if not (left and before.robot) or (name, *holder) in self._handed_back:
            return
        self._lost.add(name)
        step = self._hive.commands[before.robot].running
        _hold(
            step is None or step.task_id != name,
            f"{name} was taken from {before.robot}, which is still at it",
        )


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
    """Raise AssertionError with what is wrong, also where Python leaves `assert` out."""
    if not holds:
        raise AssertionError(otherwise)
