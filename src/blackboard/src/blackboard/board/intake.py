# SPDX-License-Identifier: BSD-3-Clause
"""What a member refuses on any topic.

ROS makes sure that a number is a number and a text is a text; this module checks that one can
calculate with them and keep them. It lets through what an operator posts, because the blackboard
answers with the reason (see `task.analyze_task`), and bids, which the auction answers.
"""

from __future__ import annotations

import re
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
from blackboard.domain.validation import MAX_NAME, flaw_of
from blackboard.errors import TaskRefusedError

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping

    from blackboard.consensus.messages import AppendEntries
    from blackboard.consensus.task_list import TaskList
    from blackboard.domain.characteristics import RobotStatus
    from blackboard.domain.record import Broadcast, Order, TaskUpdate
    from blackboard.domain.task import Task

_ROBOT = re.compile(rf"[A-Za-z][A-Za-z0-9_]{{0,{MAX_NAME - 1}}}", re.ASCII)
"""ROS's rule for names of namespaces."""

_TYPES = frozenset(kind.value for kind in TaskType)


def why_refused(topic: str, message: object) -> str:
    """Return why a message of a topic is refused, in words for a person; empty if it is not."""
    check = _CHECKS.get(topic)
    return flaw_of(message, type(message).__name__) if check is None else check(message)


def _broadcast_flaw(broadcast: Broadcast) -> str:
    if broadcast.sizes and (sum(broadcast.sizes) != len(broadcast.tasks) or 0 in broadcast.sizes):
        return f"sizes {broadcast.sizes} do not add up to {len(broadcast.tasks)} tasks"
    return next(filter(None, (_task_flaw(*offer) for offer in broadcast.tasks)), "")


def _order_flaw(order: Order) -> str:
    if order.kind is OrderKind.ASSIGN:
        return _task_flaw(order.task, order.step) or flaw_of(order.heard, "Order.heard")
    return _kind_flaw(order.task) or flaw_of(order, "Order")


def _entries_flaw(entries: AppendEntries) -> str:
    records = [record for entry in entries.entries for record in entry.records]
    records += entries.snapshot.records.values() if entries.snapshot else ()
    flaws = (_task_flaw(record.task, record.step) for record in records if not record.parts)
    flaw = next(filter(None, flaws), "") or flaw_of(entries.sent, "AppendEntries.sent")
    forgotten = (flaw_of(entry.forgotten, "Entry.forgotten") for entry in entries.entries)
    return flaw or next(filter(None, forgotten), "")


def _list_flaw(known: TaskList) -> str:
    flaws = (_kind_flaw(record.task) for record in known.records)
    return next(filter(None, flaws), "")


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
