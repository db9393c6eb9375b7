# SPDX-License-Identifier: BSD-3-Clause
"""Accepts callers one thread each, reads all connections in one thread, and decodes on demand.

`handshake_apart`: rospy 1.15 accepts connections in one thread, which also reads who calls and
why. A caller that freezes, or whose host vanishes, before its first words blocks that thread: a
robot that had just come back stayed shut out for a minute, and its hive had no majority. Here each
caller has a thread for its first words. rospy calls twice where the master tells of a publisher
twice in quick succession; it hangs up the first call and then makes the second. Whoever attended
to them in the other order dropped the second, and that subscriber heard nothing any more. So a
caller who has hung up is sent away.

`read_together`: rospy 1.15 has a thread for each topic and each node heard on it. Every member
listens to all others on eleven topics: ten robots had 120 threads each, and fifty on one machine
needed 29,000 of the 32,768 that Linux allows (docs/decisions/042). Here one thread reads all.

`unread`: rospy 1.15 decodes every message. What an operator posts reaches every member but matters
to the leader only, and decoding it is most of the cost of hearing it. Here a message stays bytes
until somebody asks for it.
"""

from __future__ import annotations

import contextlib
import functools
import resource
import select
import socket
import threading
from typing import TYPE_CHECKING, Any

import rospy.impl.tcpros_pubsub
from rospy.exceptions import TransportTerminated
from rospy.impl.tcpros_base import TCPROSTransport, init_tcpros_server, recv_buff

if TYPE_CHECKING:
    from collections.abc import Callable

    _Hear = Callable[[list[Any], Any], None]


def handshake_apart() -> None:
    """Give each caller a thread for its handshake; call it after `rospy.init_node`."""
    server = init_tcpros_server()
    server.start_server()
    take, attend = server.tcp_ros_server.inbound_handler, server.topic_connection_handler
    in_turn = threading.Lock()

    def attend_in_turn(caller: socket.socket, address: tuple[str, int], header: Any) -> Any:  # noqa: ANN401  (rospy's)
        with in_turn:
            if not _has_hung_up(caller):
                return attend(caller, address, header)
        caller.close()
        return None

    def take_apart(caller: socket.socket, address: tuple[str, int]) -> None:
        threading.Thread(
            target=take, args=(caller, address), name=f"handshake {address}", daemon=True
        ).start()

    server.topic_connection_handler = attend_in_turn
    server.tcp_ros_server.inbound_handler = take_apart


def _has_hung_up(caller: socket.socket) -> bool:
    """Return whether the other end is closed; a subscriber says nothing after its first words."""
    readable = select.poll()
    try:
        readable.register(caller, select.POLLIN)
        # A socket with a timeout waits for it in `recv`, whatever the flags, so it is asked first.
        return bool(readable.poll(0)) and not caller.recv(1, socket.MSG_PEEK)
    except (OSError, ValueError):
        return True


def read_together() -> None:
    """Read all connections from now on in one thread; call it after `rospy.init_node`.

    Callbacks of subscribers must not wait for each other.
    """
    # Each connection is an open file; about forty members reach the usual limit.
    most = resource.getrlimit(resource.RLIMIT_NOFILE)[1]
    resource.setrlimit(resource.RLIMIT_NOFILE, (most, most))
    rospy.impl.tcpros_pubsub.TCPROSTransport = functools.partial(SharedConnection, Reader())


@functools.cache
def unread(kind: type) -> type:
    """Return a stand-in for a message class whose messages stay bytes until `read` is called.

    `read` returns the message; it raises genpy.DeserializationError if the bytes are not one.
    """

    class Unread(kind):  # type: ignore[misc]  # genpy classes are not typed
        __slots__ = ("_data",)

        def __init__(self) -> None:
            """Leave out all fields, which the constructor of the message class would fill."""

        def deserialize(self, data: bytes) -> Any:  # noqa: ANN401  (itself, as genpy's does)
            self._data = data
            return self

        def read(self) -> Any:  # noqa: ANN401  (a message of the class)
            return kind().deserialize(self._data)

    return Unread


class Reader:
    """One thread that reads many connections."""

    def __init__(self) -> None:
        self._ready = select.epoll()
        self._open: dict[int, tuple[SharedConnection, _Hear]] = {}
        threading.Thread(target=self._run, name="reading", daemon=True).start()

    def add(self, connection: SharedConnection, hear: _Hear) -> None:
        """Read a connection until it is closed, beginning in this thread with what has arrived.

        `hear` is called with the messages and the connection.
        """
        if self._read(connection, hear):
            with contextlib.suppress(OSError, ValueError, AttributeError):  # just closed
                connection.number = connection.socket.fileno()
                self._open[connection.number] = connection, hear
                self._ready.register(connection.number, select.EPOLLIN)

    def drop(self, connection: SharedConnection) -> None:
        """Stop reading a connection; harmless if it is not read here."""
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
        """Hand over what has arrived; return whether more may come."""
        try:
            messages = connection.read()
        except TransportTerminated:
            connection.close()
            return False
        except Exception:  # noqa: BLE001  (whatever it is, rospy then reconnects)
            self.drop(connection)
            if not connection.done:
                reconnect = connection.reconnect
                threading.Thread(target=reconnect, args=(hear,), daemon=True).start()
            return False
        if messages:
            hear(messages, connection)
        return True


class SharedConnection(TCPROSTransport):  # type: ignore[misc]  # rospy is not typed
    """The connection to one publisher, in place of `rospy.impl.tcpros_base.TCPROSTransport`.

    Args:
        reader: Reads it.
        arguments: rospy's own.

    Attributes:
        number: Its file descriptor, once the reader has it.
    """

    socket: Any  # whatever rospy has made; None while it is not connected

    def __init__(self, reader: Reader, *arguments: Any) -> None:  # noqa: ANN401  (rospy's)
        super().__init__(*arguments)
        self._reader = reader
        self.number = -1

    def receive_loop(self, msgs_callback: _Hear) -> None:
        """Leave the connection to the reader; the thread in which rospy made it ends."""
        self._reader.add(self, msgs_callback)

    def read(self) -> list[Any]:
        """Return the messages that have arrived completely.

        Raises:
            TransportTerminated: The publisher has ended.
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

    def reconnect(self, hear: _Hear) -> None:
        """Connect again and read in this thread, as rospy does after an unreadable message."""
        with contextlib.suppress(OSError, AttributeError):
            self.socket.close()
        self.socket = None
        super().receive_loop(hear)

    def close(self) -> None:
        """Close the connection; its file descriptor may be reused at once."""
        self._reader.drop(self)
        super().close()
