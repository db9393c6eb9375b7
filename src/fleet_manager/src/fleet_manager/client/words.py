# SPDX-License-Identifier: BSD-3-Clause
"""Says in words what changed in a hive, for `hive events` and for waiting commands."""

from __future__ import annotations

from typing import TYPE_CHECKING

from blackboard.consensus.messages import Heartbeat
from blackboard.consensus.task_list import TaskList
from blackboard.domain.characteristics import RobotState, RobotStatus
from blackboard.domain.record import TaskRecord, TaskUpdate
from blackboard.domain.task import TaskState, TaskType

if TYPE_CHECKING:
    from blackboard.domain.task import Task
    from fleet_manager.client.hive_view import HiveView, Report

_ROBOT_WORDS = {
    RobotState.IDLE: "is ready",
    RobotState.BUSY: "is at work",
    RobotState.DEFECT: "is out of service",
    RobotState.CHARGING: "is charging",
    RobotState.OFFLINE: "is not heard of any more",
}


def changes(view: HiveView, report: Report) -> list[str]:
    """Return a sentence for everything that a report says anew.

    Args:
        view: The picture before the report was taken in.
        report: What the hive said.

    Returns:
        Sentences without a full stop; empty where the report changes nothing.
    """
    if isinstance(report, TaskList):
        return [] if view.is_stale(report) else _list_changes(view, report)
    if isinstance(report, TaskUpdate):
        return _update_changes(view, report)
    if isinstance(report, RobotStatus):
        return _robot_changes(view.robots.get(report.robot_id), report)
    if isinstance(report, Heartbeat):
        return _heartbeat_changes(view.heartbeat, report)
    return []


def task_words(state: TaskState, robot: str, step: int, steps: int, reason: str) -> str:
    """Return where a task stands, as the rest of a sentence that begins with its id."""
    because = f": {reason}" if reason else ""
    by = f" by {robot}" if robot else ""
    words = {
        TaskState.WAITING: f"waits for a robot{because}",
        TaskState.ASSIGNED: f"is on the list of {robot}",
        TaskState.STARTED: f"is under way{by}, {step} of {steps} steps done{because}",
        TaskState.DONE: f"is done{by}",
        TaskState.REJECTED: f"was rejected{because}",
        TaskState.CANCELLED: f"was cancelled{because}",
        TaskState.FAILED: f"has failed{by}{because}",
    }
    return words[state]


def order_words(task: Task) -> str:
    """Return what a task asks for: `GPAB (9.0, 3.0) -> (2.0, 6.5), 5 kg, priority 7`."""
    way = " -> ".join(f"({goal.x:.1f}, {goal.y:.1f})" for goal in task.goals)
    return f"{TaskType(task.type).name} {way}, {task.payload:g} kg, priority {task.priority}"


def _list_changes(view: HiveView, task_list: TaskList) -> list[str]:
    said = []
    for record in map(view.newest, task_list.records):
        task_id = record.task.id
        if task_id not in view.tasks and task_id not in view.answers:
            said.append(f"task {task_id} is on the list: {order_words(record.task)}")
        known = view.tasks.get(task_id) or view.answers.get(task_id)
        if known is None or known.state is not record.state or _step(known) != record.step:
            words = task_words(
                record.state, record.robot, record.step, record.steps, record.reason
            )
            said.append(f"task {task_id} {words}")
    return said


def _update_changes(view: HiveView, update: TaskUpdate) -> list[str]:
    known = view.tasks.get(update.task_id) or view.answers.get(update.task_id)
    same = (
        known is not None
        and (known.state, _step(known), known.reason) == (update.state, update.step, update.reason)
        and (isinstance(known, TaskUpdate) or known.robot == update.robot_id)
    )
    if same or view.is_late(update):
        return []
    words = task_words(update.state, update.robot_id, update.step, update.steps, update.reason)
    return [f"task {update.task_id} {words}"]


def _step(known: TaskRecord | TaskUpdate) -> int:
    return known.step


def _robot_changes(before: RobotStatus | None, now: RobotStatus) -> list[str]:
    because = f": {now.reason}" if now.reason else ""
    if before is None:
        return [f"{now.robot_id} {_ROBOT_WORDS[now.state]}{because}, battery {now.charge:.0%}"]
    if before.state is not now.state:
        return [f"{now.robot_id} {_ROBOT_WORDS[now.state]}{because}"]
    return []


def _heartbeat_changes(before: Heartbeat | None, now: Heartbeat) -> list[str]:
    if before is not None and now.epoch < before.epoch:
        return []
    said = []
    if before is None or (before.leader, before.epoch) != (now.leader, now.epoch):
        said.append(f"{now.leader.strip('/')} carries the blackboard, epoch {now.epoch}")
    if now.backup and (before is None or before.backup != now.backup):
        said.append(f"{now.backup.strip('/')} is its backup")
    if before is not None:
        joined, left = (
            set(now.members) - set(before.members),
            set(before.members) - set(now.members),
        )
        said += [f"{name.strip('/')} joined the hive" for name in sorted(joined)]
        said += [f"{name.strip('/')} left the hive" for name in sorted(left)]
    return said
