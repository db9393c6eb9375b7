# SPDX-License-Identifier: BSD-3-Clause
"""Reads all that a node hears in one thread.

rospy keeps a thread for each topic and each node that is heard on it. Every member of a hive hears
all others on eleven topics, so fifty robots on one machine would take thirty thousand threads
(docs/decisions/072-one-thread-reads.md).
"""

from __future__ import annotations

import contextlib
import functools
import resource
import select
import threading
from typing import TYPE_CHECKING, Any

import rospy.impl.tcpros_pubsub
from rospy.exceptions import TransportTerminated
from rospy.impl.tcpros_base import TCPROSTransport, recv_buff

if TYPE_CHECKING:
    from collections.abc import Callable

    _Hear = Callable[[list[Any], Any], None]


def read_together() -> None:
    """Have what is heard over connections made from now on read by one thread.

    To be called after `rospy.init_node`. Callbacks of subscribers must not wait for each other.
    """
    # Each connection is an open file; the usual limit is reached with about forty members.
    most = resource.getrlimit(resource.RLIMIT_NOFILE)[1]
    resource.setrlimit(resource.RLIMIT_NOFILE, (most, most))
    rospy.impl.tcpros_pubsub.TCPROSTransport = functools.partial(SharedConnection, Reader())


class Reader:
    """One thread that reads many connections."""

    def __init__(self) -> None:
        self._ready = select.epoll()
        self._open: dict[int, tuple[SharedConnection, _Hear]] = {}
        threading.Thread(target=self._run, name="reading", daemon=True).start()

    def add(self, connection: SharedConnection, hear: _Hear) -> None:
        """Read a connection until it is closed; here what the other side has sent already.

        Args:
            connection: It.
            hear: Called with the messages and the connection.
        """
        if self._read(connection, hear):
            with contextlib.suppress(OSError, ValueError, AttributeError):  # just closed
                connection.number = connection.socket.fileno()
                self._open[connection.number] = connection, hear
                self._ready.register(connection.number, select.EPOLLIN)

    def drop(self, connection: SharedConnection) -> None:
        """Read a connection no longer; harmless for one that is not read here."""
        known = self._open.get(connection.number)
        if known is not None and known[0] is connection:
            del self._open[connection.number]
            with contextlib.suppress(OSError):
                self._ready.unregister(connection.number)

    def _run(self) -> None:
        while True:
            for number, _ in self._ready.poll():
                known = self._open.get(number)
                if known is not None:
                    self._read(*known)

    def _read(self, connection: SharedConnection, hear: _Hear) -> bool:
        """Hand over what is there now; return whether there may be more."""
        try:
            messages = connection.read()
        except TransportTerminated:
            connection.close()
            return False
        except Exception:  # noqa: BLE001  (whatever it is: rospy connects anew then)
            self.drop(connection)
            if not connection.done:
                begin = connection.begin_anew
                threading.Thread(target=begin, args=(hear,), daemon=True).start()
            return False
        if messages:
            hear(messages, connection)
        return True


class SharedConnection(TCPROSTransport):  # type: ignore[misc]  # rospy is not typed
    """What a topic is heard over, in place of `rospy.impl.tcpros_base.TCPROSTransport`.

    Args:
        reader: Who reads it.
        arguments: As for rospy's.

    Attributes:
        number: The number of its open file, once it is read.
    """

    socket: Any
    """Whatever rospy has made; None while it is not connected."""

    def __init__(self, reader: Reader, *arguments: Any) -> None:  # noqa: ANN401  (rospy's)
        super().__init__(*arguments)
        self._reader = reader
        self.number = -1

    def receive_loop(self, msgs_callback: _Hear) -> None:
        """Leave the connection to the reader; rospy's thread that has made it ends then."""
        self._reader.add(self, msgs_callback)

    def read(self) -> list[Any]:
        """Return the messages that are complete with what is there now.

        Raises:
            TransportTerminated: The other side has ended.
            Exception: A message cannot be read, or the connection was closed a moment ago.
        """
        self.socket.setblocking(False)
        self.stat_bytes += recv_buff(self.socket, self.read_buff, self.protocol.buff_size)
        messages: list[Any] = []
        self.protocol.read_messages(self.read_buff, messages, self.socket)
        for message in messages:
            message._connection_header = self.header  # noqa: SLF001  (rospy has no other way)
        if messages and self.is_latched:
            self.latch = messages[-1]
        self.stat_num_msg += len(messages)
        return messages

    def begin_anew(self, hear: _Hear) -> None:
        """Connect again and read in this thread, as rospy does after a message it cannot read."""
        with contextlib.suppress(OSError, AttributeError):
            self.socket.close()
        self.socket = None
        super().receive_loop(hear)

    def close(self) -> None:
        """Close the connection; its number may be another's at once."""
        self._reader.drop(self)
        super().close()
