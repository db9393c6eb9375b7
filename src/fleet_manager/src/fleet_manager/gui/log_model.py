# SPDX-License-Identifier: BSD-3-Clause
"""The log of events, newest on top."""

from __future__ import annotations

from collections import deque
from typing import TYPE_CHECKING, Any

from python_qt_binding.QtCore import QAbstractListModel, QModelIndex, Qt, QTime
from python_qt_binding.QtWidgets import QApplication

from fleet_manager.gui.look import SEVERITY_SIGNS, color
from fleet_manager.gui.rows_model import NOTHING

if TYPE_CHECKING:
    from collections.abc import Sequence

    from fleet_manager.client.words import Event

MAX_LINES = 5000


class LogModel(QAbstractListModel):
    """The last lines, each with its time of day."""

    def __init__(self) -> None:
        super().__init__()
        self._lines: deque[tuple[str, Event]] = deque()

    def rowCount(self, parent: QModelIndex = NOTHING) -> int:  # noqa: N802  (Qt's name)
        """Return the number of lines."""
        return 0 if parent.isValid() else len(self._lines)

    def data(self, index: QModelIndex, role: int = Qt.DisplayRole) -> Any:  # noqa: ANN401  (Qt's)
        """Return one aspect of a line."""
        time, event = self._lines[index.row()]
        sign, tone = SEVERITY_SIGNS[event.severity]
        if role in {Qt.DisplayRole, Qt.ToolTipRole}:
            return f"{time}  {sign}  {event.text}"
        if role == Qt.ForegroundRole:
            return color(tone, QApplication.palette()) if sign != "·" else None
        return None

    def append(self, events: Sequence[Event]) -> None:
        """Add lines on top, and drop the oldest where there are too many."""
        events = events[-MAX_LINES:]
        if not events:
            return
        time = QTime.currentTime().toString("HH:mm:ss")
        self.beginInsertRows(NOTHING, 0, len(events) - 1)
        self._lines.extendleft((time, event) for event in events)
        self.endInsertRows()
        surplus = len(self._lines) - MAX_LINES
        if surplus > 0:
            self.beginRemoveRows(NOTHING, MAX_LINES, len(self._lines) - 1)
            for _line in range(surplus):
                self._lines.pop()
            self.endRemoveRows()
