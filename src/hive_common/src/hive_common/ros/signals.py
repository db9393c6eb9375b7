# SPDX-License-Identifier: BSD-3-Clause
"""Makes a process a node that is shut down on Ctrl-C from a thread of its own.

rospy shuts a node down inside the signal handler, which Python runs in the main thread between any
two steps. If the main thread holds a lock that the shutdown needs, such as that of its queue, or
of its connection to the master while it asks for a parameter, the node hangs until it is killed.
"""

from __future__ import annotations

import atexit
import os
import signal
import sys
import threading
from typing import TYPE_CHECKING

import rospy
import rospy.impl.paramserver

if TYPE_CHECKING:
    from types import FrameType, TracebackType

_ROSOUT_TOPICS = "/rosout_disable_topics_generation"
"""Whether the topics of a node are left out of what it logs on rosout."""

_PATIENCE = 5.0  # time that the process waits for the shutdown to tell the master [s]


def init_node(name: str, *, anonymous: bool = False) -> None:
    """Make this process a node that SIGINT and SIGTERM shut down; call it in the main thread.

    The main thread is not interrupted: it has to look at `rospy.is_shutdown`.

    Args:
        name: The node's name; arguments of the command line may give it another one.
        anonymous: Whether to make the name one of its own.
    """
    shutdown = _Shutdown()
    for each in (signal.SIGINT, signal.SIGTERM):
        signal.signal(each, shutdown.ask_for)
    atexit.register(shutdown.finish)
    sys.excepthook = _say_unless_shut_down
    threading.excepthook = _say_of_threads_unless_shut_down
    threading.Thread(target=shutdown.wait_for_signal, name="signals", daemon=True).start()
    rospy.init_node(name, anonymous=anonymous, disable_signals=True)
    _log_without_the_master()


def _log_without_the_master() -> None:
    """Have no line that is logged ask the master whether rosout is told the node's topics.

    Unless that parameter is set, rospy subscribes to it anew with each line, which the master
    takes for a registration. A node that is shut down because a new one has taken its name, and
    logs a last line, would have the master shut the new one down. The master still tells when the
    parameter changes.
    """
    omitted = rospy.get_param_cached(_ROSOUT_TOPICS, False)
    rospy.impl.paramserver.get_param_server_cache().set(_ROSOUT_TOPICS, omitted)


def is_shutting_down() -> bool:
    """Return whether the node is shut down, or is about to be: its topics close before."""
    return bool(rospy.is_shutdown() or rospy.core.is_shutdown_requested())


def _say_unless_shut_down(
    kind: type[BaseException], error: BaseException, trace: TracebackType | None
) -> None:
    """Print an error that ends the main thread, unless it was at work when its topics closed."""
    if not (issubclass(kind, rospy.ROSException) and is_shutting_down()):
        sys.__excepthook__(kind, error, trace)


def _say_of_threads_unless_shut_down(what: threading.ExceptHookArgs) -> None:
    """Do the same for another thread."""
    if not (issubclass(what.exc_type, rospy.ROSException) and is_shutting_down()):
        threading.__excepthook__(what)


class _Shutdown:
    def __init__(self) -> None:
        # A signal handler must not take a lock of Python's; a pipe has none.
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
        """Let a shutdown finish even though the main thread has ended."""
        if self._has_begun:
            self._is_done.wait(_PATIENCE)
