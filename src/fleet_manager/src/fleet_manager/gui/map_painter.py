# SPDX-License-Identifier: BSD-3-Clause
"""Paints the map: walls, zones, places, paths, goals and robots."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, TypeVar

from python_qt_binding.QtCore import QPointF, QRectF, Qt
from python_qt_binding.QtGui import (
    QBrush,
    QColor,
    QImage,
    QPainter,
    QPalette,
    QPen,
    QPolygonF,
    QTransform,
)

from fleet_manager.desk.chart import Labels, level_for, robot_radius
from fleet_manager.gui.look import Tone, color, is_dark
from hive_common.grid_map import FREE, OCCUPIED
from hive_common.palette import robot_color

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator, Mapping

    from fleet_manager.desk.chart import Chart, GoalGroup, RobotMark, View
    from fleet_manager.desk.facts import MapKnown, PlannedPath
    from fleet_manager.desk.places import Place
    from hive_common.palette import Color
    from hive_common.pose import Pose
    from hive_common.zone import Zone

Spot = tuple[float, float]  # column and row [pixel]
Mark = TypeVar("Mark", "RobotMark", "Place")

PATH_WIDTH, EDGE = 2.5, 1.2  # of lines [pixel]
ARROW = 17.0  # length of a goal's arrow [pixel]
PLACE = 3.5  # half the side of a place's square [pixel]
CROWD = 250  # groups of goals; more are dots without names, until a person zooms in
CROWDED_PLACES = 120  # places in view; more have no names
_COLORS = 256  # of an image with a palette; cells are taken as bytes

_CLOSED = "#d03030"  # of closed zones, as in RViz
_GROUND = {False: ("#ffffff", "#3c4043", "#cfd3d6"), True: ("#2b2d30", "#b9bec4", "#17181a")}
"""Free, occupied and unknown, on light and on dark desktops."""


class MapPainter:
    """Keeps what is costly to make, such as the image of the map, and paints with it."""

    def __init__(self) -> None:
        self._map: MapKnown | None = None
        self._dark = False
        self._images: list[QImage] = []
        self._lines: dict[str, tuple[PlannedPath, QPolygonF]] = {}

    def take_map(self, known: MapKnown | None, palette: QPalette) -> None:
        """Take in the map, for the desktop's colours; nothing is copied."""
        dark = is_dark(palette)
        if known is self._map and dark == self._dark:
            return
        self._map, self._dark = known, dark
        table = _color_table(dark)
        self._images = []
        for level in known.levels if known else ():
            rows, columns = level.cells.shape
            image = QImage(level.cells.data, columns, rows, columns, QImage.Format_Indexed8)
            image.setColorTable(table)
            self._images.append(image)

    def take_paths(self, paths: Iterable[PlannedPath]) -> None:
        """Take in the planned paths of all robots."""
        kept = self._lines
        self._lines = {}
        for path in paths:
            known = kept.get(path.robot)
            if known is None or known[0] is not path:
                known = path, QPolygonF([QPointF(x, y) for x, y in path.points])
            self._lines[path.robot] = known

    def paint_map(self, painter: QPainter, view: View) -> None:
        """Paint the ground: free, occupied and unknown."""
        painter.fillRect(QRectF(0, 0, view.width, view.height), QColor(_GROUND[self._dark][2]))
        if self._map is None:
            return
        number = level_for(self._map.levels, view.scale)
        level, image = self._map.levels[number], self._images[number]
        side, origin = level.resolution, level.origin
        rows, columns = level.cells.shape
        left, top = view.point(0, 0)
        right, bottom = view.point(view.width, view.height)
        first = max(0, math.floor((left - origin.x) / side))
        last = min(columns, math.ceil((right - origin.x) / side))
        low = max(0, math.floor((bottom - origin.y) / side))
        high = min(rows, math.ceil((top - origin.y) / side))
        if first >= last or low >= high:
            return
        painter.save()
        painter.setTransform(_transform(view))
        painter.drawImage(
            QRectF(
                origin.x + first * side,
                origin.y + low * side,
                (last - first) * side,
                (high - low) * side,
            ),
            image,
            QRectF(first, low, last - first, high - low),
        )
        painter.restore()

    def paint_paths(self, painter: QPainter, view: View, chart: Chart) -> None:
        """Paint the paths that robots are about to drive."""
        painter.save()
        painter.setTransform(_transform(view))
        edge = painter.pen().color()
        for robot, (path, line) in self._lines.items():
            if len(path.points) > 1 and robot in chart.robots:
                for shade, width in (
                    (edge, PATH_WIDTH + EDGE),
                    (_shade(robot_color(robot)), PATH_WIDTH),
                ):
                    pen = QPen(shade, width, Qt.SolidLine, Qt.RoundCap, Qt.RoundJoin)
                    pen.setCosmetic(True)
                    painter.setPen(pen)
                    painter.drawPolyline(line)
        painter.restore()


@dataclass(frozen=True, slots=True)
class Scene:
    """What is painted on the map."""

    chart: Chart
    places: tuple[Place, ...]
    zones: tuple[Zone, ...]
    closed: frozenset[str]  # names of the zones that are
    typed: Mapping[str, Pose]  # goals in the form, by letter [map frame]


def paint_zones(painter: QPainter, view: View, scene: Scene, palette: QPalette) -> None:
    """Paint the zones; closed ones are red and hatched."""
    for zone in scene.zones:
        is_closed = zone.name in scene.closed
        shade = QColor(_CLOSED) if is_closed else color(Tone.CALM, palette)
        corners = QPolygonF([QPointF(*view.pixel(x, y)) for x, y in zone.corners])
        painter.setPen(QPen(shade, 1.5, Qt.SolidLine if is_closed else Qt.DashLine))
        shade.setAlpha(60 if is_closed else 18)
        painter.setBrush(shade)
        painter.drawPolygon(corners)
        if is_closed:
            shade.setAlpha(150)
            painter.setBrush(QBrush(shade, Qt.BDiagPattern))
            painter.drawPolygon(corners)


def paint_marks(painter: QPainter, view: View, scene: Scene, palette: QPalette) -> None:
    """Paint places, goals and robots, then names in the order of who needs them most."""
    radius = robot_radius(view)
    robots = _seen(view, scene.chart.robots.values(), radius)
    places = _seen(view, scene.places)
    groups = scene.chart.goal_groups(view)
    is_crowd = len(groups) > CROWD
    for _, here in places:
        _paint_place(painter, here, palette)
    if is_crowd:
        _paint_crowd(painter, groups)
    else:
        for goal in (goal for group in groups for goal in reversed(group.goals)):
            _paint_goal(painter, view, goal.pose, _shade(goal.color), palette)
    for mark, here in robots:
        _paint_robot(painter, mark, here, radius, palette)
    for pose in scene.typed.values():
        _paint_goal(painter, view, pose, palette.color(QPalette.Highlight), palette, 1.5)
    labels = _LabelPainter(painter, view.width, palette)
    for letter, pose in scene.typed.items():
        labels.write(letter, view.pixel(pose.x, pose.y), ARROW, bold=True)
    for mark, here in robots:
        labels.write(mark.name, here, radius + 1, bold=True)
    for group in () if is_crowd else groups:
        labels.write(group.label, (group.column, group.row), ARROW * 0.7)
    for words, here, away in (*_place_names(places), *_zone_names(view, scene.zones)):
        labels.write(words, here, away, quiet=True)


def paint_arrow(
    painter: QPainter, start: tuple[float, float], end: tuple[float, float], palette: QPalette
) -> None:
    """Paint the heading that a person drags."""
    painter.setPen(QPen(palette.color(QPalette.Highlight), 3, Qt.SolidLine, Qt.RoundCap))
    painter.drawLine(QPointF(*start), QPointF(*end))
    length = math.dist(start, end)
    if length > 0:
        yaw = math.atan2(start[1] - end[1], end[0] - start[0])
        painter.setBrush(palette.color(QPalette.Highlight))
        painter.drawPolygon(_turned(end, yaw, ((4, 0), (-8, 6), (-8, -6))))


def _transform(view: View) -> QTransform:
    """Return the transform from metres to pixels."""
    column, row = view.pixel(0.0, 0.0)
    return QTransform(view.scale, 0, 0, -view.scale, column, row)


def _color_table(dark: bool) -> list[int]:
    """Return a colour for each value of a cell, taken as a byte: -1 is 255."""
    free, occupied, unknown = (QColor(name) for name in _GROUND[dark])
    table = [unknown.rgb()] * _COLORS
    for value in range(FREE, _COLORS // 2):
        share = min(value, OCCUPIED) / OCCUPIED
        parts = zip(free.getRgb()[:3], occupied.getRgb()[:3], strict=True)
        table[value] = QColor(*(round(a + (b - a) * share) for a, b in parts)).rgb()
    return table


def _shade(given: Color) -> QColor:
    return QColor.fromRgbF(*given)


def _turned(
    middle: tuple[float, float], yaw: float, corners: Iterable[tuple[float, float]]
) -> QPolygonF:
    """Return corners [pixel ahead, pixel to the left], turned by a heading around a place."""
    ahead, left = math.cos(yaw), math.sin(yaw)
    return QPolygonF(
        [
            QPointF(middle[0] + x * ahead - y * left, middle[1] - x * left - y * ahead)
            for x, y in corners
        ]
    )


def _seen(view: View, marks: Iterable[Mark], margin: float = 0.0) -> list[tuple[Mark, Spot]]:
    """Return the marks that a view shows, each with where it is seen [pixel]."""
    spots = ((mark, view.pixel(mark.pose.x, mark.pose.y)) for mark in marks)
    return [(mark, here) for mark, here in spots if view.shows(*here, margin)]


def _place_names(places: list[tuple[Place, Spot]]) -> list[tuple[str, Spot, float]]:
    """Return the name of each place, where it is and its radius [pixel]; none where many are."""
    if len(places) > CROWDED_PLACES:
        return []
    return [(place.name, here, PLACE + 1) for place, here in places]


def _zone_names(view: View, zones: Iterable[Zone]) -> Iterator[tuple[str, Spot, float]]:
    """Give the name of each zone, and where its middle is."""
    for zone in zones:
        x, y = (sum(each) / len(zone.corners) for each in zip(*zone.corners, strict=True))
        yield zone.name, view.pixel(x, y), 0.0


def _paint_place(painter: QPainter, here: Spot, palette: QPalette) -> None:
    painter.setPen(QPen(palette.color(QPalette.Text), EDGE))
    painter.setBrush(color(Tone.QUIET, palette))
    painter.drawRect(QRectF(here[0] - PLACE, here[1] - PLACE, 2 * PLACE, 2 * PLACE))


def _paint_goal(
    painter: QPainter,
    view: View,
    pose: Pose,
    shade: QColor,
    palette: QPalette,
    size: float = 1.0,
) -> None:
    """Paint an arrow that starts at a goal."""
    corners = ((-4, 2.5), (7, 2.5), (6, 7), (ARROW, 0), (6, -7), (7, -2.5), (-4, -2.5))
    painter.setPen(QPen(palette.color(QPalette.Text), EDGE))
    painter.setBrush(shade)
    turned = _turned(view.pixel(*pose[:2]), pose.yaw, [(size * x, size * y) for x, y in corners])
    painter.drawPolygon(turned)


def _paint_crowd(painter: QPainter, groups: Iterable[GoalGroup]) -> None:
    """Paint many goals as dots, those of a colour at once."""
    dots: dict[Color, list[QPointF]] = {}
    for group in groups:
        dots.setdefault(group.goals[0].color, []).append(QPointF(group.column, group.row))
    for shade, points in dots.items():
        painter.setPen(QPen(_shade(shade), 6, Qt.SolidLine, Qt.RoundCap))
        painter.drawPoints(QPolygonF(points))


def _paint_robot(
    painter: QPainter,
    mark: RobotMark,
    here: tuple[float, float],
    radius: float,
    palette: QPalette,
) -> None:
    """Paint a disc with a wedge ahead; one that is out is crossed."""
    edge = QColor("#000000")
    painter.setPen(QPen(edge, 1.5))
    painter.setBrush(_shade(mark.color))
    painter.drawEllipse(QPointF(*here), radius, radius)
    wedge = ((0.85, 0.0), (-0.35, 0.5), (-0.1, 0.0), (-0.35, -0.5))
    painter.setPen(Qt.NoPen)
    painter.setBrush(edge)
    painter.drawPolygon(_turned(here, mark.pose.yaw, [(x * radius, y * radius) for x, y in wedge]))
    if mark.is_out:
        painter.setPen(QPen(color(Tone.BAD, palette), 3))
        reach = radius * 0.9
        for side in (-reach, reach):
            painter.drawLine(
                QPointF(here[0] - reach, here[1] - side), QPointF(here[0] + reach, here[1] + side)
            )


class _LabelPainter:
    """Writes names beside marks, where no other name is."""

    def __init__(self, painter: QPainter, width: int, palette: QPalette) -> None:
        self._painter, self._palette = painter, palette
        self._labels = Labels(width)
        self._ground = QColor(palette.color(QPalette.Base))
        self._ground.setAlpha(200)

    def write(
        self,
        words: str,
        here: Spot,
        away: float,
        *,
        bold: bool = False,
        quiet: bool = False,
    ) -> None:
        """Write a name beside a mark of a radius [pixel]; nothing where there is no room."""
        painter = self._painter
        font = painter.font()
        font.setBold(bold)
        painter.setFont(font)
        metrics = painter.fontMetrics()
        size = (metrics.horizontalAdvance(words) + 6.0, float(metrics.height()))
        corner = self._labels.place(*here, away, size)
        if corner is None:
            return
        box = QRectF(*corner, *size)
        painter.setPen(Qt.NoPen)
        painter.setBrush(self._ground)
        painter.drawRoundedRect(box, 3, 3)
        tone = color(Tone.QUIET, self._palette) if quiet else self._palette.color(QPalette.Text)
        painter.setPen(tone)
        painter.drawText(box, int(Qt.AlignCenter), words)
