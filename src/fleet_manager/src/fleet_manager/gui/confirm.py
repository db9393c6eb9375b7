# SPDX-License-Identifier: BSD-3-Clause
"""Asks a person whether to go on, and says what it brings with it."""

from __future__ import annotations

from typing import TYPE_CHECKING

from python_qt_binding.QtCore import Qt
from python_qt_binding.QtWidgets import QMessageBox

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from python_qt_binding.QtWidgets import QWidget


def confirm(
    parent: QWidget,
    question: str,
    consequences: Sequence[str],
    verb: str,
    then: Callable[[], None],
    *,
    no: str = "&Keep as it is",
) -> None:
    """Ask a question, and call `then` if the answer is yes; the windows go on meanwhile.

    Args:
        parent: The window that asks.
        question: What is going to be done.
        consequences: What it brings with it, in sentences; may be empty.
        verb: The text of the button that does it, such as "Cancel T1".
        then: What does it.
        no: The text of the other button.
    """
    box = QMessageBox(QMessageBox.Question, parent.windowTitle(), question, parent=parent)
    box.setInformativeText("\n\n".join(consequences))
    box.setAttribute(Qt.WA_DeleteOnClose)
    yes = box.addButton(verb, QMessageBox.AcceptRole)
    other = box.addButton(no, QMessageBox.RejectRole)
    box.setDefaultButton(other if consequences else yes)
    box.setEscapeButton(other)
    box.finished.connect(lambda _result: then() if box.clickedButton() is yes else None)
    box.open()
