# SPDX-License-Identifier: BSD-3-Clause
"""The table of tasks: its columns, and which rows are shown."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from python_qt_binding.QtCore import QModelIndex, QSortFilterProxyModel

from blackboard.domain.task import TaskState, TaskType
from fleet_manager.desk import formats
from fleet_manager.desk.natural import padded
from fleet_manager.desk.words import text
from fleet_manager.gui.look import TASK_SIGNS
from fleet_manager.gui.rows_model import SORT_ROLE, Column, RowsModel

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping

    from fleet_manager.desk.rows import TaskRow
    from fleet_manager.gui.look import Tone

OPEN = frozenset(state for state in TaskState if not state.is_terminal)
CHOICES: Mapping[frozenset[TaskState], str] = {
    frozenset(TaskState): "view.all",
    OPEN: "view.open",
    frozenset(TaskState) - OPEN: "view.ended",
    **{frozenset({state}): f"task.{state.name}" for state in TaskState},
}
"""The states that can be chosen to be shown, with the key of their words."""


def task_columns(now: Callable[[], float]) -> tuple[Column, ...]:
    """Return the columns of the task table.

    Args:
        now: Gives the hive's time [s].
    """

    def state(row: TaskRow) -> str:
        sign, _tone = TASK_SIGNS[row.record.state]
        return f"{sign} {text(f'task.{row.record.state.name}')}"

    def tone(row: TaskRow) -> Tone:
        return TASK_SIGNS[row.record.state][1]

    def step(row: TaskRow) -> str:
        return text("value.step", step=row.record.step, steps=row.record.steps)

    def eta(row: TaskRow) -> str:
        left = None if row.due is None else row.due - now()
        if left is not None and left < -1 and row.record.state is TaskState.ASSIGNED:
            left = None  # more urgent tasks have come before it since the robot said so
        if left is not None and left < -1:
            return text("value.late", time=formats.duration(-left))
        return formats.duration(left)

    def age(row: TaskRow) -> str:
        posted = row.record.task.posted
        return formats.duration(now() - posted if posted > 0 else None)

    return (
        Column("column.id", _id, lambda r: padded(r.record.task.id), letters=7),
        Column("column.state", state, lambda r: int(r.record.state), tone, letters=11),
        Column("column.type", _type, lambda r: r.record.task.type, letters=5),
        Column("column.robot", _robot, lambda r: padded(r.record.robot), letters=8),
        Column("column.step", step, lambda r: r.record.step, letters=5),
        Column("column.progress", _progress, lambda r: r.progress, share=_share, letters=10),
        Column("column.eta", eta, _due, letters=12),
        Column("column.priority", _priority, _urgency, to_right=True, letters=7),
        Column("column.payload", _payload, _weight, to_right=True, letters=8),
        Column("column.age", age, lambda r: -r.record.task.posted, letters=10),
        Column("column.reason", _reason, _reason, letters=8),
    )


def type_name(number: int) -> str:
    """Return the short name of a task type; its number where there is none."""
    return TaskType(number).name if number in {kind.value for kind in TaskType} else str(number)


def _id(row: TaskRow) -> str:
    return row.record.task.id


def _reason(row: TaskRow) -> str:
    return row.record.reason


def _urgency(row: TaskRow) -> int:
    return row.record.task.priority


def _weight(row: TaskRow) -> float:
    return row.record.task.payload


def _type(row: TaskRow) -> str:
    return type_name(row.record.task.type)


def _robot(row: TaskRow) -> str:
    return row.record.robot or text("value.unknown")


def _share(row: TaskRow) -> float:
    return row.progress


def _progress(row: TaskRow) -> str:
    return formats.percent(row.progress)


def _due(row: TaskRow) -> float:
    return math.inf if row.due is None else row.due


def _priority(row: TaskRow) -> str:
    return str(row.record.task.priority)


def _payload(row: TaskRow) -> str:
    return formats.mass(row.record.task.payload)


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
        """Show only tasks whose id, robot, type, state or reason holds this."""
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
        state = text(f"task.{record.state.name}")
        texts = (record.task.id, record.robot, type_name(record.task.type), state, record.reason)
        return any(self._sought in words.casefold() for words in texts)

    def names(self, rows: list[QModelIndex]) -> list[str]:
        """Return the ids of shown rows."""
        return [self._source.name_at(self.mapToSource(row).row()) for row in rows]
