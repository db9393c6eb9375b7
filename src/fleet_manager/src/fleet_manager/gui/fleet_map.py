# SPDX-License-Identifier: BSD-3-Clause
"""The map in the window: where robots are and drive, and the goals of tasks.

Clicks go to the desk as those of RViz do, so `desk.picking` alone decides what they fill.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from python_qt_binding.QtCore import QEvent, QPointF, QRectF, Qt, QTimer, Signal
from python_qt_binding.QtGui import QPainter, QPalette
from python_qt_binding.QtWidgets import (
    QHBoxLayout,
    QLabel,
    QPushButton,
    QToolTip,
    QVBoxLayout,
    QWidget,
)

from fleet_manager.desk.chart import Chart, RobotMark, View, closed_zones, heading
from fleet_manager.desk.facts import Clicked
from fleet_manager.gui.map_painter import (
    MapPainter,
    Scene,
    paint_arrow,
    paint_marks,
    paint_zones,
)
from hive_common.pose import Pose

if TYPE_CHECKING:
    from python_qt_binding.QtGui import (
        QHideEvent,
        QMouseEvent,
        QPaintEvent,
        QResizeEvent,
        QShowEvent,
        QWheelEvent,
    )

    from fleet_manager.client.rows import Changes
    from fleet_manager.desk.facts import MapBounds
    from fleet_manager.desk.picking import Picking
    from fleet_manager.gui.desk import Desk

REPAINT_PERIOD = 100  # [ms], at most that often for what the hive says
DRAG = 6  # a mouse that moves less has clicked [pixel]
ZOOM = 1.2  # of one notch of the wheel
_NOTCH = 120  # of the wheel, in Qt's eighths of a degree
FRAME = "map"


class FleetMap(QWidget):
    """The map, where the mouse points, and a button that shows all of it.

    Signals:
        robot_chosen: The name of a robot that was clicked.
        task_chosen: The id of a task of which a goal was clicked.

    Args:
        desk: What is known of the hive.
        picking: Which goal the next click fills.
    """

    robot_chosen = Signal(str)
    task_chosen = Signal(str)

    def __init__(self, desk: Desk, picking: Picking) -> None:
        super().__init__()
        self.setWindowTitle("Map")
        self.canvas = MapCanvas(desk, picking)
        self.position_label = QLabel()
        self.fit_button = QPushButton("&Whole map", toolTip="Show the whole map (double click).")
        row = QHBoxLayout()
        row.addWidget(self.position_label, 1)
        row.addWidget(self.fit_button)
        column = QVBoxLayout(self)
        column.addWidget(self.canvas, 1)
        column.addLayout(row)
        self.fit_button.clicked.connect(self.canvas.fit)
        self.canvas.pointed.connect(self.position_label.setText)
        self.canvas.robot_chosen.connect(self.robot_chosen)
        self.canvas.task_chosen.connect(self.task_chosen)

    def show_picking(self) -> None:
        """Show with the cursor whether a click fills a goal."""
        self.canvas.show_picking()

    def show_typed(self, goals: dict[str, Pose]) -> None:
        """Show the goals in the form, by letter [map frame]."""
        self.canvas.show_typed(goals)


class MapCanvas(QWidget):
    """The painted map, and the mouse on it.

    What the hive says is painted at most every `REPAINT_PERIOD`, and only while it can be seen.

    Signals:
        pointed: Where the mouse points, in words.
        robot_chosen: The name of a robot that was clicked.
        task_chosen: The id of a task of which a goal was clicked.
    """

    pointed = Signal(str)
    robot_chosen = Signal(str)
    task_chosen = Signal(str)

    def __init__(self, desk: Desk, picking: Picking) -> None:
        super().__init__()
        self._desk, self._picking = desk, picking
        self.chart = Chart()
        self.view: View | None = None  # None while there is nothing to be seen
        self.paints = 0  # how often it was painted
        self._painter = MapPainter()
        self._is_whole = True  # until a person zooms or moves
        self._shown_bounds: MapBounds | None = None
        self._tasks: set[str] = set(desk.hive.tasks)  # that may have changed
        self._pressed: tuple[float, float] | None = None  # [pixel]
        self._at = (0.0, 0.0)  # where the mouse was last [pixel]
        self._drag = ""  # "move" the map or set a "heading"; empty before the mouse has moved
        self._has_picked = False  # whether the last click was for a goal
        self._closed: frozenset[str] = frozenset()  # names of the zones that are
        self._timer = QTimer(self, interval=REPAINT_PERIOD, singleShot=True, timeout=self._renew)
        self._map_differs = True
        self._typed: dict[str, Pose] = {}  # goals in the form, by letter
        self.setMouseTracking(True)
        self.setMinimumSize(160, 120)
        self.setAccessibleName("Map")
        desk.changed.connect(self._take)
        desk.map_changed.connect(self._take_map)
        desk.places_changed.connect(self._take_map)

    def fit(self) -> None:
        """Show the whole map."""
        self._is_whole = True
        self._fit()
        self.update()

    def show_picking(self) -> None:
        """Show with the cursor whether a click fills a goal."""
        self.setCursor(Qt.CrossCursor if self._picking.armed else Qt.ArrowCursor)

    def show_typed(self, goals: dict[str, Pose]) -> None:
        """Show the goals in the form, by letter [map frame]."""
        if goals != self._typed:
            self._typed = goals
            self.update()

    # What the hive says

    def _take(self, changes: Changes) -> None:
        self._tasks |= changes.tasks
        self._schedule()

    def _take_map(self) -> None:
        self._map_differs = True
        self._schedule()

    def _schedule(self) -> None:
        if self.isVisible() and not self._timer.isActive():
            self._timer.start()

    def _renew(self) -> None:
        """Take in what has changed, and repaint if it shows."""
        hive, desk = self._desk.hive, self._desk
        names, self._tasks = self._tasks, set()
        differs, self._map_differs = self._map_differs, False
        differs |= self.chart.take_tasks(names, hive.tasks)
        differs |= self.chart.take_robots(hive.robots, desk.poses)
        closed = closed_zones(desk.zones, hive.traffic)
        differs |= closed != self._closed
        self._closed = closed
        if differs:
            self._painter.take_map(desk.map, self.palette())
            self._painter.take_paths(desk.paths.values())
            self._fit()
            self.update()

    def _fit(self) -> None:
        """Show the whole map, unless a person has chosen a part of the same map."""
        bounds = self._desk.bounds
        is_other = bounds is not None and bounds != self._shown_bounds
        seen = bounds or (self.chart.bounds() if self.view is None or self._is_whole else None)
        if seen and (is_other or self._is_whole or self.view is None):
            self._is_whole, self._shown_bounds = True, bounds
            self.view = View.fitting(seen, self.width(), self.height())

    # What Qt asks for

    def paintEvent(self, _event: QPaintEvent) -> None:  # noqa: N802  (Qt's name)
        """Paint everything."""
        self.paints += 1
        painter, palette, view = QPainter(self), self.palette(), self.view
        if view is None:
            painter.setPen(palette.color(QPalette.WindowText))
            words = "No map is known yet: no node publishes on the topic map."
            box = QRectF(self.rect()).adjusted(8, 8, -8, -8)
            painter.drawText(box, int(Qt.AlignCenter | Qt.TextWordWrap), words)
            return
        self._painter.paint_map(painter, view)
        painter.setRenderHint(QPainter.Antialiasing)
        desk = self._desk
        scene = Scene(self.chart, desk.places, desk.zones, self._closed, self._typed)
        paint_zones(painter, view, scene, palette)
        painter.setPen(palette.color(QPalette.Text))
        self._painter.paint_paths(painter, view, self.chart)
        paint_marks(painter, view, scene, palette)
        if self._drag == "heading" and self._pressed:
            paint_arrow(painter, self._pressed, self._at, palette)

    def event(self, event: QEvent) -> bool:
        """Tell what is under the mouse; all other events are Qt's."""
        if event.type() == QEvent.ToolTip and self.view:
            mark = self.chart.mark_at(self.view, event.pos().x(), event.pos().y())
            if mark:
                QToolTip.showText(event.globalPos(), mark.words, self)
            else:
                QToolTip.hideText()
            return True
        if event.type() == QEvent.PaletteChange:
            self._take_map()
        return bool(super().event(event))

    def showEvent(self, event: QShowEvent) -> None:  # noqa: N802  (Qt's name)
        """Take in what has changed while nobody looked."""
        super().showEvent(event)
        self._map_differs = True
        self._renew()

    def hideEvent(self, event: QHideEvent) -> None:  # noqa: N802  (Qt's name)
        """Stop following."""
        self._timer.stop()
        super().hideEvent(event)

    def resizeEvent(self, event: QResizeEvent) -> None:  # noqa: N802  (Qt's name)
        """Keep what is shown in the middle."""
        super().resizeEvent(event)
        if self.view:
            self.view = self.view.resized(self.width(), self.height())
        self._fit()

    def wheelEvent(self, event: QWheelEvent) -> None:  # noqa: N802  (Qt's name)
        """Zoom around where the mouse is."""
        if self.view:
            factor = ZOOM ** (event.angleDelta().y() / _NOTCH)
            self._is_whole = False
            self.view = self.view.zoomed(factor, *_place(event.position()))
            self.update()

    def mousePressEvent(self, event: QMouseEvent) -> None:  # noqa: N802  (Qt's name)
        """Begin a click or a drag."""
        if event.button() == Qt.LeftButton and self.view:
            self._pressed = self._at = _place(event.localPos())
            self._drag = ""

    def mouseMoveEvent(self, event: QMouseEvent) -> None:  # noqa: N802  (Qt's name)
        """Move the map or turn the arrow, and tell where the mouse is."""
        if self.view is None:
            return
        here = _place(event.localPos())
        x, y = self.view.point(*here)
        self.pointed.emit(f"x {x:.2f} m, y {y:.2f} m")
        self._drag_to(here)

    def _drag_to(self, here: tuple[float, float]) -> None:
        """Move the map or turn the arrow, if a button is held and the mouse was moved enough."""
        if self._pressed is None or self.view is None:
            return
        if not self._drag and math.dist(self._pressed, here) > DRAG:
            is_goal = self._picking.wants_drag(Pose(*self.view.point(*self._pressed)))
            self._drag = "heading" if is_goal else "move"
        if self._drag == "move":
            self._is_whole = False
            self.view = self.view.moved(here[0] - self._at[0], here[1] - self._at[1])
        if self._drag:
            self._at = here
            self.update()

    def mouseReleaseEvent(self, event: QMouseEvent) -> None:  # noqa: N802  (Qt's name)
        """Fill a goal, or choose what was clicked."""
        if event.button() != Qt.LeftButton or self._pressed is None or self.view is None:
            return
        self._drag_to(_place(event.localPos()))
        start, drag = self._pressed, self._drag
        self._pressed, self._drag = None, ""
        self._has_picked = drag == "heading" or (not drag and bool(self._picking.armed))
        if self._has_picked:
            is_drag = drag == "heading"
            yaw = heading(start, self._at) if is_drag else 0.0
            pose = Pose(*self.view.point(*start), yaw)
            self._desk.clicked.emit(Clicked(pose, FRAME, has_heading=is_drag))
        elif not drag:
            self._choose(*start)
        self.update()

    def mouseDoubleClickEvent(self, event: QMouseEvent) -> None:  # noqa: N802  (Qt's name)
        """Show the whole map; the second click on a goal that was picked does nothing."""
        if event.button() == Qt.LeftButton and not self._has_picked:
            self.fit()

    def leaveEvent(self, event: QEvent) -> None:  # noqa: N802  (Qt's name)
        """Tell no position while the mouse is elsewhere."""
        self.pointed.emit("")
        super().leaveEvent(event)

    def _choose(self, column: float, row: float) -> None:
        assert self.view  # noqa: S101  (there was one when the mouse was pressed)
        mark = self.chart.mark_at(self.view, column, row)
        if isinstance(mark, RobotMark):
            self.robot_chosen.emit(mark.name)
        elif mark is not None:
            self.task_chosen.emit(mark.task_id)


def _place(point: QPointF) -> tuple[float, float]:
    return point.x(), point.y()
