# SPDX-License-Identifier: BSD-3-Clause
"""The columns of the tables of tasks and robots, and which tasks are shown."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

from python_qt_binding.QtCore import QModelIndex, QSortFilterProxyModel

from blackboard.domain.task import TaskState
from fleet_manager.client import tables
from fleet_manager.client.formats import (
    UNKNOWN,
    mass,
    natural,
    percent,
    position,
    type_name,
)
from fleet_manager.client.tables import age, done_in, queued
from fleet_manager.desk.places import place_of
from fleet_manager.gui.look import ROBOT_SIGNS, TASK_SIGNS, Tone
from fleet_manager.gui.rows_model import SORT_ROLE, Column, RowsModel

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping

    from fleet_manager.client.rows import RobotRow, TaskRow
    from fleet_manager.desk.places import Place

LOW = 0.2  # state of charge that needs attention; robots keep 0.1 in reserve
PRIORITY_COLUMN = 7  # of the task table
OPEN = frozenset(state for state in TaskState if not state.is_terminal)
CHOICES: Mapping[frozenset[TaskState], str] = {
    OPEN: "open tasks",
    frozenset(TaskState): "all tasks",
    frozenset(TaskState) - OPEN: "ended tasks",
    **{frozenset({state}): state.name.lower() for state in TaskState},
}
"""The states that can be chosen to be shown, and their words."""


def task_columns(
    now: Callable[[], float], robots: Callable[[], Mapping[str, RobotRow]]
) -> tuple[Column, ...]:
    """Return the columns of the task table.

    Args:
        now: Returns the hive's time [s].
        robots: Returns the robots by name.
    """

    def reason(row: TaskRow) -> str:
        return tables.reason(row, robots())

    def due(row: TaskRow) -> float:
        return math.inf if row.due is None else row.due

    return (
        _named("Task", lambda r: r.record.task.id, letters=7),
        Column("State", _task_state, lambda r: int(r.record.state), _task_tone, letters=11),
        Column("Type", lambda r: type_name(r.record.task.type), _kind, letters=5),
        _named("Robot", lambda r: r.record.robot, letters=8),
        Column("Step", _step, lambda r: r.record.step, letters=5),
        Column("Progress", lambda r: percent(r.progress), _done, share=_done, letters=10),
        Column("Done in", lambda r: done_in(r, now()), due, letters=12),
        Column("Priority", lambda r: str(_priority(r)), _priority, to_right=True, letters=7),
        Column("Payload", lambda r: mass(_payload(r)), _payload, to_right=True, letters=8),
        Column("Age", lambda r: age(r, now()), lambda r: -r.record.task.posted, letters=10),
        Column("Reason", reason, reason, letters=8),
    )


def robot_columns(places: Callable[[], tuple[Place, ...]]) -> tuple[Column, ...]:
    """Return the columns of the robot table; `places` returns the named places of the world."""

    def place(row: RobotRow) -> str:
        pose = row.status.pose
        name = place_of(pose, places())
        return f"{name} ({position(pose)})" if name else position(pose)

    return (
        _named("Robot", lambda r: r.status.robot_id, letters=8),
        Column("State", _robot_state, lambda r: int(r.state), _robot_tone, letters=10),
        Column("Battery", _battery, _charge, _battery_tone, _charge, "100 % low", letters=14),
        _named("Current task", lambda r: r.status.task_id, letters=11),
        Column("Queue", _queue, lambda r: queued(r.status), letters=11),
        Column("Load", lambda r: mass(_load(r)), _load, to_right=True, letters=7),
        Column("Place", place, place, letters=28),
        Column("Reason", lambda r: r.reason, lambda r: r.reason, letters=8),
    )


def _named(head: str, name: Callable[[Any], str], letters: int) -> Column:
    """Return a column of names, in which T9 is before T10."""
    return Column(head, lambda r: name(r) or UNKNOWN, lambda r: natural(name(r)), letters=letters)


def _task_state(row: TaskRow) -> str:
    return f"{TASK_SIGNS[row.record.state][0]} {row.record.state.name.lower()}"


def _task_tone(row: TaskRow) -> Tone:
    return TASK_SIGNS[row.record.state][1]


def _kind(row: TaskRow) -> int:
    return row.record.task.type


def _step(row: TaskRow) -> str:
    return f"{row.record.step} of {row.record.steps}"


def _done(row: TaskRow) -> float:
    return row.progress


def _priority(row: TaskRow) -> int:
    return row.record.task.priority


def _payload(row: TaskRow) -> float:
    return row.record.task.payload


def _robot_state(row: RobotRow) -> str:
    return f"{ROBOT_SIGNS[row.state][0]} {row.state.name.lower()}"


def _robot_tone(row: RobotRow) -> Tone:
    return ROBOT_SIGNS[row.state][1]


def _load(row: RobotRow) -> float:
    return row.status.payload


def _charge(row: RobotRow) -> float:
    return row.status.charge


def _battery(row: RobotRow) -> str:
    return percent(row.status.charge) + (" low" if row.status.charge < LOW else "")


def _battery_tone(row: RobotRow) -> Tone | None:
    return Tone.BAD if row.status.charge < LOW else None


def _queue(row: RobotRow) -> str:
    behind = [name for name in row.status.tasks if name != row.status.task_id]
    return f"{len(behind)}: {', '.join(behind)}" if behind else "0"


class TaskFilter(QSortFilterProxyModel):
    """Shows the tasks in the chosen states whose texts hold what was typed."""

    def __init__(self, source: RowsModel) -> None:
        super().__init__()
        self._states = frozenset(TaskState)
        self._sought = ""
        self._source = source
        self.setSourceModel(source)
        self.setSortRole(SORT_ROLE)
        self.setDynamicSortFilter(True)

    def seek(self, sought: str) -> None:
        """Show only tasks whose id, robot, type, state or reason holds a text."""
        self._sought = sought.strip().casefold()
        self.invalidateFilter()

    def choose(self, states: frozenset[TaskState]) -> None:
        """Show only tasks in these states."""
        self._states = states
        self.invalidateFilter()

    def filterAcceptsRow(self, number: int, _parent: QModelIndex) -> bool:  # noqa: N802  (Qt's name)
        """Return whether a row is shown."""
        record = self._source.row_at(number).record
        if record.state not in self._states:
            return False
        if not self._sought:
            return True
        state, kind = record.state.name, type_name(record.task.type)
        texts = (record.task.id, record.robot, kind, state, record.reason)
        return any(self._sought in words.casefold() for words in texts)

    def names(self, rows: list[QModelIndex]) -> list[str]:
        """Return the ids of shown rows."""
        return [self._source.name_at(self.mapToSource(row).row()) for row in rows]
