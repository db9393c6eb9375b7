# SPDX-License-Identifier: BSD-3-Clause
"""What an operator's request brings with it, said before it is sent.

Windows ask with these sentences whether to go on, and the command line prints them.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from blackboard.domain.task import StepKind, TaskState, is_picked, split_task

if TYPE_CHECKING:
    from collections.abc import Iterable

    from blackboard.domain.record import TaskRecord
    from fleet_manager.client.rows import RobotRow


def of_cancelling(records: Iterable[TaskRecord]) -> list[str]:
    """Return what cancelling tasks brings with it; nothing for those without a load on board."""
    return [words for record in records if (words := _left_load(record))]


def of_taking_out(row: RobotRow, records: Iterable[TaskRecord]) -> list[str]:
    """Return what taking a robot out of service brings with it.

    Args:
        row: The robot.
        records: The tasks on the list.
    """
    robot = row.status.robot_id
    held = [record for record in records if record.is_held and record.robot == robot]
    loads = [words for record in held if (words := _left_load(record))]
    moved = [record.task.id for record in held if not _left_load(record)]
    if moved:
        loads.insert(
            0, f"{robot} hands back {', '.join(moved)}; other robots get what they can do"
        )
    return loads


def _left_load(record: TaskRecord) -> str:
    """Return what becomes of the load of a task whose robot is stopped; empty if it has none."""
    task, step = record.task, record.step
    if record.state is not TaskState.STARTED or record.parts:
        return ""
    steps = split_task(task)
    on_board = is_picked(task, step)
    picks = step < len(steps) and steps[step].kind is StepKind.PICK
    if not on_board and not picks:
        return ""
    carries = "carries" if on_board else "may be picking"
    return (
        f"{record.robot} {carries} the load of {task.id} ({task.payload:g} kg): it stops where it "
        "is, and stays out of service until its load is off. Send it to put the load down "
        f"(hive robot {record.robot} put-down PLACE), or take the load off and say so "
        f"(hive robot {record.robot} in)"
    )
