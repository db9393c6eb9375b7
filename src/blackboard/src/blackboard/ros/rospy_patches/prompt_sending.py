# SPDX-License-Identifier: BSD-3-Clause
"""Sends what is published at once, where the receiver takes it.

rospy hands every message for every subscriber to a thread of its own and then gives up the
processor, so a message to eleven members takes eleven changes of threads before its publisher goes
on (docs/decisions/055-sending-at-once.md). Here the publisher's own thread writes to the socket,
without ever waiting. What a slow or frozen subscriber does not take goes the way of rospy's own
queue.
"""

from __future__ import annotations

import socket
import threading
from typing import Any

import rospy.topics


def send_promptly() -> None:
    """Have every connection that is made from now on send at once; after `rospy.init_node`."""
    rospy.topics.QueuedConnection = PromptConnection


class PromptConnection:
    """One subscriber's connection, in place of `rospy.impl.tcpros_pubsub.QueuedConnection`.

    A thread is there only while something waits: rospy would keep one for each connection, and a
    hive of eleven members has more than a hundred in each of them.

    Args:
        connection: To the subscriber.
        queue_size: Messages that wait for a slow subscriber; more are dropped, the oldest first.
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
        """Send a message, or queue what the subscriber does not take now.

        Raises:
            Exception: What went wrong when the thread sent an earlier one, as in rospy.
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
        """Return how many bytes were taken at once; a broken connection is the thread's matter."""
        try:
            sent: int = self._connection.socket.send(data, socket.MSG_DONTWAIT)
        except (OSError, AttributeError):  # full, broken, or closed a moment ago
            return 0
        self._connection.stat_bytes += sent
        self._connection.stat_num_msg += sent == len(data)
        return sent

    def _run(self) -> None:
        """Send what was queued, until nothing is; the rest of a message goes before all others."""
        while waiting := self._take():
            for data in waiting:
                try:
                    self._connection.write_data(data)
                except Exception as error:  # noqa: BLE001  (told to the next who publishes, as in rospy)
                    with self._lock:
                        self._error = error

    def _take(self) -> list[bytes]:
        """Return what waits; where nothing does, the thread ends."""
        with self._lock:
            waiting = [self._rest, *self._queue] if self._rest else self._queue
            self._rest, self._queue = b"", []
            if self._connection.done:
                waiting = []
            self._has_thread = bool(waiting)
            return waiting
