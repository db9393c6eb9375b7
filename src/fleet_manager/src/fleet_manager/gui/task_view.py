# SPDX-License-Identifier: BSD-3-Clause
"""The window in which a person follows tasks and robots."""

from __future__ import annotations

from typing import TYPE_CHECKING

from python_qt_binding.QtCore import QSortFilterProxyModel, Qt, QTimer
from python_qt_binding.QtGui import QKeySequence
from python_qt_binding.QtWidgets import QAbstractItemView, QInputDialog, QShortcut, QWidget

from blackboard.auction.splitting import unfinished_parts
from fleet_manager.client import consequences
from fleet_manager.client.formats import counted
from fleet_manager.gui.banner import Banner, NeedsLine
from fleet_manager.gui.columns import (
    CHOICES,
    OPEN,
    PRIORITY_COLUMN,
    TaskFilter,
    robot_columns,
    task_columns,
)
from fleet_manager.gui.confirm import confirm
from fleet_manager.gui.log_model import LogModel
from fleet_manager.gui.look import load_form
from fleet_manager.gui.rows_model import SORT_ROLE, BarDelegate, RowsModel
from fleet_manager.gui.task_details import TaskDetails

if TYPE_CHECKING:
    from python_qt_binding.QtCore import QAbstractItemModel, QSettings
    from python_qt_binding.QtWidgets import QTableView

    from fleet_manager.client.rows import Changes
    from fleet_manager.gui.desk import Desk

CLOCK_PERIOD = 1000  # [ms], for ages and times of arrival


class TaskView(QWidget):
    """Tasks, robots, the log, who is the leader, and what needs a person."""

    def __init__(self, desk: Desk) -> None:
        super().__init__()
        load_form("task_view", self)
        self._desk = desk
        self._banner = Banner(self.authority_label, desk)
        self._needs = NeedsLine(self.needs_label, desk)
        self.task_rows = RowsModel(task_columns(desk.now, lambda: desk.hive.robots))
        self.shown_tasks = TaskFilter(self.task_rows)
        self.robot_rows = RowsModel(robot_columns(lambda: desk.places))
        self.shown_robots = _sorted(self.robot_rows)
        self.log = LogModel()
        for states, words in CHOICES.items():
            self.show_box.addItem(words, states)
        self.shown_tasks.choose(OPEN)
        _set_up(self.task_table, self.shown_tasks, self.task_rows)
        _set_up(self.robot_table, self.shown_robots, self.robot_rows)
        # The most urgent first, among equals the oldest.
        self.task_table.sortByColumn(PRIORITY_COLUMN, Qt.DescendingOrder)
        self.log_list.setModel(self.log)
        self.log_list.setUniformItemSizes(True)
        self._share_space()
        self._connect()
        self._load_all()
        self._clock = QTimer(self, interval=CLOCK_PERIOD, timeout=self._pass_time)
        self._clock.start()

    def _pass_time(self) -> None:
        """Show anew what depends on time alone."""
        self.task_table.viewport().update()
        self._needs.refresh()

    def chosen_tasks(self) -> list[str]:
        """Return the ids of the selected tasks."""
        return self.shown_tasks.names(self.task_table.selectionModel().selectedRows())

    def chosen_robots(self) -> list[str]:
        """Return the names of the selected robots."""
        rows = self.robot_table.selectionModel().selectedRows()
        return [self.robot_rows.name_at(self.shown_robots.mapToSource(row).row()) for row in rows]

    def select_robot(self, name: str) -> None:
        """Select the row of a robot."""
        _select(self.robot_table, self.shown_robots, self.robot_rows, name)

    def select_task(self, task_id: str) -> None:
        """Select the row of a task, if it is shown."""
        _select(self.task_table, self.shown_tasks, self.task_rows, task_id)

    def save(self, settings: QSettings) -> None:
        """Keep the layout and choices."""
        settings.setValue("view/upper", self.upper.saveState())
        settings.setValue("view/lower", self.lower.saveState())
        settings.setValue("view/tasks", self.task_table.horizontalHeader().saveState())
        settings.setValue("view/robots", self.robot_table.horizontalHeader().saveState())
        settings.setValue("view/states", self.show_box.currentText())

    def restore(self, settings: QSettings) -> None:
        """Restore the kept layout and choices, where there are any."""
        for key, part in (
            ("view/upper", self.upper),
            ("view/lower", self.lower),
            ("view/tasks", self.task_table.horizontalHeader()),
            ("view/robots", self.robot_table.horizontalHeader()),
        ):
            if (kept := settings.value(key)) is not None:
                part.restoreState(kept)
        chosen = self.show_box.findText(settings.value("view/states", "", str))
        self.show_box.setCurrentIndex(max(0, chosen))

    def _share_space(self) -> None:
        """Give tasks more room than robots, and robots more than the log."""
        for splitter in (self.upper, self.lower):
            splitter.setStretchFactor(0, 3)
            splitter.setStretchFactor(1, 2)

    def _connect(self) -> None:
        self._desk.changed.connect(self._take)
        self.filter_edit.textChanged.connect(self._seek)
        self.show_box.currentIndexChanged.connect(self._choose)
        self.cancel_button.clicked.connect(self._cancel)
        self.again_button.clicked.connect(self._send_again)
        self.details_button.clicked.connect(self._show_details)
        self.task_table.activated.connect(self._show_details)
        self.defect_button.clicked.connect(self._take_out)
        self.service_button.clicked.connect(self._put_back)
        self.unload_button.clicked.connect(self._unload)
        self.task_table.selectionModel().selectionChanged.connect(self._show_buttons)
        self.robot_table.selectionModel().selectionChanged.connect(self._show_buttons)
        delete = QShortcut(QKeySequence(Qt.Key_Delete), self.task_table, activated=self._cancel)
        delete.setContext(Qt.WidgetShortcut)

    def _load_all(self) -> None:
        """Show what was known before this window was opened."""
        hive = self._desk.hive
        self.task_rows.apply(list(hive.tasks), hive.tasks)
        self.robot_rows.apply(list(hive.robots), hive.robots)
        self._show_count()
        self._show_buttons()

    def _take(self, changes: Changes) -> None:
        hive = self._desk.hive
        self.task_rows.apply(changes.tasks, hive.tasks)
        self.robot_rows.apply(changes.robots, hive.robots)
        self.log.append(changes.events)
        if changes.tasks:
            self._show_count()
        if changes.tasks or changes.robots:
            self._show_buttons()

    def _seek(self, sought: str) -> None:
        self.shown_tasks.seek(sought)
        self._show_count()

    def _choose(self) -> None:
        self.shown_tasks.choose(self.show_box.currentData())
        self._show_count()

    def _show_count(self) -> None:
        shown, total = self.shown_tasks.rowCount(), self.task_rows.rowCount()
        self.count_label.setText(f"{shown} of {counted(total, 'task')}")

    def _show_buttons(self) -> None:
        """Enable only the buttons that would do something."""
        tasks, robots = self.chosen_tasks(), self.chosen_robots()
        rows = self._desk.hive.tasks
        self.cancel_button.setEnabled(any(rows[name].is_open for name in tasks if name in rows))
        self.again_button.setEnabled(bool(tasks))
        self.details_button.setEnabled(len(tasks) == 1)
        self.defect_button.setEnabled(bool(robots))
        self.service_button.setEnabled(bool(robots))
        known = [self._desk.hive.robots[name] for name in robots if name in self._desk.hive.robots]
        self.unload_button.setEnabled(
            len(known) == 1 and bool(self._desk.places) and known[0].has_load_left
        )

    def _cancel(self) -> None:
        hive = self._desk.hive
        names = [name for name in self.chosen_tasks() if hive.tasks[name].is_open]
        if not names:
            return
        records = [hive.tasks[name].record for name in names]
        parts = [part for each in records for part in unfinished_parts(each, hive.records)]
        listed = ", ".join(names)
        confirm(
            self,
            f"Cancel {listed}?",
            consequences.of_cancelling([*records, *parts]),
            f"&Cancel {listed}" if len(names) == 1 else f"&Cancel {counted(len(names), 'task')}",
            lambda: self._desk.cancel(names),
        )

    def _send_again(self) -> None:
        self._desk.send_again(self.chosen_tasks())

    def _show_details(self) -> None:
        for name in self.chosen_tasks()[:1]:
            TaskDetails(self._desk, name, self).show()

    def _take_out(self) -> None:
        hive, names = self._desk.hive, self.chosen_robots()
        records = list(hive.records.values())
        told = [consequences.of_taking_out(hive.robots[name], records) for name in names]
        confirm(
            self,
            f"Take {', '.join(names)} out of service?",
            [line for lines in told for line in lines],
            "&Take out of service",
            lambda: self._desk.put_in_service(names, into=False),
        )

    def _unload(self) -> None:
        """Ask for a place, and send the chosen robot there with the load that was left on it."""
        (robot,) = self.chosen_robots()
        places = {place.name: place.pose for place in self._desk.places}
        box = QInputDialog(self)
        box.setAttribute(Qt.WA_DeleteOnClose)
        box.setWindowTitle(self.windowTitle())
        box.setLabelText(f"Where is {robot} to put its load down?")
        box.setComboBoxItems(list(places))
        box.textValueSelected.connect(lambda name: self._desk.put_down(robot, name, places[name]))
        box.open()

    def _put_back(self) -> None:
        self._desk.put_in_service(self.chosen_robots(), into=True)


def _sorted(rows: RowsModel) -> QAbstractItemModel:
    proxy = QSortFilterProxyModel()
    proxy.setSourceModel(rows)
    proxy.setSortRole(SORT_ROLE)
    return proxy


def _select(table: QTableView, shown: QAbstractItemModel, rows: RowsModel, name: str) -> None:
    number = rows.number_of(name)
    index = shown.mapFromSource(rows.index(0 if number is None else number, 0))
    if number is not None and index.isValid():
        table.selectRow(index.row())
        table.scrollTo(index)


def _set_up(table: QTableView, shown: QAbstractItemModel, rows: RowsModel) -> None:
    """Give a table its model, column widths in letters, and rows of one line."""
    table.setModel(shown)
    table.setSortingEnabled(True)
    table.sortByColumn(0, Qt.AscendingOrder)
    table.setSelectionBehavior(QAbstractItemView.SelectRows)
    table.setAlternatingRowColors(True)
    table.setShowGrid(False)
    table.setWordWrap(False)
    table.setTabKeyNavigation(False)
    letter = table.fontMetrics().horizontalAdvance("0")
    lines = table.verticalHeader()
    lines.hide()
    lines.setSectionResizeMode(lines.Fixed)
    lines.setDefaultSectionSize(round(table.fontMetrics().lineSpacing() * 1.5))
    heads = table.horizontalHeader()
    heads.setStretchLastSection(True)
    heads.setSectionsMovable(True)
    heads.setHighlightSections(False)
    for number, column in enumerate(rows.columns):
        heads.resizeSection(number, (column.letters + 2) * letter)
        if column.share:
            table.setItemDelegateForColumn(number, BarDelegate(table, column.bar_text))
