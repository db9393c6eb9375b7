# SPDX-License-Identifier: BSD-3-Clause
"""What all windows have in common: forms, signs, and colours on light and dark desktops.

Every state has a sign and a word besides its colour. The colours are those of Okabe and Ito
(Color Universal Design, 2008), which people with any colour vision can distinguish, darkened for
light and lightened for dark backgrounds.
"""

from __future__ import annotations

from enum import Enum
from typing import TYPE_CHECKING

from python_qt_binding import loadUi
from python_qt_binding.QtGui import QColor, QPalette

from blackboard.domain.characteristics import RobotState
from blackboard.domain.task import TaskState
from fleet_manager.client.words import Severity
from fleet_manager.desk.requests import Answer
from hive_common.resources import package_folder

if TYPE_CHECKING:
    from collections.abc import Mapping

    from python_qt_binding.QtWidgets import QApplication, QWidget


class Tone(Enum):
    """The meaning of a colour, with its shades for light and dark backgrounds."""

    QUIET = ("#5a5a5a", "#a8a8a8")
    CALM = ("#00598c", "#6cc4f5")
    GOOD = ("#00674a", "#4fd6ac")
    WARN = ("#8a5a00", "#f0b43c")
    BAD = ("#a83a00", "#ff9a5c")


TASK_SIGNS: Mapping[TaskState, tuple[str, Tone]] = {
    TaskState.WAITING: ("○", Tone.WARN),
    TaskState.ASSIGNED: ("◐", Tone.CALM),
    TaskState.STARTED: ("▶", Tone.CALM),
    TaskState.DONE: ("✔", Tone.GOOD),
    TaskState.REJECTED: ("⊘", Tone.BAD),
    TaskState.CANCELLED: ("■", Tone.QUIET),
    TaskState.FAILED: ("✖", Tone.BAD),
}
ROBOT_SIGNS: Mapping[RobotState, tuple[str, Tone]] = {
    RobotState.IDLE: ("○", Tone.GOOD),
    RobotState.BUSY: ("▶", Tone.CALM),
    RobotState.DEFECT: ("✖", Tone.BAD),
    RobotState.CHARGING: ("⚡", Tone.WARN),
    RobotState.OFFLINE: ("?", Tone.BAD),
}
ANSWER_SIGNS: Mapping[Answer, tuple[str, Tone]] = {
    Answer.KEPT: ("‖", Tone.WARN),
    Answer.WAITS: ("…", Tone.CALM),
    Answer.TAKEN: ("✔", Tone.GOOD),
    Answer.REFUSED: ("✖", Tone.BAD),
}
SEVERITY_SIGNS: Mapping[Severity, tuple[str, Tone]] = {
    Severity.NEWS: ("·", Tone.QUIET),
    Severity.WARNING: ("⚠", Tone.WARN),
    Severity.ALARM: ("✖", Tone.BAD),
}


class Appearance(Enum):
    """Light or dark; the values are kept in the settings."""

    DESKTOP = "as_desktop"
    LIGHT = "light"
    DARK = "dark"


_DARK = {
    QPalette.Window: "#2b2d30",
    QPalette.WindowText: "#e6e6e6",
    QPalette.Base: "#1e1f22",
    QPalette.AlternateBase: "#26282b",
    QPalette.Text: "#e6e6e6",
    QPalette.Button: "#3a3d41",
    QPalette.ButtonText: "#e6e6e6",
    QPalette.ToolTipBase: "#3a3d41",
    QPalette.ToolTipText: "#e6e6e6",
    QPalette.PlaceholderText: "#9a9a9a",
    QPalette.Highlight: "#2f6ea8",
    QPalette.HighlightedText: "#ffffff",
    QPalette.Link: "#6cc4f5",
}
_DARK_DISABLED = (QPalette.WindowText, QPalette.Text, QPalette.ButtonText)


def is_dark(palette: QPalette) -> bool:
    """Return whether a palette has light letters on a dark background."""
    ground, letters = palette.color(QPalette.Base), palette.color(QPalette.Text)
    return bool(ground.lightnessF() < letters.lightnessF())


def color(tone: Tone, palette: QPalette) -> QColor:
    """Return the shade of a tone that is readable on a palette's background."""
    return QColor(tone.value[is_dark(palette)])


def dark_palette() -> QPalette:
    """Return a palette with light letters on a dark background."""
    palette = QPalette()
    for role, shade in _DARK.items():
        palette.setColor(role, QColor(shade))
    for role in _DARK_DISABLED:
        palette.setColor(QPalette.Disabled, role, QColor("#808080"))
    return palette


def appear(application: QApplication, appearance: Appearance, desktop: QPalette) -> None:
    """Apply an appearance to the whole program; `desktop` is its palette from the start."""
    if appearance is Appearance.DARK:
        application.setPalette(dark_palette())
    elif appearance is Appearance.LIGHT and is_dark(desktop):
        application.setPalette(application.style().standardPalette())
    else:
        application.setPalette(desktop)


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
