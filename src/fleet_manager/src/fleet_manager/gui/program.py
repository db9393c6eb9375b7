# SPDX-License-Identifier: BSD-3-Clause
"""Runs the windows as programs."""

from __future__ import annotations

import argparse
import logging
import signal
import sys
from typing import TYPE_CHECKING

import rospy
from python_qt_binding.QtCore import QSettings
from python_qt_binding.QtWidgets import QApplication

from fleet_manager.desk.words import text
from fleet_manager.gui.desk import Desk
from fleet_manager.gui.fleet_window import FleetWindow
from fleet_manager.ros.desk_link import RosDeskLink

if TYPE_CHECKING:
    from collections.abc import Sequence
    from types import TracebackType

SWITCH = 0.0005  # [s]


def main(name: str, *, entry: bool = True, view: bool = True) -> None:
    """Run one window until it is closed, then leave the process.

    Args:
        name: Of the node and the program.
        entry: Whether the window has the task entry.
        view: Whether it has the task view.

    ROS Parameters:
        ~world (string): World whose stations and chargers can be chosen; none by default.
    """
    arguments = _parse(name, rospy.myargv()[1:])
    application = QApplication([name, *arguments.qt])
    application.setApplicationName(name)
    signal.signal(signal.SIGINT, lambda *_: application.quit())
    signal.signal(signal.SIGTERM, lambda *_: application.quit())
    keep_responsive()
    sys.excepthook = report_fault
    desk = Desk(RosDeskLink(name, sys.argv))
    window = FleetWindow(desk, QSettings("robo_hive", "fleet_manager"), entry=entry, view=view)
    desk.start()
    window.show()
    code = application.exec_()
    desk.stop()
    sys.exit(code)


def report_fault(
    kind: type[BaseException], error: BaseException, trace: TracebackType | None
) -> None:
    """Write down a fault of the program and go on.

    Without this Qt ends the process, and with it all that a person has typed and not yet sent.
    """
    logging.getLogger("rosout").error("a fault of the window", exc_info=(kind, error, trace))
    sys.__excepthook__(kind, error, trace)


def keep_responsive() -> None:
    """Let the event loop have the interpreter soon after it asks for it.

    Threads that read messages otherwise keep it for 5 ms at a time, and one repaint asks for it
    hundreds of times.
    """
    sys.setswitchinterval(SWITCH)


def _parse(name: str, argv: Sequence[str]) -> argparse.Namespace:
    parser = argparse.ArgumentParser(
        prog=name,
        description=text("app.about"),
        epilog=text("app.example", program=name),
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument("qt", nargs="*", help=text("app.qt_arguments"))
    return parser.parse_args(argv)
