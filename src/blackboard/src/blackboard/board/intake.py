# SPDX-License-Identifier: BSD-3-Clause
"""What a member refuses on any topic.

ROS makes sure that a number is a number and a text is a text; this module checks that one can
calculate with them and keep them. It lets through what an operator posts, because the blackboard
answers with the reason (see `task.analyze_task`), and bids, which the auction answers.
"""

from __future__ import annotations

import re
from dataclasses import replace
from functools import lru_cache
from types import MappingProxyType
from typing import TYPE_CHECKING, Any

from blackboard.domain.record import OrderKind
from blackboard.domain.talker import (
    BB_ENTRIES,
    NEW_TASK,
    ROBOT_STATUS,
    SYNC,
    TASK_ASSIGN,
    TASK_BROADCAST,
    TASK_COST,
    TASK_STATE,
)
from blackboard.domain.task import MAX_ID_LENGTH, TaskType, analyze_task, split_task
from blackboard.domain.validation import MAX_ITEMS, MAX_NAME, flaw_of
from blackboard.errors import TaskRefusedError

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Mapping

    from blackboard.consensus.messages import AppendEntries
    from blackboard.consensus.task_list import TaskList
    from blackboard.domain.characteristics import RobotStatus
    from blackboard.domain.record import Broadcast, Order, TaskRecord, TaskUpdate
    from blackboard.domain.task import Task

_ROBOT = re.compile(rf"[A-Za-z][A-Za-z0-9_]{{0,{MAX_NAME - 1}}}", re.ASCII)
"""ROS's rule for names of namespaces."""

_TYPES = frozenset(kind.value for kind in TaskType)


def why_refused(topic: str, message: object) -> str:
    """Return why a message of a topic is refused, in words for a person; empty if it is not."""
    check = _CHECKS.get(topic)
    return flaw_of(message, type(message).__name__) if check is None else check(message)


def _broadcast_flaw(broadcast: Broadcast) -> str:
    if len(broadcast.tasks) > MAX_ITEMS:
        return f"Broadcast.tasks has {len(broadcast.tasks)} items; allowed: at most {MAX_ITEMS}"
    flaw = next(filter(None, (_task_flaw(*offer) for offer in broadcast.tasks)), "")
    return flaw or flaw_of(replace(broadcast, tasks=()), "Broadcast")


def _order_flaw(order: Order) -> str:
    is_new = order.kind is OrderKind.ASSIGN
    flaw = _task_flaw(order.task, order.step) if is_new else _kind_flaw(order.task)
    return flaw or flaw_of(order, "Order")


def _entries_flaw(entries: AppendEntries) -> str:
    records = [record for entry in entries.entries for record in entry.records]
    snapshot = entries.snapshot
    if snapshot is not None:
        records += snapshot.records.values()
        snapshot = replace(snapshot, records={})
    bare = tuple(replace(entry, records=()) for entry in entries.entries)
    rest = replace(entries, entries=bare, snapshot=snapshot)
    return _records_flaw(records) or flaw_of(rest, "AppendEntries")


def _list_flaw(known: TaskList) -> str:
    return _records_flaw(known.records) or flaw_of(replace(known, records=()), "TaskList")


def _records_flaw(records: Iterable[TaskRecord]) -> str:
    flawed = ((record.task.id, flaw) for record in records if (flaw := record_flaw(record)))
    return next((f"the task {task_id}: {flaw}" for task_id, flaw in flawed), "")


@lru_cache(maxsize=4096)  # A task list is told again and again, and hardly anything has changed.
def record_flaw(record: TaskRecord) -> str:
    """Return what is wrong with a record; its texts may be as long as the leader made them."""
    if record.step > record.parts > 0:
        return f"step {record.step} of {record.task.id} is beyond its {record.parts} parts"
    flaw = _task_flaw(record.task, 0 if record.parts else record.step)
    return flaw or flaw_of(replace(record, reason="", division=""), "TaskRecord")


def _update_flaw(update: TaskUpdate) -> str:
    if not update.task_id:
        return "task_id is empty; it says which task the message is about"
    return flaw_of(update, "TaskUpdate")


def _status_flaw(status: RobotStatus) -> str:
    if not _ROBOT.fullmatch(status.robot_id):
        return (
            f"robot_id {status.robot_id[:MAX_ID_LENGTH]!r} is no name; "
            "allowed: letters, digits and underscores, a letter first"
        )
    if not 0.0 <= status.charge <= 1.0:
        return f"RobotStatus.charge of {status.robot_id} is {status.charge:g}; allowed: 0 to 1"
    return flaw_of(status, "RobotStatus")


_CHECKS: Mapping[str, Callable[[Any], str]] = MappingProxyType(
    {
        NEW_TASK: lambda _task: "",
        TASK_COST: lambda _bids: "",
        TASK_BROADCAST: _broadcast_flaw,
        TASK_ASSIGN: _order_flaw,
        BB_ENTRIES: _entries_flaw,
        SYNC: _list_flaw,
        TASK_STATE: _update_flaw,
        ROBOT_STATUS: _status_flaw,
    }
)
"""Checks by topic; on other topics only numbers, texts and lengths are checked."""


def _kind_flaw(task: Task) -> str:
    return "" if task.type in _TYPES else f"type {task.type} is unknown"


@lru_cache(maxsize=1024)  # A member sees a task in calls, in orders and in every change of it.
def _task_flaw(task: Task, step: int) -> str:
    """Return what is wrong with a task that is offered, assigned, or on the list."""
    try:
        analyze_task(task)
    except TaskRefusedError as error:
        return str(error)
    steps = len(split_task(task))
    return "" if step <= steps else f"step {step} of {task.id} is beyond its {steps} steps"
