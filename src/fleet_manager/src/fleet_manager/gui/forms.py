# SPDX-License-Identifier: BSD-3-Clause
"""Loads the forms made with Qt Designer and puts the words into them."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from python_qt_binding import loadUi
from python_qt_binding.QtWidgets import QWidget

from fleet_manager.desk.words import WORDS, text
from fleet_manager.gui.look import Tone, color
from hive_common.resources import package_folder

if TYPE_CHECKING:
    from collections.abc import Mapping

    from python_qt_binding.QtCore import QObject

_PROPERTIES = ("text", "title", "windowTitle", "toolTip", "placeholderText")


def load_form(name: str, widget: QWidget, /, **values: object) -> None:
    """Build a widget from `resource/<name>.ui`.

    The form holds keys of `words.WORDS` where its texts will be; each is replaced here. Every
    child becomes an attribute of the widget, by its object name.

    Args:
        name: Of the file, without its ending.
        widget: What is filled; of the class that the form names.
        **values: What the texts have in braces.

    Raises:
        KeyError: The form holds a text that is no key: a fault of the program.
    """
    loadUi(str(package_folder("fleet_manager") / "resource" / f"{name}.ui"), widget)
    for child in (widget, *widget.findChildren(QWidget)):
        _fill_words(child, values)


def _fill_words(child: QObject, values: dict[str, object]) -> None:
    known = child.metaObject()
    for name in _PROPERTIES:
        if known.indexOfProperty(name) < 0:
            continue
        key = child.property(name)
        if isinstance(key, str) and key in WORDS:
            child.setProperty(name, WORDS[key].format(**values))


def show_mistake(label: QWidget, mistake: str) -> None:
    """Show what is wrong below a field, with a sign for those who do not see the colour."""
    label.setText(f"⚠ {mistake}" if mistake else "")
    label.setVisible(bool(mistake))


def mark_field(edit: QWidget, *, wrong: bool) -> None:
    """Give a field a thick border in the colour of mistakes, or take it off."""
    if edit.property("wrong") != wrong:
        edit.setProperty("wrong", wrong)
        shade = color(Tone.BAD, edit.palette()).name()
        edit.setStyleSheet(f"border: 0.15em solid {shade}" if wrong else "")


def fill_choices(box: QWidget, keys: Mapping[Any, str]) -> None:
    """Fill a choice with texts, each standing for a value (its item data)."""
    for value, key in keys.items():
        box.addItem(text(key), value)
