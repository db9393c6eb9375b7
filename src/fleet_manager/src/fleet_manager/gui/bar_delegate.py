# SPDX-License-Identifier: BSD-3-Clause
"""Draws a share from 0 to 1 as a bar with a text beside it."""

from __future__ import annotations

from typing import TYPE_CHECKING

from python_qt_binding.QtCore import QRectF, Qt
from python_qt_binding.QtGui import QBrush, QPalette
from python_qt_binding.QtWidgets import QStyle, QStyledItemDelegate

from fleet_manager.gui.look import Tone, color
from fleet_manager.gui.rows_model import SHARE_ROLE

if TYPE_CHECKING:
    from python_qt_binding.QtCore import QModelIndex, QObject
    from python_qt_binding.QtGui import QPainter
    from python_qt_binding.QtWidgets import QStyleOptionViewItem


class BarDelegate(QStyledItemDelegate):
    """Draws the bar on the left in the cell's colour, the text on the right.

    Args:
        table: The table of the cells.
        widest: The widest text beside a bar.
    """

    def __init__(self, table: QObject, widest: str) -> None:
        super().__init__(table)
        self._widest = widest

    def paint(self, painter: QPainter, option: QStyleOptionViewItem, index: QModelIndex) -> None:
        """Draw one cell."""
        self.initStyleOption(option, index)
        words, option.text = option.text, ""
        style = option.widget.style()
        style.drawControl(QStyle.CE_ItemViewItem, option, painter, option.widget)
        share = index.data(SHARE_ROLE)
        if share is None:
            return
        chosen = option.state & QStyle.State_Selected
        role = QPalette.HighlightedText if chosen else QPalette.Text
        margin = style.pixelMetric(QStyle.PM_FocusFrameHMargin) + 1
        cell = QRectF(option.rect).adjusted(margin, margin, -margin, -margin)
        letters = min(option.fontMetrics.horizontalAdvance(self._widest), cell.width())
        bar = QRectF(
            cell.left(), cell.top(), max(0.0, cell.width() - letters - margin), cell.height()
        )
        painter.save()
        painter.setPen(option.palette.color(role))
        painter.drawText(
            QRectF(bar.right() + margin, cell.top(), letters, cell.height()),
            int(Qt.AlignVCenter | Qt.AlignLeft),
            words,
        )
        painter.drawRect(bar)
        filled = QRectF(
            bar.left(), bar.top(), bar.width() * max(0.0, min(1.0, share)), bar.height()
        )
        painter.fillRect(filled, _filling(option, index))
        painter.restore()


def _filling(option: QStyleOptionViewItem, index: QModelIndex) -> QBrush:
    """Return the cell's own colour, or a calm one."""
    if option.state & QStyle.State_Selected:
        return QBrush(option.palette.color(QPalette.HighlightedText))
    return QBrush(index.data(Qt.ForegroundRole) or color(Tone.CALM, option.palette))
