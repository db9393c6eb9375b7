# SPDX-License-Identifier: BSD-3-Clause
"""Runs the `hive` command line on ROS."""

from __future__ import annotations

import contextlib
import gc
import os
import re
import signal
import sys
from pathlib import Path
from typing import TYPE_CHECKING

from fleet_manager.cli.context import CliContext
from fleet_manager.cli.main import hive, run

if TYPE_CHECKING:
    from collections.abc import Sequence
    from contextlib import AbstractContextManager
    from types import FrameType

    import click

    from fleet_manager.cli.context import FaultLink
    from fleet_manager.client.client import ClientLink


def connect(record: Sequence[str]) -> AbstractContextManager[ClientLink]:
    """Open a link to the hive; see `ros.client_link.connect`.

    rospy is imported only now: it takes a quarter of a second, which tab completion and `--help`
    would feel, and it reads the environment that the demo sets first.
    """
    gc.disable()  # it would look for garbage in what importing makes, and find none
    try:
        _import_genpy()
        from fleet_manager.ros import client_link  # noqa: PLC0415  (see above)
    finally:
        gc.enable()
    return client_link.connect(record)


def elsewhere(ends: Sequence[str], certificates: str) -> CliContext:
    """Return the context of a hive over Zenoh, for which rospy is not needed."""
    from fleet_manager.config.zenoh_operator import operator_site  # noqa: PLC0415  (few need it)

    site = operator_site(ends, certificates)

    def open_link(record: Sequence[str]) -> AbstractContextManager[ClientLink]:
        _import_genpy()
        from fleet_manager.zenoh import client_link  # noqa: PLC0415  (see above)

        return client_link.connect(site, record)

    return CliContext(open_link)


def _import_genpy() -> None:
    """Import genpy without numpy, of whose numbers it then does not know; no message here has any.

    Importing numpy would take nearly as long as importing rospy.
    """
    if sys.modules.keys().isdisjoint({"genpy", "numpy"}):
        sys.modules["numpy"] = None  # type: ignore[assignment]  # as documented: it cannot be imported
        try:
            import genpy  # noqa: F401, PLC0415  (see above)
        finally:
            del sys.modules["numpy"]


def journals() -> Path:
    """Return the folder of the journals of the hive at ROS_MASTER_URI.

    It is that of the parameter `journal`, or the default where there is none, or no ROS master.
    """
    # It knows of rosgraph and rospkg, and only commands that read journals need it.
    from blackboard.ros.journals import default_folder, named_folder  # noqa: PLC0415  (see above)

    space = os.environ.get("ROS_NAMESPACE", "").strip("/")
    named = ""
    with contextlib.suppress(OSError):
        named = named_folder("/".join(["", *filter(None, [space, "hive"])]))
    return Path(named) if named else default_folder()


def faults() -> FaultLink:
    """Return what injects faults; rospy is imported only now, as for `connect`."""
    from fleet_manager.ros.fault_link import RosFaultLink  # noqa: PLC0415  (see above)

    return RosFaultLink()


def main(command: click.Command = hive) -> None:
    """Run the command line of this process and exit.

    Ctrl-C works even where a script has started this in the background, with SIGINT ignored:
    the processes of a demo would inherit that, and could only be killed.

    It does not wait for rospy's threads, which takes half a second: `ros.client_link.connect` has
    told the master and closed all connections.
    """
    signal.signal(signal.SIGINT, signal.default_int_handler)
    signal.signal(signal.SIGTERM, _end)
    signal.signal(signal.SIGHUP, _end)
    # roslaunch adds words such as `__name:=...` to those of a program; `hive router` can be one.
    words = [word for word in sys.argv[1:] if not re.match(r"__[a-z]+:=", word)]
    try:
        code = run(CliContext(connect, journals, faults, elsewhere), words, command)
    except SystemExit as end:  # a signal, or tab completion
        code = end.code if isinstance(end.code, int) else 0
    with contextlib.suppress(OSError, ValueError):  # nobody reads on, or the file is closed
        sys.stdout.flush()
        sys.stderr.flush()
    os._exit(code)


def _end(number: int, _frame: FrameType | None) -> None:
    """Turn a signal into an exit that cleans up, as Ctrl-C does."""
    sys.exit(128 + number)
