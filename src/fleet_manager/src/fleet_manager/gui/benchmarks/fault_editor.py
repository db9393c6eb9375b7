# SPDX-License-Identifier: BSD-3-Clause
"""The fields in which a person says what goes wrong in an experiment, and when."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from python_qt_binding.QtCore import Signal
from python_qt_binding.QtWidgets import (
    QComboBox,
    QHBoxLayout,
    QPushButton,
    QVBoxLayout,
    QWidget,
)

from fleet_manager.client.comparison import BLACKBOARD
from fleet_manager.desk.experiment import LIMIT, ShownFault
from fleet_manager.gui.benchmarks.number import Number

if TYPE_CHECKING:
    from collections.abc import Sequence

KINDS = ("kill", "freeze")


class FaultRow(QWidget):
    """The fields of one fault.

    Signals:
        removed: A person does not want it any longer.

    Args:
        fault: What it shows.
        names: The processes that are offered.
    """

    removed = Signal()

    def __init__(self, fault: ShownFault, names: Sequence[str]) -> None:
        super().__init__()
        self.after = Number(maximum=LIMIT, prefix="after ", suffix=" s", value=fault.after)
        self.kind = QComboBox()
        self.kind.addItems(KINDS)
        self.kind.setCurrentText("kill" if fault.freeze is None else "freeze")
        self.name = QComboBox(editable=True, insertPolicy=QComboBox.NoInsert)
        self.name.setMinimumContentsLength(len(BLACKBOARD))
        self.offer(names)
        self.name.setCurrentText(fault.kill if fault.freeze is None else fault.freeze)
        self.seconds = Number(maximum=LIMIT, prefix="for ", suffix=" s", value=fault.seconds)
        self.remove_button = QPushButton("✕", toolTip="Remove this fault")
        self.remove_button.setAccessibleName("Remove this fault")
        self.remove_button.setFixedWidth(3 * self.fontMetrics().averageCharWidth() + 12)
        self.remove_button.clicked.connect(self.removed)
        self.kind.currentIndexChanged.connect(self._enable)
        self._enable()
        layout = QHBoxLayout(self)
        layout.setContentsMargins(0, 0, 0, 0)
        for widget in (self.after, self.kind, self.name, self.seconds, self.remove_button):
            layout.addWidget(widget, stretch=int(widget is self.name))

    def offer(self, names: Sequence[str]) -> None:
        """Offer names of processes; what was typed stays."""
        typed = self.name.currentText()
        self.name.clear()
        self.name.addItems(names)
        self.name.setCurrentText(typed)

    def typed(self) -> dict[str, Any]:
        """Return what the fields hold; a process that is killed has `seconds` too."""
        return {
            "after": self.after.value(),
            self.kind.currentText(): self.name.currentText().strip(),
            "seconds": self.seconds.value(),
        }

    def _enable(self) -> None:
        self.seconds.setEnabled(self.kind.currentText() == "freeze")


class FaultEditor(QWidget):
    """A row of fields for each fault, and a button that adds one."""

    def __init__(self) -> None:
        super().__init__()
        self.rows: list[FaultRow] = []
        self.add_button = QPushButton("Add a f&ault")
        self.add_button.clicked.connect(self.add)
        self._names = [BLACKBOARD]
        self._column = QVBoxLayout(self)
        self._column.setContentsMargins(0, 0, 0, 0)
        line = QHBoxLayout()
        line.addWidget(self.add_button)
        line.addStretch()
        self._column.addLayout(line)
        # There is room for the first row before it is added.
        self.setMinimumWidth(FaultRow(ShownFault(kill=BLACKBOARD), ()).sizeHint().width())

    def fill(self, faults: Sequence[ShownFault]) -> None:
        """Show other faults."""
        for row in list(self.rows):
            self._remove(row)
        for fault in faults:
            self._append(fault)

    def offer(self, robots: Sequence[str]) -> None:
        """Offer the names of a fleet's robots, and the blackboard."""
        self._names = [BLACKBOARD, *robots]
        for row in self.rows:
            row.offer(self._names)

    def add(self) -> None:
        """Add a fault, which a person then changes."""
        self._append(ShownFault(kill=BLACKBOARD))
        self.rows[-1].after.setFocus()

    def typed(self) -> list[dict[str, Any]]:
        """Return what the fields hold, right or wrong."""
        return [row.typed() for row in self.rows]

    def content(self) -> list[dict[str, Any]]:
        """Return the faults as an experiment file holds them.

        Raises:
            ValueError: A field cannot be used; the text names it.
        """
        return [_checked(number, fault) for number, fault in enumerate(self.typed(), start=1)]

    def _append(self, fault: ShownFault) -> None:
        row = FaultRow(fault, self._names)
        row.removed.connect(lambda: self._remove(row))
        before = self.rows[-1].remove_button if self.rows else self.add_button
        self.rows.append(row)
        self._column.addWidget(row)
        for field in (row.after, row.kind, row.name, row.seconds, row.remove_button):
            self.setTabOrder(before, field)  # otherwise new fields are the last ones in the window
            before = field

    def _remove(self, row: FaultRow) -> None:
        had_focus = row.remove_button.hasFocus()
        self.rows.remove(row)
        self._column.removeWidget(row)
        row.hide()
        row.deleteLater()
        if had_focus:
            self.add_button.setFocus()


def _checked(number: int, fault: dict[str, Any]) -> dict[str, Any]:
    kind = next(kind for kind in KINDS if kind in fault)
    if not fault[kind]:
        allowed = "the name of a robot, or blackboard"
        raise ValueError(f"Fault {number}: no name of whom to {kind}; allowed: {allowed}")
    if kind == "kill":
        return {"after": fault["after"], "kill": fault["kill"]}
    if not fault["seconds"]:
        raise ValueError(f"Fault {number}: frozen for 0 s; allowed: above 0, or kill")
    return fault
