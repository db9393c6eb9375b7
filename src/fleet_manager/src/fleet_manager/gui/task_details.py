# SPDX-License-Identifier: BSD-3-Clause
"""The window with everything that is known about one task."""

from __future__ import annotations

from typing import TYPE_CHECKING

from python_qt_binding.QtCore import Qt
from python_qt_binding.QtWidgets import QDialog, QTableWidgetItem

from blackboard.domain.task import goal_name
from fleet_manager.client import formats
from fleet_manager.client.bids import HEADS, bid_cells, story
from fleet_manager.gui.look import load_form

if TYPE_CHECKING:
    from blackboard.domain.record import TaskRecord
    from fleet_manager.client.rows import Changes
    from fleet_manager.gui.desk import Desk


class TaskDetails(QDialog):
    """Goals, state and bids of one task, kept up to date while it is open."""

    def __init__(self, desk: Desk, task_id: str, parent: object = None) -> None:
        super().__init__(parent)
        load_form("task_details", self)
        self.setAttribute(Qt.WA_DeleteOnClose)
        self.setWindowTitle(f"Task {task_id}")
        self._desk, self._task_id = desk, task_id
        self._asked_at: tuple[object, ...] = ()
        self.bid_table.setColumnCount(len(HEADS))
        self.bid_table.setHorizontalHeaderLabels(HEADS)
        self.bid_table.horizontalHeader().setStretchLastSection(True)
        self.bid_table.verticalHeader().hide()
        self.bid_table.setEditTriggers(self.bid_table.NoEditTriggers)
        self.close_button.clicked.connect(self.close)
        desk.changed.connect(self._follow)
        self._show()
        width = self.fontMetrics().averageCharWidth()
        self.resize(140 * width, 34 * self.fontMetrics().lineSpacing())

    def _follow(self, changes: Changes) -> None:
        if self._task_id in changes.tasks:
            self._show()

    def _show(self) -> None:
        record = self._desk.hive.record(self._task_id)
        if record is None:
            return
        self._ask_for_bids(record)
        self.asked_label.setText(asked(record))
        self.stands_label.setText("\n".join([stands(record), times(record, self._desk.now())]))
        book = self._desk.hive.bid_book
        bids = book.bids(self._task_id)
        why = story(record, book.auctions(self._task_id))
        self.story_label.setText(why)
        self.story_label.setVisible(bool(why))
        self.no_bids_label.setVisible(not bids)
        self.bid_table.setVisible(bool(bids))
        self.bid_table.setRowCount(len(bids))
        for row, bid in enumerate(bids):
            for column, words in enumerate(bid_cells(bid, record.robot)):
                self.bid_table.setItem(row, column, QTableWidgetItem(words))
        for column in range(len(HEADS) - 1):  # the last has what is left, and breaks its lines
            self.bid_table.resizeColumnToContents(column)
        self.bid_table.resizeRowsToContents()

    def _ask_for_bids(self, record: TaskRecord) -> None:
        """Ask for the recorded bids whenever the task may have been auctioned."""
        if (now := (record.state, record.assignment)) != self._asked_at:
            self._asked_at = now
            self._desk.read_decisions(self._task_id)


def asked(record: TaskRecord) -> str:
    """Return the order of a task, in lines."""
    task = record.task
    payload = formats.mass(task.payload)
    lines = [f"{formats.type_name(task.type)}, priority {task.priority}, payload {payload}"]
    for number, goal in enumerate(task.goals):
        x, y, heading = formats.length(goal.x), formats.length(goal.y), formats.degrees(goal.yaw)
        lines.append(f"{goal_name(number)}: x {x}, y {y}, heading {heading}")
    return "\n".join(lines)


def stands(record: TaskRecord) -> str:
    """Return the state of a task, in lines."""
    robot, step = record.robot or "none", f"step {record.step} of {record.steps}"
    lines = [f"{record.state.name.lower()}, robot {robot}, {step}"]
    if record.parent:
        lines.append(f"Part of {record.parent}")
    if record.reason:
        lines.append(f"Reason: {record.reason}")
    return "\n".join(lines)


def times(record: TaskRecord, now: float) -> str:
    """Return when a task was posted, begun and ended; `now` is the hive's time [s]."""
    moments = {
        "Posted": record.task.posted,
        "first begun": record.started,
        "ended": record.ended,
    }
    told = [f"{what} {formats.ago(at, now)}" for what, at in moments.items() if at > 0]
    return ", ".join(told) or "When it was posted is not known"
