# SPDX-License-Identifier: BSD-3-Clause
"""The fleet window with a stall watch, run by `bench` in a process of its own.

It prints `shown` once it is painted. For every line on its standard input it prints, as JSON, what
it shows, and restarts the measurement.
"""

from __future__ import annotations

import json
import sys
from threading import Thread

from python_qt_binding.QtCore import QObject, QSettings, QTimer, Signal
from python_qt_binding.QtWidgets import QApplication

from fleet_manager.gui.desk import Desk
from fleet_manager.gui.fleet_window import FleetWindow
from fleet_manager.gui.program import keep_responsive
from fleet_manager.ros.desk_link import RosDeskLink
from hive_lab.windows.stall_watch import StallWatch


class _Lines(QObject):
    """Brings lines of the standard input into the event loop."""

    arrived = Signal(str)
    ended = Signal()

    def start(self) -> None:
        Thread(target=self._read, daemon=True).start()

    def _read(self) -> None:
        for line in sys.stdin:
            self.arrived.emit(line.strip())
        self.ended.emit()


def main(settings_file: str) -> None:
    """Run until the standard input ends; the settings file keeps layout and choices."""
    keep_responsive()
    application = QApplication(["measured_window"])
    desk = Desk(RosDeskLink("measured_window", sys.argv[:1]))
    window = FleetWindow(desk, QSettings(settings_file, QSettings.IniFormat))
    watch, lines = StallWatch(), _Lines()

    def tell(line: str) -> None:
        if line == "scroll":
            _scroll(window)
        told = {
            "stall": watch.longest,
            "tasks": len(desk.hive.tasks),
            "robots": len(desk.hive.robots),
            "standing": desk.standing.name,
            "link": desk.link_change.state.name,
        }
        print(json.dumps(told), flush=True)  # noqa: T201  (read by the benchmark)
        watch.reset()

    lines.arrived.connect(tell)
    lines.ended.connect(application.quit)
    desk.start()
    window.show()
    QTimer.singleShot(0, lambda: print("shown", flush=True))  # noqa: T201  (as above)
    watch.start()
    lines.start()
    application.exec_()


def _scroll(window: FleetWindow) -> None:
    """Go through all tasks, a little at every turn of the loop."""
    assert window.view  # noqa: S101  (it was made with one)
    bar = window.view.task_table.verticalScrollBar()
    bar.setValue(0)
    timer = QTimer(window, interval=20)

    def turn() -> None:
        bar.setValue(bar.value() + bar.pageStep())
        if bar.value() >= bar.maximum():
            timer.stop()

    timer.timeout.connect(turn)
    timer.start()


if __name__ == "__main__":
    main(sys.argv[1])
