# SPDX-License-Identifier: BSD-3-Clause
"""What the hive will do with a task that is too heavy for one robot, before it is posted."""

from __future__ import annotations

from typing import TYPE_CHECKING

from blackboard.auction.splitting import division
from blackboard.domain.task import TaskType
from blackboard.errors import SplitRefusedError

if TYPE_CHECKING:
    from collections.abc import Iterable

    from blackboard.domain.characteristics import RobotStatus
    from blackboard.domain.task import Task


def outlook(task: Task, robots: Iterable[RobotStatus]) -> str:
    """Return in words that a task will be split, or will wait, because it is too heavy.

    Empty if one robot in service can carry it, or if one of them does not tell what it carries, so
    that nothing is certain. `robots` holds the last status of every robot; the hive decides by
    those that are in service when it auctions the task.
    """
    kind, name = TaskType(task.type), task.id or "the task"
    most = {each.robot_id: each.most_payload(kind) for each in robots if each.state.in_service}
    if None in most.values():
        return ""
    try:
        how = division(task, most)
    except SplitRefusedError as error:
        return f"{name} will wait: {error}"
    if how is None:
        return ""
    return (
        f"no robot in service can carry {task.payload:g} kg ({how.strongest} carries most: "
        f"{how.most:g} kg); the hive will split {name} into {len(how.shares)} parts"
    )
