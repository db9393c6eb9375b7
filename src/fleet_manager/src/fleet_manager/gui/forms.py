# SPDX-License-Identifier: BSD-3-Clause
"""Loads the forms made with Qt Designer, and marks their fields."""

from __future__ import annotations

from typing import TYPE_CHECKING

from python_qt_binding import loadUi

from fleet_manager.gui.look import Tone, color
from hive_common.resources import package_folder

if TYPE_CHECKING:
    from python_qt_binding.QtWidgets import QWidget


def load_form(name: str, widget: QWidget) -> None:
    """Build a widget from `resource/<name>.ui`; every child becomes an attribute of it."""
    loadUi(str(package_folder("fleet_manager") / "resource" / f"{name}.ui"), widget)


def show_mistake(label: QWidget, mistake: str) -> None:
    """Show what is wrong below a field, with a sign besides the colour."""
    label.setText(f"⚠ {mistake}" if mistake else "")
    label.setVisible(bool(mistake))


def mark_field(edit: QWidget, *, wrong: bool) -> None:
    """Give a field a thick border in the colour of mistakes, or remove it."""
    if edit.property("wrong") != wrong:
        edit.setProperty("wrong", wrong)
        shade = color(Tone.BAD, edit.palette()).name()
        edit.setStyleSheet(f"border: 0.15em solid {shade}" if wrong else "")
