# SPDX-License-Identifier: BSD-3-Clause
"""Sends a message at once, in the thread that publishes it.

`PromptConnection` replaces rospy's `QueuedConnection`. rospy 1.15 hands every message for every
subscriber to a thread of its own and then yields the processor, so a message to eleven members
takes eleven thread switches before the publisher goes on. A profile of the blackboard during
auctions showed a third of its main thread's time there; a simulator, which tells twenty nodes the
time, takes half the processor time without (docs/decisions/042). Here the publishing thread writes
to the socket and never waits; what a slow or frozen subscriber does not accept goes through a
queue, as in rospy.
"""

from __future__ import annotations

import socket
import threading
from typing import Any

import rospy.topics


def send_promptly() -> None:
    """Make all connections from now on send at once; call it after `rospy.init_node`."""
    rospy.topics.QueuedConnection = PromptConnection


class PromptConnection:
    """The connection to one subscriber, in place of `rospy.impl.tcpros_pubsub.QueuedConnection`.

    It has a thread only while messages wait. rospy keeps one for each connection, which is more
    than a hundred in each member of a hive of eleven.

    Args:
        connection: rospy's transport to the subscriber.
        queue_size: Messages that wait for a slow subscriber; then the oldest are dropped.
    """

    def __init__(self, connection: Any, queue_size: int) -> None:  # noqa: ANN401  (rospy's transport)
        self._connection = connection
        self._queue_size = queue_size
        self._queue: list[bytes] = []
        self._rest = b""
        self._has_thread = False
        self._error: Exception | None = None
        self._lock = threading.Lock()

    def __getattr__(self, name: str) -> Any:  # noqa: ANN401  (whatever rospy asks the transport for)
        if name.startswith("__"):
            raise AttributeError(name)
        return getattr(self._connection, name)

    def write_data(self, data: bytes) -> bool:
        """Send a message, or queue what the subscriber does not accept now.

        Raises:
            Exception: The thread failed to send an earlier message, as in rospy.
        """
        with self._lock:
            if self._error:
                error, self._error = self._error, None
                raise error
            if not self._has_thread:
                self._rest = data[self._send(data) :]
                if self._rest:
                    self._has_thread = True
                    threading.Thread(target=self._run, name="sending", daemon=True).start()
            else:
                if 0 < self._queue_size <= len(self._queue):
                    del self._queue[0]
                self._queue.append(data)
        return True

    def _send(self, data: bytes) -> int:
        """Return how many bytes were accepted at once; the thread handles broken connections."""
        try:
            sent: int = self._connection.socket.send(data, socket.MSG_DONTWAIT)
        except (OSError, AttributeError):  # full, broken, or closed a moment ago
            return 0
        self._connection.stat_bytes += sent
        self._connection.stat_num_msg += sent == len(data)
        return sent

    def _run(self) -> None:
        """Send what is queued until nothing is; the rest of a begun message comes first."""
        while waiting := self._take():
            for data in waiting:
                try:
                    self._connection.write_data(data)
                except Exception as error:  # noqa: BLE001  (raised at the next publish, as in rospy)
                    with self._lock:
                        self._error = error

    def _take(self) -> list[bytes]:
        """Return what is queued; if nothing is, the thread ends."""
        with self._lock:
            waiting = [self._rest, *self._queue] if self._rest else self._queue
            self._rest, self._queue = b"", []
            if self._connection.done:
                waiting = []
            self._has_thread = bool(waiting)
            return waiting
