# SPDX-License-Identifier: BSD-3-Clause
"""What becomes of a task whose robot does not finish it: handed back, or lost with its robot."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

from blackboard.domain.task import TaskEvent, TaskState, TaskType, step_to_resume

if TYPE_CHECKING:
    from blackboard.domain.record import TaskRecord, TaskUpdate


def put_back(
    record: TaskRecord, update: TaskUpdate, max_tries: int, *, tried: bool = True
) -> TaskRecord | None:
    """Return a task after its robot has handed it back, or None if that changes nothing.

    A robot that puts a task off for a more urgent one has not tried it in vain, nor has one that
    was asked to hand it back; then `tried` is False. After `max_tries` vain tries the task fails.
    """
    in_vain = tried and not update.put_off_for
    tries = (*record.tried, update.robot_id) if in_vain else record.tried
    step = min(update.step, record.steps)
    return _waiting(record, step, tries, update.reason, max_tries)


def after_loss(
    record: TaskRecord, policy: str, last_seen: str, max_tries: int
) -> TaskRecord | None:
    """Return a task whose robot is lost and has stopped, or None if that changes nothing.

    `policy` is one of `ON_ROBOT_LOST`; if the load may be on board, a person decides anyway.
    `last_seen` says where and when the robot was heard. After `max_tries` vain tries the task
    fails.
    """
    lost = f"{record.robot} is lost, {last_seen}"
    started = record.state is TaskState.STARTED
    if may_be_on_board(record):
        reason = (
            f"{lost}; the load of {record.task.payload:g} kg may be on board: fetch it there, "
            "and post what is left to do as a new task"
        )
        return record.after(TaskEvent.FAIL, eta=0.0, reason=reason)
    if policy == "operator":
        reason = f"{lost}; look how far it has come, and post what is left to do as a new task"
        return record.after(TaskEvent.FAIL, eta=0.0, reason=reason)
    if policy == "wait":
        return replace(record, reason=f"waits for {record.robot} to come back: {lost}")
    if record.task.payload and started:
        lost += f"; bring what was loaded on it ({record.task.payload:g} kg) to the next robot"
    tried = (*record.tried, record.robot) if started else record.tried
    return _waiting(record, record.step, tried, lost, max_tries)


def may_be_on_board(record: TaskRecord) -> bool:
    """Return whether the robot of a task may have taken its load on board with its own arm.

    A robot does not begin to pick before the task list shows that it has arrived, so from that
    step on the load may be on board.
    """
    picks = TaskType(record.task.type).picks
    return picks and record.state is TaskState.STARTED and record.step > 0


def _waiting(
    record: TaskRecord, step: int, tried: tuple[str, ...], reason: str, max_tries: int
) -> TaskRecord | None:
    if len(tried) > len(record.tried) and len(tried) >= max_tries:
        text = f"given up after {len(tried)} tries, the last: {reason}"
        return record.after(TaskEvent.FAIL, tried=tried, eta=0.0, reason=text)
    return record.after(
        TaskEvent.RELEASE,
        robot="",
        step=step_to_resume(record.task, step),
        tried=tried,
        eta=0.0,
        step_eta=0.0,
        eta_margin=0.0,
        reason=reason,
    )
