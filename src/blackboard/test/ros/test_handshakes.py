# SPDX-License-Identifier: BSD-3-Clause
"""Who calls twice is heard as who called last, in whichever order the calls are attended to."""

import functools
import io
import queue
import socket
import types

import pytest

pytest.importorskip("rospy", reason="needs ROS")

import rospy.impl.registration
from rosgraph.network import encode_ros_handshake_header, read_ros_handshake_header
from rospy.impl import tcpros, tcpros_base
from rospy.topics import Publisher, _TopicManager
from std_msgs.msg import String

from blackboard.ros.rospy_patches import reading
from blackboard.ros.rospy_patches.reading import handshake_apart

TOPIC = "/task_state"
PATIENCE = 60.0
"""Limit for what hangs [s]."""


class Door:
    """Where a node's subscribers call.

    Attributes:
        publisher: The node's.
    """

    def __init__(self, server, publisher):
        self._server = server
        self.publisher = publisher
        self._calls = queue.Queue()
        self._callers = []

    def thread(self, target, args, **_):
        """Stand in for `threading.Thread`: who calls waits until a test attends to it."""
        attend = functools.partial(target, *args)
        return types.SimpleNamespace(start=lambda: self._calls.put(attend))

    def call(self):
        """Call as the subscriber of another node; return the caller, and what attends to it."""
        caller = socket.create_connection(self._server.server_sock.getsockname(), timeout=PATIENCE)
        self._callers.append(caller)
        words = {"callerid": "/operator", "topic": TOPIC, "md5sum": String._md5sum}  # noqa: SLF001  (the only way to know it)
        caller.sendall(encode_ros_handshake_header(words))
        return caller, self._calls.get(timeout=PATIENCE)

    def close(self):
        """Hang up all calls."""
        for caller in self._callers:
            caller.close()
        self.publisher.impl.close()
        self._server.shutdown()


@pytest.fixture
def door(monkeypatch):
    topics = _TopicManager()
    monkeypatch.setattr(rospy.impl.registration, "_topic_manager", topics)
    monkeypatch.setattr(rospy.topics, "get_topic_manager", lambda: topics)
    monkeypatch.setattr(tcpros_base, "_tcpros_server", None)
    tcpros.init_tcpros()
    handshake_apart()
    server = tcpros_base.init_tcpros_server().tcp_ros_server
    door = Door(server, Publisher(TOPIC, String, queue_size=1))
    monkeypatch.setattr(reading, "threading", types.SimpleNamespace(Thread=door.thread))
    yield door
    door.close()


def test_who_hangs_up_and_calls_again_is_heard_in_whichever_order_it_is_attended_to(door):
    first, attend_to_first = door.call()
    first.close()
    second, attend_to_second = door.call()
    attend_to_second()
    attend_to_first()
    door.publisher.impl.publish(String("here"))

    with second.makefile("rb") as said:
        frames = [said.read(int.from_bytes(said.read(4), "little")) for _ in ("header", "message")]
    assert frames[1].endswith(b"here")
    assert door.publisher.get_num_connections() == 1


def test_who_calls_twice_is_heard_as_who_called_last(door):
    first, attend_to_first = door.call()
    attend_to_first()
    _, attend_to_second = door.call()
    attend_to_second()

    read_ros_handshake_header(first, io.BytesIO(), 4096)
    assert first.recv(1) == b""
    assert door.publisher.get_num_connections() == 1


def test_who_says_nothing_more_is_not_waited_for():
    class Silent(socket.socket):
        def recv(self, *_):
            pytest.fail("a socket with a timeout waits here")

    near, far = socket.socketpair()
    with far, Silent(fileno=near.detach()) as caller:
        assert not reading._has_hung_up(caller)  # noqa: SLF001
