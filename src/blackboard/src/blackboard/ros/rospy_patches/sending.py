# SPDX-License-Identifier: BSD-3-Clause
"""Sends a message at once, and only to the subscribers that it concerns.

`PromptConnection` replaces rospy's `QueuedConnection`. rospy 1.15 hands every message for every
subscriber to a thread of its own and then yields the processor, so a message to eleven members
takes eleven thread switches before the publisher goes on. A profile of the blackboard during
auctions showed a third of its main thread's time there (docs/decisions/042). Here the publishing
thread writes to the socket and never waits; what a slow or frozen subscriber does not accept goes
through a queue, as in rospy.

`Audience` replaces "publish to everyone". Every voter is connected to all other members on every
topic, so that any of them can lead at once and without the ROS master. Most messages concern the
leader alone, and reading a message costs a member ten times as much as sending it costs. With ten
robots, leaving members out cut the median time from posting a task to its assignment from 79 to
31 ms (docs/decisions/070).
"""

from __future__ import annotations

import socket
import threading
from typing import TYPE_CHECKING, Any

import rospy.topics

if TYPE_CHECKING:
    from collections.abc import Callable, Collection, Sequence

_NAMELESS = "unknown"
"""rospy's name for a publisher that has not said its own yet."""


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


class Audience:
    """Knows which subscribers are members, and leaves out those that a message does not concern.

    To a voter, members are the nodes that publish on `bb_ack` and subscribe to `bb_entries`. To a
    learner, which talks to voters only, they are those that publish on `bb_entries` and subscribe
    to `bb_ack`. A subscriber that is not known as a member yet gets everything.

    Args:
        node_of: Returns the name of the node that speaks for a robot or a member; empty if
            unknown.

    Attributes:
        speaks: The publisher to members; None if there is none.
        listens: The subscriber to members; None if there is none.
    """

    def __init__(self, node_of: Callable[[str], str]) -> None:
        self._node_of = node_of
        self.speaks: rospy.Publisher | None = None
        self.listens: rospy.Subscriber | None = None
        self._links: tuple[Sequence[Any], Sequence[Any]] = ((), ())
        self._members: frozenset[str] = frozenset()

    def tell(self, publisher: rospy.Publisher, message: object, to: Collection[str]) -> None:
        """Publish to some members, and to everyone who is not a member.

        `to` holds names of members, which begin with a slash, or of robots.
        """
        nodes = {self._node(name) for name in to if name}
        impl = publisher.impl
        if "" in nodes or impl is None:
            publisher.publish(message)
            return
        left_out = self._known_members() - nodes
        chosen = [each for each in impl.connections if each.endpoint_id not in left_out]
        impl.acquire()
        try:
            impl.publish(message, connection_override=_Several(chosen))
        finally:
            impl.release()

    def _node(self, name: str) -> str:
        """Return the node of a member or a robot; a member that shares no process is a node."""
        return self._node_of(name) or (name if name.startswith("/") else "")

    def _known_members(self) -> frozenset[str]:
        """Return the names of the members; computed again only if rospy's connections changed."""
        if self.speaks is None or self.listens is None:
            return frozenset()
        there, here = self.speaks.impl.connections, self.listens.impl.connections
        if self._links[0] is not there or self._links[1] is not here:
            speak = frozenset(each.callerid_pub for each in here)
            self._members = speak & {each.endpoint_id for each in there}
            if _NAMELESS not in speak:
                self._links = there, here
        return self._members


class _Several:
    """Some of a publisher's connections, given to rospy as its one `connection_override`."""

    endpoint_id = "several"

    def __init__(self, connections: Sequence[Any]) -> None:
        self._connections = connections

    def write_data(self, data: bytes) -> None:
        """Send to all; close a connection that is broken, as rospy does."""
        for each in self._connections:
            try:
                each.write_data(data)
            except Exception:  # noqa: BLE001  (whatever it is, rospy then drops the connection)
                each.close()
