# SPDX-License-Identifier: BSD-3-Clause
"""The main window around task entry, map and task view."""

from __future__ import annotations

from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

from python_qt_binding.QtCore import Qt
from python_qt_binding.QtGui import QKeySequence
from python_qt_binding.QtWidgets import (
    QAction,
    QActionGroup,
    QApplication,
    QDockWidget,
    QMainWindow,
    QMessageBox,
)

from fleet_manager.client.formats import counted
from fleet_manager.desk.form import typed_goals
from fleet_manager.gui.benchmarks.window import Benchmarks
from fleet_manager.gui.fleet_map import FleetMap
from fleet_manager.gui.look import Appearance, appear
from fleet_manager.gui.task_entry import TaskEntry
from fleet_manager.gui.task_view import TaskView

if TYPE_CHECKING:
    from python_qt_binding.QtCore import QEvent, QSettings
    from python_qt_binding.QtGui import QCloseEvent
    from python_qt_binding.QtWidgets import QWidget

    from fleet_manager.gui.desk import Desk


_TITLES = {
    "app.name": "Robo-Hive fleet manager",
    "app.entry": "Task entry",
    "app.view": "Task view",
}
_LETTERS = (56, 50, 164)  # widths of task entry, map and task view
_LAYOUT = 1  # a layout that was kept for other docks is not restored
_LOOKS = {
    Appearance.DESKTOP: "As the &desktop",
    Appearance.LIGHT: "&Light",
    Appearance.DARK: "&Dark",
}


class FleetWindow(QMainWindow):
    """Task entry, map and task view, docked; each may be moved or torn off.

    With task entry or task view alone there is no map.
    """

    def __init__(
        self, desk: Desk, settings: QSettings, *, entry: bool = True, view: bool = True
    ) -> None:
        super().__init__()
        self._desk, self._settings = desk, settings
        self._desktop = QApplication.palette()
        self.entry = TaskEntry(desk) if entry else None
        self.view = TaskView(desk) if view else None
        self._docks: list[QDockWidget] = []
        self._benchmarks_dock: QDockWidget | None = None
        self.map: FleetMap | None = None
        if self.entry and self.view:
            self.map = FleetMap(desk, self.entry.picking)
            self._docks = [
                self._dock(self.entry, "entry"),
                self._dock(self.map, "map"),
                self._dock(self.view, "view"),
            ]
            self.entry.authority_label.hide()
            self.entry.picking_changed.connect(self._show_picking)
            self.entry.type_box.currentIndexChanged.connect(self._show_typed)
            for editor in self.entry.goal_editors.values():
                editor.edited.connect(self._show_typed)
            self.map.robot_chosen.connect(self.view.select_robot)
            self.map.task_chosen.connect(self.view.select_task)
        else:
            self.setCentralWidget(self.entry or self.view)
        name = "app.name" if self._docks else "app.entry" if entry else "app.view"
        self.setWindowTitle(_TITLES[name])
        self.setObjectName(name)
        self.setDockNestingEnabled(True)
        self._add_menus()
        self._lay_out()
        self._first_layout = self.saveState(_LAYOUT)
        self._restore()

    def event(self, event: QEvent) -> bool:
        """Handle an event of the window, such as the repaint of everything in it.

        This override makes Python hold its lock throughout: called straight from Qt, every painted
        cell would wait for the threads that read messages.
        """
        return bool(super().event(event))

    def closeEvent(self, event: QCloseEvent) -> None:  # noqa: N802  (Qt's name)
        """Keep layout and choices; ask before unsent tasks are lost."""
        count = self._desk.requests.unanswered
        if count and not self._may_lose(count):
            event.ignore()
            return
        name = self.objectName()
        self._settings.setValue(f"{name}/geometry", self.saveGeometry())
        self._settings.setValue(f"{name}/state", self.saveState(_LAYOUT))
        if self.view:
            self.view.save(self._settings)
        super().closeEvent(event)

    def show_benchmarks(self) -> Benchmarks:
        """Show the benchmarks as a tab beside the task view, and return them."""
        if self._benchmarks_dock is None:
            benchmarks = Benchmarks(Path("results").resolve(), self._settings)
            dock = self._benchmarks_dock = self._dock(benchmarks, "benchmarks")
            self.addDockWidget(Qt.RightDockWidgetArea, dock)
            self.tabifyDockWidget(self._docks[-1], dock)
        self._benchmarks_dock.show()
        self._benchmarks_dock.raise_()
        shown: Benchmarks = self._benchmarks_dock.widget()
        return shown

    def end(self) -> None:
        """End what runs in the background."""
        if self._benchmarks_dock is not None:
            self._benchmarks_dock.widget().end()

    def _may_lose(self, count: int) -> bool:
        buttons = QMessageBox.Close | QMessageBox.Cancel
        words = f"Not accepted yet: {counted(count, 'task')}. Closing the window loses them."
        answer = QMessageBox.question(self, "Not sent yet", words, buttons)
        return bool(answer == QMessageBox.Close)

    def _dock(self, widget: QWidget, name: str) -> QDockWidget:
        dock = QDockWidget(widget.windowTitle(), self)
        dock.setObjectName(name)
        dock.setWidget(widget)
        return dock

    def _lay_out(self) -> None:
        """Place the docks as at the very first start."""
        letter = self.fontMetrics().averageCharWidth()
        screen = QApplication.primaryScreen().availableGeometry()
        is_narrow = screen.width() < sum(_LETTERS) * letter
        width = 200 if self.view else 62
        if self._docks:
            width = sum(_LETTERS[::2] if is_narrow else _LETTERS)
        height = 46 * self.fontMetrics().lineSpacing()
        self.resize(min(screen.width(), width * letter), min(screen.height(), height))
        if not self._docks:
            return
        entry, chart, view = self._docks
        self.addDockWidget(Qt.LeftDockWidgetArea, entry)
        for dock in (chart, view):
            self.addDockWidget(Qt.RightDockWidgetArea, dock, Qt.Horizontal)
            dock.show()
        shares = [share * letter for share in _LETTERS]
        if is_narrow:
            self.tabifyDockWidget(chart, view)
            view.raise_()
            self.resizeDocks([entry, view], [shares[0], shares[2]], Qt.Horizontal)
        else:
            self.resizeDocks(self._docks, shares, Qt.Horizontal)

    def _add_menus(self) -> None:
        menu = self.menuBar().addMenu("&File")
        leave = menu.addAction("&Quit", self.close)
        leave.setShortcut(QKeySequence.Quit)
        self.zones_menu = self.menuBar().addMenu("Closed &zones")
        self.zones_menu.aboutToShow.connect(self._list_zones)
        menu = self.menuBar().addMenu("&View")
        for dock in self._docks:
            menu.addAction(dock.toggleViewAction())
        if self._docks:
            self.benchmarks_action = menu.addAction("&Benchmarks", self.show_benchmarks)
        menu.addAction("&Reset the layout", self._reset)
        looks = menu.addMenu("&Appearance")
        group = QActionGroup(self)
        for appearance in Appearance:
            action = QAction(_LOOKS[appearance], group, checkable=True)
            action.setData(appearance)
            looks.addAction(action)
        group.triggered.connect(lambda action: self.appear(action.data()))
        self._looks = group

    def _show_picking(self) -> None:
        """Bring the map to the front while a goal is picked, unless it was closed."""
        assert self.entry  # noqa: S101  (it has told so)
        assert self.map  # noqa: S101  (it comes with the entry)
        self.map.show_picking()
        dock = self._docks[1]
        if self.entry.picking.armed and not dock.isHidden():
            dock.raise_()

    def _show_typed(self) -> None:
        """Show on the map the goals that are in the form."""
        assert self.entry  # noqa: S101  (it has told so)
        assert self.map  # noqa: S101  (it comes with the entry)
        self.map.show_typed(typed_goals(self.entry.typed()))

    def _list_zones(self) -> None:
        """Fill the menu with the zones; the checked ones are closed."""
        self.zones_menu.clear()
        traffic = self._desk.hive.traffic
        if traffic is None or not traffic.zones:
            why = (
                "No traffic planner is heard" if traffic is None else "The fleet file has no zones"
            )
            self.zones_menu.addAction(why).setEnabled(False)
            return
        for name in traffic.zones:
            action = self.zones_menu.addAction(name.replace("&", "&&"))
            action.setCheckable(True)
            action.setChecked(name in traffic.closed)
            action.triggered.connect(partial(self._switch_zone, name))

    def _switch_zone(self, name: str, closed: bool) -> None:
        self._desk.switch_zone(name, closed=closed)

    def appear(self, appearance: Appearance) -> None:
        """Apply an appearance, now and at the next start."""
        appear(QApplication.instance(), appearance, self._desktop)
        self._settings.setValue("appearance", appearance.value)
        for action in self._looks.actions():
            action.setChecked(action.data() is appearance)
        self._desk.standing_changed.emit()
        self._desk.sent_tasks_changed.emit()

    def _reset(self) -> None:
        self.restoreState(self._first_layout, _LAYOUT)

    def _restore(self) -> None:
        name = self.objectName()
        if (geometry := self._settings.value(f"{name}/geometry")) is not None:
            self.restoreGeometry(geometry)
        if (state := self._settings.value(f"{name}/state")) is not None:
            self.restoreState(state, _LAYOUT)
        if self.view:
            self.view.restore(self._settings)
        kept = self._settings.value("appearance", Appearance.DESKTOP.value)
        known = {appearance.value: appearance for appearance in Appearance}
        self.appear(known.get(kept, Appearance.DESKTOP))
