# SPDX-License-Identifier: BSD-3-Clause
"""Has Ctrl-C end a node from a thread of its own.

rospy shuts a node down inside the signal's handler, and Python runs that in the main thread,
between any two steps of what it was doing. Where it just held a lock that the shutdown takes too,
such as that of the queue it waits for, the node hangs until it is killed.
"""

from __future__ import annotations

import atexit
import os
import signal
import threading
from typing import TYPE_CHECKING

import rospy

if TYPE_CHECKING:
    from types import FrameType

_PATIENCE = 5.0
"""The process waits so long for the shutdown to have told the master [s]."""


def end_on_signals() -> None:
    """Have SIGINT and SIGTERM shut this node down.

    In the main thread, beside `rospy.init_node(..., disable_signals=True)`.
    """
    shutdown = _Shutdown()
    for each in (signal.SIGINT, signal.SIGTERM):
        signal.signal(each, shutdown.ask_for)
    atexit.register(shutdown.finish)
    threading.Thread(target=shutdown.wait_for_signal, name="signals", daemon=True).start()


class _Shutdown:
    def __init__(self) -> None:
        # No lock of Python's may be taken in a signal handler, and a pipe has none.
        self._asked, self._ask = os.pipe()
        self._has_begun = False
        self._is_done = threading.Event()

    def ask_for(self, number: int, _frame: FrameType | None) -> None:
        os.write(self._ask, bytes([number]))

    def wait_for_signal(self) -> None:
        number = os.read(self._asked, 1)[0]
        self._has_begun = True
        rospy.signal_shutdown(f"signal {number}")
        self._is_done.set()

    def finish(self) -> None:
        """Let a shutdown come to its end, although the main thread has ended already."""
        if self._has_begun:
            self._is_done.wait(_PATIENCE)
