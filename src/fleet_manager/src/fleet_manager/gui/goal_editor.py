# SPDX-License-Identifier: BSD-3-Clause
"""The fields of one goal."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from python_qt_binding.QtCore import Signal
from python_qt_binding.QtWidgets import QGroupBox

from fleet_manager.desk.form import GoalText
from fleet_manager.gui.look import load_form, mark_field, show_mistake

if TYPE_CHECKING:
    from collections.abc import Mapping

    from python_qt_binding.QtWidgets import QLineEdit, QWidget

    from fleet_manager.desk.picking import Filled
    from fleet_manager.desk.places import Place

_AXES = ("x", "y", "heading")
_LETTERS = 7  # fit into a field without scrolling, such as 12.345


class GoalEditor(QGroupBox):
    """The place or coordinates of one goal, named A, B or C.

    Signals:
        edited: The text of any field changed.
        left: The field of this name (`A.x`) lost the focus.
        pick_asked: The person starts or stops picking this goal on the map.
    """

    edited = Signal()
    left = Signal(str)
    pick_asked = Signal(str, bool)

    def __init__(self, name: str) -> None:
        super().__init__()
        load_form("goal_editor", self)
        self.pick_button.setText(f"Pick &{name} on map")
        self.name = name
        self._places: tuple[Place, ...] = ()
        self.edits: Mapping[str, QLineEdit] = {
            f"{name}.{axis}": getattr(self, f"{axis}_edit") for axis in _AXES
        }
        self.mistake_label.hide()
        self.offer_places(())
        letter = self.fontMetrics().horizontalAdvance("0")
        for field, edit in self.edits.items():
            edit.setMinimumWidth(_LETTERS * letter)
            edit.textEdited.connect(self._typed)
            edit.textChanged.connect(self.edited)
            edit.editingFinished.connect(lambda field=field: self.left.emit(field))
        self.place_box.activated.connect(self._choose_place)
        self.pick_button.clicked.connect(lambda on: self.pick_asked.emit(name, on))

    @property
    def tab_stops(self) -> tuple[QWidget, ...]:
        """The widgets that Tab goes through, in this order."""
        return (self.place_box, *self.edits.values(), self.pick_button)

    def show_use(self, *, is_taken: bool, is_needed: bool) -> None:
        """Enable the goal only where the task's type takes it."""
        self.setEnabled(is_taken)
        optional = is_taken and not is_needed
        self.setTitle(f"Goal {self.name}{' (may be left empty)' if optional else ''}")

    def typed(self) -> GoalText:
        """Return what the fields hold."""
        return GoalText(*(edit.text() for edit in self.edits.values()))

    def clear(self) -> None:
        """Empty the fields."""
        self.place_box.setCurrentIndex(0)
        for edit in self.edits.values():
            edit.clear()
            edit.setModified(False)  # nobody has been there since

    def fill(self, filled: Filled) -> None:
        """Put numbers into the fields [m, m, rad]; None leaves a field as it is."""
        self.place_box.setCurrentIndex(0)
        yaw = None if filled.yaw is None else math.degrees(filled.yaw)
        for edit, number in zip(self.edits.values(), (filled.x, filled.y, yaw), strict=True):
            if number is not None:
                edit.setText(_written(number))

    def fill_pose(self, x: float, y: float, yaw: float) -> None:
        """Put a pose into the fields [m, m, rad]."""
        for edit, number in zip(self.edits.values(), (x, y, math.degrees(yaw)), strict=True):
            edit.setText(_written(number))

    def show_mistakes(self, mistakes: Mapping[str, str]) -> None:
        """Mark the wrong fields, and say what is allowed."""
        mine = {field: mistakes[field] for field in self.edits if field in mistakes}
        lines = (f"{field[2:]} {words}" for field, words in mine.items())
        show_mistake(self.mistake_label, "\n⚠ ".join(lines))
        for field, edit in self.edits.items():
            mark_field(edit, wrong=field in mine)

    def offer_places(self, places: tuple[Place, ...]) -> None:
        """Offer places to choose instead of coordinates."""
        self._places = places
        self.place_box.clear()
        self.place_box.addItem("by coordinates")
        self.place_box.addItems([place.name for place in self._places])
        self.place_label.setVisible(bool(self._places))
        self.place_box.setVisible(bool(self._places))

    def _typed(self, _text: str) -> None:
        self.place_box.setCurrentIndex(0)

    def _choose_place(self, number: int) -> None:
        if number > 0:
            pose = self._places[number - 1].pose
            self.fill_pose(pose.x, pose.y, pose.yaw)


def _written(number: float) -> str:
    """Return a number to the millimetre, or to the thousandth of a degree."""
    return f"{round(number, 3) + 0.0:.10g}"
