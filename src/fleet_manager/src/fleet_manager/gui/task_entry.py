# SPDX-License-Identifier: BSD-3-Clause
"""The window in which a person gives the hive a task."""

from __future__ import annotations

from typing import TYPE_CHECKING

from python_qt_binding.QtCore import Qt, Signal
from python_qt_binding.QtWidgets import QListWidgetItem, QWidget

from blackboard.domain.task import TaskType
from fleet_manager.client.outlook import outlook
from fleet_manager.desk.form import GOAL_NAMES, GOALS_TAKEN, FormText, check, goals_needed
from fleet_manager.desk.picking import Picking
from fleet_manager.gui.banner import Banner
from fleet_manager.gui.confirm import confirm
from fleet_manager.gui.goal_editor import GoalEditor
from fleet_manager.gui.look import ANSWER_SIGNS, color, load_form, mark_field, show_mistake

if TYPE_CHECKING:
    from collections.abc import Mapping

    from python_qt_binding.QtCore import QModelIndex
    from python_qt_binding.QtGui import QKeyEvent, QShowEvent

    from blackboard.domain.task import Task
    from fleet_manager.desk.facts import Clicked
    from fleet_manager.desk.form import Checked
    from fleet_manager.gui.desk import Desk

SENT_LINES = 4  # shown without scrolling
_OWN_FIELDS = ("id", "priority", "payload")
_TYPES = {
    TaskType.GA: "go to A",
    TaskType.GAB: "go to A, then to B",
    TaskType.GPA: "go to A and pick there",
    TaskType.GPAB: "pick at A, bring it to B",
}


class TaskEntry(QWidget):
    """The form, its checks, and what became of the tasks that were sent.

    Signals:
        picking_changed: `picking` has changed.
    """

    picking_changed = Signal()

    def __init__(self, desk: Desk) -> None:
        super().__init__()
        load_form("task_entry", self)
        self._desk = desk
        self._picking = Picking()
        self._left: set[str] = set()
        self._banner = Banner(self.authority_label, desk)
        for kind in TaskType:
            self.type_box.addItem(f"{kind.name}: {_TYPES[kind]}", kind)
        self.goal_editors = {name: GoalEditor(name) for name in GOAL_NAMES}
        for editor in self.goal_editors.values():
            self.goals.addWidget(editor)
        line = self.sent_list.fontMetrics().lineSpacing()
        self.sent_list.setFixedHeight(SENT_LINES * line + 2 * self.sent_list.frameWidth() + line)
        self._connect()
        self._order_tabs()
        self._offer_places()
        self.clear()
        self._show_sent()

    @property
    def picking(self) -> Picking:
        """Which goal the next click on the map fills."""
        return self._picking

    @property
    def kind(self) -> TaskType:
        """The chosen type."""
        return TaskType(self.type_box.currentData())

    def typed(self) -> FormText:
        """Return what the fields hold."""
        goals = tuple(editor.typed() for editor in self.goal_editors.values())
        own = (self.priority_edit.text(), self.payload_edit.text())
        return FormText(self.id_edit.text(), self.kind, *own, goals)

    def send(self) -> None:
        """Send the task if every field is right; otherwise mark the wrong ones."""
        checked = self._check()
        self._show_mistakes(checked.mistakes)
        if checked.task is None:
            self._left |= set(checked.mistakes)
            show_mistake(self.message_label, "Not sent: correct the marked fields.")
            first = self._field(next(iter(checked.mistakes)))
            first.setFocus()
            self.scroll.ensureWidgetVisible(first)
            return
        task = checked.task
        told = outlook(task, [row.status for row in self._desk.hive.robots.values()])
        if told:
            confirm(
                self,
                f"Send {task.id}?",
                [told],
                f"&Send {task.id}",
                lambda: self._post(task),
                no="&Back to the form",
            )
        else:
            self._post(task)

    def _post(self, task: Task) -> None:
        self._desk.post(task)
        self.clear()

    def clear(self) -> None:
        """Empty the form and propose a new id."""
        self._left.clear()
        self._disarm()
        for editor in self.goal_editors.values():
            editor.clear()
        self.priority_edit.setText("0")
        self.payload_edit.setText("0")
        self.id_edit.setText(self._desk.proposed_id())
        for field in _OWN_FIELDS:
            self._field(field).setModified(False)
        self._show_use()
        self._show_mistakes({})
        self.id_edit.setFocus()
        self.id_edit.selectAll()

    def show_task(self, task: Task) -> None:
        """Put a task into the form, to be corrected and sent again."""
        self.clear()
        self.id_edit.setText(task.id)
        self.id_edit.setModified(True)
        self.type_box.setCurrentIndex(self.type_box.findData(TaskType(task.type)))
        self.priority_edit.setText(str(task.priority))
        self.payload_edit.setText(f"{task.payload:.10g}")
        for editor, goal in zip(self.goal_editors.values(), task.goals, strict=False):
            editor.fill_pose(goal.x, goal.y, goal.yaw)

    def showEvent(self, event: QShowEvent) -> None:  # noqa: N802  (Qt's name)
        """Fit the form, whose font is known by now."""
        super().showEvent(event)
        self._fit()

    def keyPressEvent(self, event: QKeyEvent) -> None:  # noqa: N802  (Qt's name)
        """Enter sends, Esc clears."""
        if event.key() in {Qt.Key_Return, Qt.Key_Enter}:
            # The list handles Enter itself, and Qt passes it on all the same.
            if self.focusWidget() is not self.sent_list:
                self.send()
        elif event.key() == Qt.Key_Escape:
            self.clear()
        else:
            super().keyPressEvent(event)

    def _connect(self) -> None:
        self._desk.clicked.connect(self._take_click)
        self._desk.sent_tasks_changed.connect(self._show_sent)
        self._desk.changed.connect(self._renew_proposal)
        self._desk.places_changed.connect(self._offer_places)
        self.type_box.currentIndexChanged.connect(self._show_use)
        self.send_button.clicked.connect(self.send)
        self.clear_button.clicked.connect(self.clear)
        # Queued, so that the list still has the focus while its Enter is passed on to this form.
        self.sent_list.activated.connect(self._correct, Qt.QueuedConnection)
        for field in _OWN_FIELDS:
            edit = self._field(field)
            edit.textChanged.connect(self._recheck)
            edit.editingFinished.connect(lambda field=field: self._leave(field))
        for editor in self.goal_editors.values():
            editor.edited.connect(self._recheck)
            editor.left.connect(self._leave)
            editor.pick_asked.connect(self._ask_pick)

    def _order_tabs(self) -> None:
        """Let Tab go through the goals after the payload and before the buttons."""
        before = self.payload_edit
        for editor in self.goal_editors.values():
            for after in editor.tab_stops:
                QWidget.setTabOrder(before, after)
                before = after
        for after in (self.send_button, self.clear_button, self.sent_list):
            QWidget.setTabOrder(before, after)
            before = after

    def _correct(self, row: QModelIndex) -> None:
        """Put a task that was sent back into the form."""
        self.show_task(row.data(Qt.UserRole))

    def _offer_places(self) -> None:
        for editor in self.goal_editors.values():
            editor.offer_places(self._desk.places)
        self._fit()

    def _fit(self) -> None:
        """Make the form as wide as its fields need."""
        self.form.layout().activate()
        bar = self.scroll.verticalScrollBar().sizeHint().width()
        self.scroll.setMinimumWidth(self.form.minimumSizeHint().width() + bar)

    def _field(self, name: str) -> QWidget:
        """Return the widget of a field by its name in `Checked.mistakes`."""
        if name in _OWN_FIELDS:
            return getattr(self, f"{name}_edit")
        return self.goal_editors[name[0]].edits[name]

    def _check(self) -> Checked:
        return check(self.typed(), self._desk.taken_ids(), self._desk.bounds)

    def _leave(self, field: str) -> None:
        """Mark a field from now on where it is wrong: the person has been there."""
        edit = self._field(field)
        if edit.isModified() or edit.text():
            self._left.add(field)
            self._recheck()

    def _recheck(self) -> None:
        if self._left:
            mistakes = self._check().mistakes
            self._show_mistakes({field: mistakes[field] for field in self._left & set(mistakes)})

    def _show_mistakes(self, mistakes: Mapping[str, str]) -> None:
        for field in _OWN_FIELDS:
            edit = self._field(field)
            mark_field(edit, wrong=field in mistakes)
            show_mistake(getattr(self, f"{field}_mistake"), mistakes.get(field, ""))
        for editor in self.goal_editors.values():
            editor.show_mistakes(mistakes)
        if not mistakes:
            self.message_label.setText(self._picking.message)
            self.message_label.setVisible(bool(self._picking.message))

    def _show_use(self) -> None:
        taken, needed = GOALS_TAKEN[self.kind], goals_needed(self.kind)
        for name, editor in self.goal_editors.items():
            editor.show_use(is_taken=name in taken, is_needed=name in needed)
        if self._picking.armed and self._picking.armed not in taken:
            self._disarm()
        self._recheck()

    def _renew_proposal(self) -> None:
        """Propose another id when others have taken the proposed one."""
        if not self.id_edit.isModified() and self.id_edit.text() in self._desk.hive.tasks:
            self.id_edit.setText(self._desk.proposed_id())

    def _ask_pick(self, name: str, wanted: bool) -> None:
        if wanted:
            self._picking.arm(name)
        else:
            self._picking.disarm()
        self._show_picking()

    def _disarm(self) -> None:
        self._picking.disarm()
        self._show_picking()

    def _take_click(self, clicked: Clicked) -> None:
        filled = self._picking.take(clicked, goals_needed(self.kind))
        if filled is not None:
            self.goal_editors[filled.name].fill(filled)
        self._show_picking()

    def _show_picking(self) -> None:
        for name, editor in self.goal_editors.items():
            editor.pick_button.setChecked(name == self._picking.armed)
        self.picking_changed.emit()
        self.message_label.setText(self._picking.message)
        self.message_label.setVisible(bool(self._picking.message))

    def _show_sent(self) -> None:
        self.sent_list.clear()
        for sent in self._desk.requests.sent_tasks:
            sign, tone = ANSWER_SIGNS[sent.answer]
            item = QListWidgetItem(f"{sign} {sent}")
            item.setForeground(color(tone, self.palette()))
            item.setData(Qt.UserRole, sent.task)
            self.sent_list.addItem(item)
