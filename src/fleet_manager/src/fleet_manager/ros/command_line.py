# SPDX-License-Identifier: BSD-3-Clause
"""Runs the `hive` command line with ROS behind it."""

from __future__ import annotations

import signal
import sys
from importlib import import_module
from typing import TYPE_CHECKING

from fleet_manager.cli.main import hive, run
from fleet_manager.cli.outside import Outside

if TYPE_CHECKING:
    from collections.abc import Sequence
    from contextlib import AbstractContextManager
    from pathlib import Path
    from types import FrameType

    import click

    from fleet_manager.client.client import Link


def connect(record: Sequence[str]) -> AbstractContextManager[Link]:
    """Open a link to the hive; see `ros.hive_link.connect`.

    rospy is imported only now: it takes half a second, which tab completion and `--help` would
    feel, and it reads the environment that the demo sets first.
    """
    link: AbstractContextManager[Link] = import_module("fleet_manager.ros.hive_link").connect(
        record
    )
    return link


def journals() -> Path:
    """Return where the members of the hive of ROS_MASTER_URI keep their journals by default."""
    folder: Path = import_module("blackboard.ros.membership").default_folder()
    return folder


def main(command: click.Command = hive) -> None:
    """Run a command line of this process and end with its exit code.

    Ctrl-C is heard even where a script has started this in the background, with SIGINT ignored:
    the processes of a demo would inherit that, and could only be killed.
    """
    signal.signal(signal.SIGINT, signal.default_int_handler)
    signal.signal(signal.SIGTERM, _end)
    signal.signal(signal.SIGHUP, _end)
    sys.exit(run(Outside(connect, journals), command=command))


def _end(number: int, _frame: FrameType | None) -> None:
    """Turn a signal into an exit that cleans up, as Ctrl-C does."""
    sys.exit(128 + number)
