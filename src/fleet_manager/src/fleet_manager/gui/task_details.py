# SPDX-License-Identifier: BSD-3-Clause
"""The window with all there is to know about one task."""

from __future__ import annotations

from typing import TYPE_CHECKING

from python_qt_binding.QtCore import Qt
from python_qt_binding.QtWidgets import QDialog, QTableWidgetItem

from blackboard.domain.task import goal_name
from fleet_manager.desk import formats
from fleet_manager.desk.bid_words import HEADS, bid_cells, story
from fleet_manager.desk.words import text
from fleet_manager.gui.forms import load_form
from fleet_manager.gui.task_table import type_name

if TYPE_CHECKING:
    from blackboard.domain.record import TaskRecord
    from fleet_manager.desk.rows import Changes
    from fleet_manager.gui.desk import Desk


class TaskDetails(QDialog):
    """Goals, state and bids of one task, kept up to date while it is open.

    Args:
        desk: Knows the task.
        task_id: Which.
        parent: The window it belongs to.
    """

    def __init__(self, desk: Desk, task_id: str, parent: object = None) -> None:
        super().__init__(parent)
        load_form("task_details", self)
        self.setAttribute(Qt.WA_DeleteOnClose)
        self.setWindowTitle(text("details.title", id=task_id))
        self._desk, self._task_id = desk, task_id
        self._asked_at: tuple[object, ...] = ()
        self.bid_table.setColumnCount(len(HEADS))
        self.bid_table.setHorizontalHeaderLabels([text(head) for head in HEADS])
        self.bid_table.horizontalHeader().setStretchLastSection(True)
        self.bid_table.verticalHeader().hide()
        self.bid_table.setEditTriggers(self.bid_table.NoEditTriggers)
        self.close_button.clicked.connect(self.close)
        desk.changed.connect(self._follow)
        self._show()
        width = self.fontMetrics().averageCharWidth()
        self.resize(110 * width, 34 * self.fontMetrics().lineSpacing())

    def _follow(self, changes: Changes) -> None:
        if self._task_id in changes.tasks:
            self._show()

    def _show(self) -> None:
        record = self._desk.hive.record(self._task_id)
        if record is None:
            return
        self._ask_why(record)
        self.asked_label.setText(asked(record))
        self.stands_label.setText(stands(record))
        bids = self._desk.hive.bids(self._task_id)
        why = story(record, bids, self._desk.hive.auctions(self._task_id))
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

    def _ask_why(self, record: TaskRecord) -> None:
        """Ask for the bids once for every time that the task may have been auctioned."""
        if (now := (record.state, record.assignment)) != self._asked_at:
            self._asked_at = now
            self._desk.ask_why(self._task_id)


def asked(record: TaskRecord) -> str:
    """Return what was asked for, in lines."""
    task = record.task
    words = {"type": type_name(task.type), "priority": task.priority}
    lines = [text("details.asked", **words, payload=formats.mass(task.payload))]
    for number, goal in enumerate(task.goals):
        where = {"x": formats.length(goal.x), "y": formats.length(goal.y)}
        heading = formats.degrees(goal.yaw)
        lines.append(text("details.goal", name=goal_name(number), **where, heading=heading))
    return "\n".join(lines)


def stands(record: TaskRecord) -> str:
    """Return where the task stands, in lines."""
    robot = record.robot or text("details.nobody")
    state = text(f"task.{record.state.name}")
    steps = {"step": record.step, "steps": record.steps}
    lines = [text("details.stands", state=state, robot=robot, **steps)]
    if record.parent:
        lines.append(text("details.part", parent=record.parent))
    if record.reason:
        lines.append(text("details.reason", reason=record.reason))
    return "\n".join(lines)
