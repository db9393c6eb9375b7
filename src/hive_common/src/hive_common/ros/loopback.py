# SPDX-License-Identifier: BSD-3-Clause
"""Lets a node hear its own topics without a socket (docs/decisions/092).

rospy connects a node that subscribes to what it publishes with itself over TCP, like any other. A
process that hosts the parts of many robots hears itself most of the time. Here bytes go through
a queue to one thread, which decodes them and calls the subscribers back. Written for rospy 1.15.15
(Debian 12).
"""

from __future__ import annotations

import queue
import threading
from typing import Any

import rospy
from rospy.impl.registration import RegManager, get_topic_manager
from rospy.impl.transport import INBOUND, OUTBOUND, Transport
from rospy.topics import _TopicImpl

_LENGTH = 4
"""A serialized message begins with its length in so many bytes."""


def hear_own_topics() -> None:
    """Connect this node with itself without sockets; call it after `rospy.init_node`."""
    own, connect, courier = rospy.get_node_uri(), RegManager._connect_topic_thread, _Courier()  # noqa: SLF001  (rospy has no other place for it)

    def connect_topic(manager: RegManager, topic: str, uri: str) -> None:
        if uri == own:
            courier.link(topic)
        else:
            connect(manager, topic, uri)

    RegManager._connect_topic_thread = connect_topic  # noqa: SLF001  (see above)


class _Courier:
    """The thread that carries messages from this process's publishers to its subscribers."""

    def __init__(self) -> None:
        self._queue: queue.SimpleQueue[tuple[_Inlet, bytes]] = queue.SimpleQueue()
        self._lock = threading.Lock()
        threading.Thread(target=self._run, name="loopback", daemon=True).start()

    def link(self, topic: str) -> None:
        """Connect publisher and subscriber of a topic, if both are there and not connected."""
        manager = get_topic_manager()
        with self._lock:
            publisher, subscriber = manager.pubs.get(topic), manager.subs.get(topic)
            uri = rospy.get_node_uri()
            if publisher is None or subscriber is None or subscriber.has_connection(uri):
                return
            inlet = _Inlet(topic, subscriber, is_latched=publisher.is_latch)
            outlet = _Outlet(topic, lambda data: self._queue.put((inlet, data)))
            inlet.other, outlet.other = outlet, inlet
            _TopicImpl.add_connection(subscriber, inlet)
            _TopicImpl.add_connection(publisher, outlet)
        with publisher.publock:
            if publisher.is_latch and publisher.latch is not None:
                publisher.publish(publisher.latch, connection_override=outlet)

    def _run(self) -> None:
        while True:
            inlet, data = self._queue.get()
            inlet.deliver(data)


class _End(Transport):  # type: ignore[misc]  # rospy is not typed
    """One end of a connection within this process; it ends with the other."""

    transport_type = "LOOPBACK"
    other: _End

    def close(self) -> None:
        """Close both ends; rospy may call this again while it does."""
        if not self.done:
            super().close()
            self.other.close()

    def get_transport_info(self) -> str:
        """Return what rosnode shows of the connection."""
        return f"LOOPBACK connection of topic {self.name}"


class _Outlet(_End):
    """The publisher's end."""

    def __init__(self, topic: str, put: Any) -> None:  # noqa: ANN401  (a function of bytes)
        super().__init__(OUTBOUND, topic)
        self.endpoint_id = rospy.get_name()
        self._put = put

    def write_data(self, data: bytes) -> bool:
        """Hand over a message."""
        self.stat_bytes += len(data)
        self.stat_num_msg += 1
        self._put(data)
        return True


class _Inlet(_End):
    """The subscriber's end, with what rospy asks of a connection to a publisher."""

    def __init__(self, topic: str, subscriber: Any, *, is_latched: bool) -> None:  # noqa: ANN401  (rospy's)
        super().__init__(INBOUND, topic)
        self.endpoint_id = rospy.get_node_uri()
        self.callerid_pub = rospy.get_name()
        self.latch: Any = None
        self.socket = None
        self._header = {"callerid": self.callerid_pub, "topic": topic}
        self._subscriber = subscriber
        self._is_latched = is_latched

    def deliver(self, data: bytes) -> None:
        """Decode a message and call the subscribers back."""
        kind = self._subscriber.data_class
        if kind is None or self.done:
            return
        message = kind().deserialize(data[_LENGTH:])
        message._connection_header = self._header  # noqa: SLF001  (rospy has no other way)
        self.stat_bytes += len(data)
        self.stat_num_msg += 1
        if self._is_latched:
            self.latch = message
        self._subscriber.receive_callback([message], self)
