# SPDX-License-Identifier: BSD-3-Clause
"""The lines at the top of the windows: who is the leader, and what needs a person."""

from __future__ import annotations

import time
from typing import TYPE_CHECKING

from python_qt_binding.QtCore import QObject, Qt
from python_qt_binding.QtGui import QPalette

from fleet_manager.client.attention import needs
from fleet_manager.client.formats import duration, member
from fleet_manager.client.leadership import Standing
from fleet_manager.client.words import Severity
from fleet_manager.desk.facts import ROS_MASTER, LinkState
from fleet_manager.gui.look import SEVERITY_SIGNS, Tone, color

if TYPE_CHECKING:
    from python_qt_binding.QtWidgets import QLabel

    from fleet_manager.gui.desk import Desk


def banner_text(desk: Desk) -> str:
    """Return who is the leader; where nobody is, why; and which node did not start."""
    line, trouble = _standing_text(desk), next(iter(desk.troubles), "")
    return f"{line}   ⚠ {trouble}" if trouble else line


def _standing_text(desk: Desk) -> str:
    link, beat, standing = desk.link_change, desk.hive.heartbeat, desk.standing
    if beat is None and link.state is not LinkState.UP:
        return f"⚠ No {link.what} at {link.address}. Start the hive; this window connects."
    if beat is None:
        return "⚠ No leader: nobody accepts or assigns tasks."
    leader, backup = member(beat.leader), member(beat.backup)
    if standing is Standing.STUCK:
        line = f"⚠ No leader: {leader} answers but does not work."
    elif standing is Standing.SILENT:
        silence = duration(desk.hive.leadership.silence(time.monotonic()))
        line = f"⚠ No leader: {leader} has been silent for {silence}. Tasks and robots wait."
    else:
        line = f"● Leader: {leader}   Backup: {backup or 'none'}   Epoch {beat.epoch}"
    if link.state is LinkState.LOST:
        then = "running nodes go on" if link.what == ROS_MASTER else "this window connects again"
        line += f"   ⚠ The {link.what} at {link.address} does not answer; {then}."
    return line


def needs_text(desk: Desk) -> str:
    """Return what needs a person, or that nothing does; empty while there is no leader."""
    if desk.standing is not Standing.LEADER:
        return ""
    found = needs(desk.hive, desk.now())
    signs = (f"{SEVERITY_SIGNS[severity][0]} {text}" for text, severity in found)
    return "   ".join(signs) or "✔ Nothing needs you."


class NeedsLine(QObject):
    """Keeps a label up to date with what needs a person."""

    def __init__(self, label: QLabel, desk: Desk) -> None:
        super().__init__(label)
        self._label, self._desk = label, desk
        label.setMargin(label.fontMetrics().averageCharWidth())
        label.setTextInteractionFlags(Qt.TextSelectableByMouse)
        desk.changed.connect(self.refresh)
        desk.standing_changed.connect(self.refresh)
        self.refresh()

    def refresh(self) -> None:
        """Show the present text, in the colour of the most urgent need."""
        words = needs_text(self._desk)
        tone = Tone.GOOD
        for severity in (Severity.ALARM, Severity.WARNING):
            if SEVERITY_SIGNS[severity][0] in words:
                tone = SEVERITY_SIGNS[severity][1]
                break
        palette = QPalette(self._label.parentWidget().palette())
        palette.setColor(QPalette.WindowText, color(tone, palette))
        self._label.setPalette(palette)
        self._label.setText(words)
        self._label.setVisible(bool(words))


class Banner(QObject):
    """Keeps a label up to date with who is the leader."""

    def __init__(self, label: QLabel, desk: Desk) -> None:
        super().__init__(label)
        self._label, self._desk = label, desk
        label.setAutoFillBackground(True)
        label.setWordWrap(True)
        label.setMargin(label.fontMetrics().averageCharWidth())
        desk.standing_changed.connect(self.refresh)
        self.refresh()

    def refresh(self) -> None:
        """Show the present text; what is wrong with the leader or the master stands out."""
        self._label.setText(banner_text(self._desk))
        palette = QPalette(self._label.parentWidget().palette())
        if "⚠" in _standing_text(self._desk):
            palette.setColor(QPalette.Window, color(Tone.BAD, palette))
            palette.setColor(QPalette.WindowText, palette.color(QPalette.Base))
        self._label.setPalette(palette)
