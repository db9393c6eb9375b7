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

    Args:
        connection: To the subscriber.
        queue_size: Messages that wait for a slow subscriber; more are dropped, the oldest first.
    """

    def __init__(self, connection: Any, queue_size: int) -> None:  # noqa: ANN401  (rospy's transport)
        self._connection = connection
        self._queue_size = queue_size
        self._queue: list[bytes] = []
        self._rest = b""
        self._is_free = True
        self._error: Exception | None = None
        self._changed = threading.Condition()
        connection.set_cleanup_callback(self._closed)
        threading.Thread(target=self._run, name="sending", daemon=True).start()

    def __getattr__(self, name: str) -> Any:  # noqa: ANN401  (whatever rospy asks the transport for)
        if name.startswith("__"):
            raise AttributeError(name)
        return getattr(self._connection, name)

    def write_data(self, data: bytes) -> bool:
        """Send a message, or queue what the subscriber does not take now.

        Raises:
            Exception: What went wrong when the thread sent an earlier one, as in rospy.
        """
        with self._changed:
            if self._error:
                error, self._error = self._error, None
                raise error
            if self._is_free and not self._queue and not self._rest:
                self._rest = data[self._send(data) :]
                if not self._rest:
                    return True
            else:
                if 0 < self._queue_size <= len(self._queue):
                    del self._queue[0]
                self._queue.append(data)
            self._changed.notify()
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

    def _closed(self, _connection: object) -> None:
        with self._changed:
            self._changed.notify()

    def _run(self) -> None:
        """Send what was queued; the rest of a message goes before all others."""
        while not self._connection.done:
            with self._changed:
                self._is_free = True
                while not (self._rest or self._queue or self._connection.done):
                    self._changed.wait()
                self._is_free = False
                waiting = [self._rest, *self._queue] if self._rest else self._queue
                self._rest, self._queue = b"", []
            for data in waiting:
                try:
                    self._connection.write_data(data)
                except Exception as error:  # noqa: BLE001  (told to the next who publishes, as in rospy)
                    with self._changed:
                        self._error = error
