# SPDX-License-Identifier: BSD-3-Clause
"""A table model whose rows change one at a time, and the bars in its cells.

It tells the view which rows were inserted, changed or removed: so selection and scroll position
stay, and thousands of rows cost only what has changed.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from python_qt_binding.QtCore import QAbstractTableModel, QModelIndex, QRectF, Qt
from python_qt_binding.QtGui import QBrush, QPalette
from python_qt_binding.QtWidgets import QApplication, QStyle, QStyledItemDelegate

from fleet_manager.gui.look import Tone, color

if TYPE_CHECKING:
    from collections.abc import Callable, Collection, Iterator, Mapping, Sequence

    from python_qt_binding.QtCore import QObject
    from python_qt_binding.QtGui import QPainter
    from python_qt_binding.QtWidgets import QStyleOptionViewItem

SORT_ROLE = Qt.UserRole
SHARE_ROLE = Qt.UserRole + 1
NOTHING = QModelIndex()
GAP = "\u2002"  # between right-aligned numbers and the next column


@dataclass(frozen=True)
class Column:
    """One column of a table; its functions take a row."""

    head: str  # its title
    shown: Callable[[Any], str]  # the text of a row's cell
    sort: Callable[[Any], float | str]  # what the column is sorted by
    tone: Callable[[Any], Tone | None] = lambda _row: None  # None for the usual one
    share: Callable[[Any], float] | None = None  # from 0 to 1, drawn as a bar; None: no bar
    bar_text: str = "100 %"  # the widest text beside a bar
    to_right: bool = False  # whether its texts are right-aligned numbers
    letters: int = 10  # its initial width, in letters


class RowsModel(QAbstractTableModel):
    """Rows by name, in the order in which they came."""

    def __init__(self, columns: Sequence[Column]) -> None:
        super().__init__()
        self.columns = tuple(columns)
        self._names: list[str] = []
        self._rows: list[Any] = []
        self._numbers: dict[str, int] = {}

    def rowCount(self, parent: QModelIndex = NOTHING) -> int:  # noqa: N802  (Qt's name)
        """Return the number of rows."""
        return 0 if parent.isValid() else len(self._names)

    def columnCount(self, parent: QModelIndex = NOTHING) -> int:  # noqa: N802  (Qt's name)
        """Return the number of columns."""
        return 0 if parent.isValid() else len(self.columns)

    def name_at(self, number: int) -> str:
        """Return the name of a row."""
        return self._names[number]

    def number_of(self, name: str) -> int | None:
        """Return the number of the row of a name; None if there is none."""
        return self._numbers.get(name)

    def row_at(self, number: int) -> Any:  # noqa: ANN401  (any kind of row)
        """Return a row."""
        return self._rows[number]

    def headerData(self, section: int, orientation: Any, role: int) -> Any:  # noqa: ANN401, N802  (Qt's)
        """Return the title of a column."""
        if orientation != Qt.Horizontal:
            return None
        if role == Qt.DisplayRole:
            column = self.columns[section]
            return column.head + (GAP if column.to_right else "")
        if role == Qt.TextAlignmentRole:
            return _alignment(self.columns[section])
        return None

    def data(self, index: QModelIndex, role: int = Qt.DisplayRole) -> Any:  # noqa: ANN401  (Qt's)
        """Return one aspect of a cell."""
        column, row = self.columns[index.column()], self._rows[index.row()]
        if role == SORT_ROLE:
            return column.sort(row)
        if role in {Qt.DisplayRole, Qt.ToolTipRole}:
            return column.shown(row) + (GAP if column.to_right else "")
        if role == Qt.TextAlignmentRole:
            return _alignment(column)
        if role == Qt.ForegroundRole:
            tone = column.tone(row)
            return color(tone, QApplication.palette()) if tone else None
        if role == SHARE_ROLE:
            return column.share(row) if column.share else None
        return None

    def apply(self, names: Collection[str], rows: Mapping[str, Any]) -> None:
        """Update the rows of these names, out of all rows as they are now."""
        gone = [
            self._numbers[name] for name in names if name not in rows and name in self._numbers
        ]
        if gone:
            self._remove(gone)
        changed = [self._numbers[name] for name in names if name in self._numbers]
        for number in changed:
            self._rows[number] = rows[self._names[number]]
        for first, last in _runs(changed):
            self.dataChanged.emit(self.index(first, 0), self.index(last, len(self.columns) - 1))
        new = {name for name in names if name in rows and name not in self._numbers}
        if new:
            self._append([name for name in rows if name in new], rows)

    def _remove(self, numbers: list[int]) -> None:
        for first, last in reversed(list(_runs(numbers))):
            self.beginRemoveRows(NOTHING, first, last)
            del self._names[first : last + 1]
            del self._rows[first : last + 1]
            self.endRemoveRows()
        self._numbers = {name: number for number, name in enumerate(self._names)}

    def _append(self, names: list[str], rows: Mapping[str, Any]) -> None:
        start = len(self._names)
        self.beginInsertRows(NOTHING, start, start + len(names) - 1)
        self._numbers.update({name: start + number for number, name in enumerate(names)})
        self._names += names
        self._rows += [rows[name] for name in names]
        self.endInsertRows()


def _alignment(column: Column) -> int:
    return int(Qt.AlignVCenter | (Qt.AlignRight if column.to_right else Qt.AlignLeft))


def _runs(numbers: list[int]) -> Iterator[tuple[int, int]]:
    """Give the first and last of each run of adjacent numbers."""
    numbers = sorted(numbers)
    start = 0
    for place in range(1, len(numbers) + 1):
        if place == len(numbers) or numbers[place] != numbers[place - 1] + 1:
            yield numbers[start], numbers[place - 1]
            start = place


class BarDelegate(QStyledItemDelegate):
    """Draws the bar on the left in the cell's colour, the text, at most `widest`, on the right."""

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
        painter.fillRect(bar, option.palette.color(QPalette.Base))
        painter.drawRect(bar)
        filled = QRectF(
            bar.left(), bar.top(), bar.width() * max(0.0, min(1.0, share)), bar.height()
        )
        painter.fillRect(filled, _filling(option, index))
        painter.restore()


def _filling(option: QStyleOptionViewItem, index: QModelIndex) -> QBrush:
    """Return the cell's own colour, or a calm one; also where the row is selected."""
    return QBrush(index.data(Qt.ForegroundRole) or color(Tone.CALM, option.palette))
