# SPDX-License-Identifier: BSD-3-Clause
"""The line on top of every window that says who carries the blackboard."""

from __future__ import annotations

from typing import TYPE_CHECKING

from python_qt_binding.QtCore import QObject
from python_qt_binding.QtGui import QPalette

from fleet_manager.desk.authority import Standing
from fleet_manager.desk.facts import LinkState
from fleet_manager.desk.formats import duration, member
from fleet_manager.desk.words import text
from fleet_manager.gui.look import Tone, color

if TYPE_CHECKING:
    from python_qt_binding.QtWidgets import QLabel

    from fleet_manager.gui.desk import Desk


def banner_text(desk: Desk) -> str:
    """Return who carries the blackboard, or in plain words that nobody does."""
    link, beat, standing = desk.link_change, desk.hive.authority.heartbeat, desk.standing
    if beat is None and link.state is not LinkState.UP:
        return f"⚠ {text('authority.no_master', master=link.master)}"
    if beat is None:
        return f"⚠ {text('authority.NOBODY')}"
    silence = duration(desk.hive.authority.silence(desk.moment()))
    leader, backup = member(beat.leader), member(beat.backup)
    words = text(f"authority.{standing.name}", leader=leader, silence=silence)
    if standing is not Standing.LEADER:
        line = f"⚠ {words}"
    else:
        stands = text("authority.backup" if backup else "authority.no_backup", backup=backup)
        line = f"● {words}   {stands}   {text('authority.epoch', epoch=beat.epoch)}"
    if link.state is LinkState.LOST:
        line += f"   ⚠ {text('authority.lost_master', master=link.master)}"
    return line


class Banner(QObject):
    """Keeps a label saying who carries the blackboard.

    Args:
        label: Where it is said.
        desk: Knows.
    """

    def __init__(self, label: QLabel, desk: Desk) -> None:
        super().__init__(label)
        self._label, self._desk = label, desk
        label.setAutoFillBackground(True)
        label.setMargin(label.fontMetrics().averageCharWidth())
        desk.standing_changed.connect(self.refresh)
        self.refresh()

    def refresh(self) -> None:
        """Say it anew."""
        words = banner_text(self._desk)
        self._label.setText(words)
        palette = QPalette(self._label.parentWidget().palette())
        alarm = words.startswith("⚠")
        if alarm:
            palette.setColor(QPalette.Window, color(Tone.BAD, palette))
            palette.setColor(QPalette.WindowText, palette.color(QPalette.Base))
        self._label.setPalette(palette)
