# SPDX-License-Identifier: BSD-3-Clause
"""The process of the traffic planner: it lives no longer than the one that started it.

Robots wait for its first plan after a takeover, so it listens while it imports the planner.
"""

from __future__ import annotations

import os
import stat
import sys
import threading
import time

import rospy

from hive_navigation.ros.planner_progress import ProgressTeller
from hive_navigation.ros.startup import run_node
from hive_navigation.ros.traffic_ears import Ears

_LAST_PATIENCE = 2.0  # time to shut down before the process ends anyway [s, wall clock]


def _end_with_parent() -> None:
    """End this process when its standard input ends, if that comes from another process.

    The process that started it holds the other end, and the system closes it however that dies.
    """
    if not stat.S_ISFIFO(os.fstat(sys.stdin.fileno()).st_mode):
        return

    def wait() -> None:
        while os.read(sys.stdin.fileno(), 1):
            pass
        threading.Timer(_LAST_PATIENCE, os._exit, (0,)).start()
        rospy.signal_shutdown("the process that started this one has ended or let it go")

    threading.Thread(target=wait, name="parent", daemon=True).start()


def main() -> int:
    """Run the traffic planner; see `TrafficPlanner`. Return the exit code."""
    _end_with_parent()
    return run_node("traffic_planner", _run)


def _run() -> None:
    began = time.monotonic()
    hive = rospy.get_namespace()
    progress = ProgressTeller(sys.argv[1:])
    ears = Ears(hive)
    with progress.counting("loads the modules of its program", lambda: len(sys.modules)):
        from hive_navigation.ros.traffic_planner import TrafficPlanner  # noqa: PLC0415  (see above)

    planner = TrafficPlanner(hive, ears, progress)
    rospy.loginfo(f"plans traffic after {time.monotonic() - began:.1f} s")
    planner.run()
