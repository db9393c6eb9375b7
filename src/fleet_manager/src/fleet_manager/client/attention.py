# SPDX-License-Identifier: BSD-3-Clause
"""What needs a person, in a few words: for the line at the top of the windows."""

from __future__ import annotations

from typing import TYPE_CHECKING

from blackboard.domain.characteristics import RobotState
from blackboard.domain.task import TaskState
from fleet_manager.client.formats import counted, duration, natural
from fleet_manager.client.words import Severity

if TYPE_CHECKING:
    from collections.abc import Iterable

    from fleet_manager.client.hive_state import HiveState
    from fleet_manager.client.rows import RobotRow, TaskRow

MOST_NAMED = 3
"""Of more robots or tasks than this only the number is told, after the first ones."""

LATE = 10.0
"""A task is late when its prediction is older than this [s]; robots predict no better."""

WAITS_LONG = 60.0
"""A task that waits for a robot for longer is told, even if nobody says why [s]."""


def needs(state: HiveState, now: float) -> list[tuple[str, Severity]]:
    """Return what needs a person, each with how urgent it is; nothing if all is well.

    Args:
        state: What is known of the hive.
        now: The hive's time [s]; 0 where unknown.
    """
    rows = [row for row in state.tasks.values() if row.is_open]
    found = [
        *_robots(state.robots.values()),
        *_on_other_maps(state),
        *_waiting(rows, now),
        *_late(rows, now),
    ]
    traffic = state.traffic
    if traffic is not None and traffic.closed:
        closed = ", ".join(traffic.closed)
        found.append((f"closed: {closed}", Severity.WARNING))
    if state.planner_is_silent:
        text = "the traffic planner is silent: robots drive by right of way"
        found.append((text, Severity.WARNING))
    return found


def _robots(rows: Iterable[RobotRow]) -> list[tuple[str, Severity]]:
    found = []
    for robot_state, word in ((RobotState.OFFLINE, "offline"), (RobotState.DEFECT, "defect")):
        names = sorted((r.status.robot_id for r in rows if r.state is robot_state), key=natural)
        if names:
            found.append((f"{_some(names, 'robot')} {word}", Severity.ALARM))
    return found


def _on_other_maps(state: HiveState) -> list[tuple[str, Severity]]:
    """Return the robots that get no tasks because they use another map than the leader."""
    beat = state.heartbeat
    names = [
        name
        for name, row in state.robots.items()
        if beat is not None
        and row.state is not RobotState.OFFLINE
        and row.status.map.differs(beat.map)
    ]
    if not names:
        return []
    uses = "uses another map" if len(names) == 1 else "use other maps"
    text = f"{_some(sorted(names, key=natural), 'robot')} {uses} than the leader"
    return [(text, Severity.ALARM)]


def _waiting(rows: Iterable[TaskRow], now: float) -> list[tuple[str, Severity]]:
    """Return the tasks that wait for a reason, or for long; the first with why."""
    waits = [row for row in rows if row.record.state is TaskState.WAITING]
    waiting = [
        row
        for row in waits
        if (row.record.reason and not row.record.is_moved) or _age(row, now) > WAITS_LONG
    ]
    if not waiting:
        return []
    first = waiting[0].record
    why = first.reason or f"no robot has taken it for {duration(_age(waiting[0], now))}"
    others = f", and {counted(len(waiting) - 1, 'other task')}" if len(waiting) > 1 else ""
    return [(f"{first.task.id}{others} wait{'s' * (not others)}: {why}", Severity.WARNING)]


def _late(rows: Iterable[TaskRow], now: float) -> list[tuple[str, Severity]]:
    late = [
        row.record.task.id
        for row in rows
        if row.record.state is TaskState.STARTED
        and row.due is not None
        and 0 < row.due < now - LATE
    ]
    return [(f"{_some(late, 'task')} late", Severity.WARNING)] if late else []


def _age(row: TaskRow, now: float) -> float:
    posted = row.record.task.posted
    return now - posted if 0 < posted <= now else 0.0


def _some(names: list[str], what: str) -> str:
    """Return names, or some of them and how many there are."""
    if len(names) <= MOST_NAMED:
        return ", ".join(names)
    return (
        f"{', '.join(names[:MOST_NAMED])} and {counted(len(names) - MOST_NAMED, f'other {what}')}"
    )
