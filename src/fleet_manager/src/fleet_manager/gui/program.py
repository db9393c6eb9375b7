# SPDX-License-Identifier: BSD-3-Clause
"""Runs the windows as programs."""

from __future__ import annotations

import argparse
import gc
import logging
import signal
import sys
from pathlib import Path
from typing import TYPE_CHECKING

import rospy
from python_qt_binding.QtCore import QSettings, QTimer
from python_qt_binding.QtWidgets import QApplication

from fleet_manager.gui.benchmarks.window import Benchmarks
from fleet_manager.gui.desk import Desk
from fleet_manager.gui.fleet_window import FleetWindow
from fleet_manager.ros.desk_link import RosDeskLink
from hive_common.errors import HiveError

if TYPE_CHECKING:
    from collections.abc import Sequence
    from types import TracebackType

    from fleet_manager.desk.facts import DeskLink

SWITCH_INTERVAL = 0.0005  # [s]
_LOOK_EVERY = 200  # time between two looks for signals [ms]
COLLECT_AFTER = (10_000, 20, 20)  # thresholds of the three generations, see gc.set_threshold


def main(name: str, *, entry: bool = True, view: bool = True) -> None:
    """Run a node with one window until it is closed, then leave the process."""
    arguments = _parse(name, rospy.myargv()[1:])
    application = _application(name, arguments.qt)
    desk = Desk(_link(name, arguments, shows_map=entry and view))
    window = FleetWindow(desk, _settings(), entry=entry, view=view)
    desk.start()
    window.show()
    code = application.exec_()
    desk.stop()
    window.end()
    sys.exit(code)


def show_benchmarks() -> None:
    """Run the window in which ways to decide are compared until it is closed."""
    arguments = _parser("benchmarks", "Compares ways to decide.").parse_args(rospy.myargv()[1:])
    application = _application("benchmarks", arguments.qt)
    window = Benchmarks(Path("results").resolve(), _settings())
    window.resize(1280, 800)
    window.show()
    # Without events the interpreter would not look whether a signal has come.
    timer = QTimer(window)
    timer.timeout.connect(lambda: None)
    timer.start(_LOOK_EVERY)
    code = application.exec_()
    window.end()
    sys.exit(code)


def _link(name: str, arguments: argparse.Namespace, *, shows_map: bool) -> DeskLink:
    """Return the link to the hive that the arguments name."""
    if arguments.site is None:
        return RosDeskLink(name, sys.argv, shows_map=shows_map)
    from fleet_manager.zenoh.desk_link import ZenohDeskLink  # noqa: PLC0415  (see `_parse`)

    return ZenohDeskLink(arguments.site, arguments.map, shows_map=shows_map)


def _application(name: str, qt: Sequence[str]) -> QApplication:
    """Return the application, with a window's ways to treat signals and exceptions."""
    application = QApplication([name, *qt])
    application.setApplicationName(name)
    signal.signal(signal.SIGINT, lambda *_: application.quit())
    signal.signal(signal.SIGTERM, lambda *_: application.quit())
    keep_responsive()
    sys.excepthook = log_exception
    return application


def _settings() -> QSettings:
    return QSettings("robo_hive", "fleet_manager")


def log_exception(
    kind: type[BaseException], error: BaseException, trace: TracebackType | None
) -> None:
    """Log an exception and go on.

    Without this Qt ends the process, and what a person has typed is lost.
    """
    logging.getLogger("rosout").error(
        "the window raised an exception", exc_info=(kind, error, trace)
    )
    sys.__excepthook__(kind, error, trace)


def keep_responsive() -> None:
    """Let the event loop have the interpreter soon after it asks.

    Otherwise threads that read messages keep it for 5 ms at a time, and one repaint asks hundreds
    of times. The garbage collector stops all threads while it looks at every object, for 60 ms
    with 2,000 tasks, so it leaves the imported modules alone and seldom looks at the rest:
    messages and records hold hardly any reference cycles.
    """
    sys.setswitchinterval(SWITCH_INTERVAL)
    gc.collect()
    gc.freeze()
    gc.set_threshold(*COLLECT_AFTER)


def _parse(name: str, argv: Sequence[str]) -> argparse.Namespace:
    """Return the arguments of a window on a hive; end the program where they cannot be used."""
    parser = _parser(
        name,
        "A window on a hive, whose ROS master ROS_MASTER_URI names. With --connect it shows a "
        "hive over Zenoh, and needs no ROS master.",
    )
    parser.add_argument(
        "--connect",
        action="append",
        default=[],
        metavar="WHERE",
        help="a hive over Zenoh: its fleet file, or tls/HOST:PORT of each member or of a router",
    )
    parser.add_argument(
        "--certificates",
        default="",
        metavar="DIR",
        help="with --connect: the folder of your certificate, if the fleet file does not say it",
    )
    parser.add_argument(
        "--map", default="", help="with --connect: the map to show: a name in maps/ or a path"
    )
    arguments = parser.parse_args(argv)
    arguments.site = None
    if not arguments.connect:
        if arguments.certificates or arguments.map:
            parser.error("--certificates and --map need --connect")
        return arguments
    # Without --connect, Zenoh need not be loaded.
    from fleet_manager.config.zenoh_operator import operator_site  # noqa: PLC0415

    try:
        arguments.site = operator_site(arguments.connect, arguments.certificates)
    except HiveError as error:
        parser.error(str(error))
    return arguments


def _parser(name: str, description: str) -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(prog=name, description=description)
    parser.add_argument("qt", nargs="*", help="arguments for Qt, after --")
    return parser
