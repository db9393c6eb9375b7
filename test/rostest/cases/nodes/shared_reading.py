# SPDX-License-Identifier: BSD-3-Clause
"""One thread reads all connections: it loses nothing, keeps the order, and never blocks."""

import io
import queue
import socket
import struct
import threading

import pytest
from rospy.impl.tcpros_pubsub import TCPROSSub
from std_msgs.msg import String, UInt32

from blackboard.ros.rospy_patches.reading import Reader, SharedConnection
from hive_lab.runner.limits import PATIENCE


class Heard:
    """A node that has subscribed, and the other ends of its connections."""

    def __init__(self, reader):
        self._reader = reader
        self._messages = queue.Queue()
        self.threads = set()
        self.ended = queue.Queue()
        self._made = []

    def connect(self, name="topic", kind=String, early=b""):
        """Return the other end of a new connection, which may have sent something already."""
        ours, theirs = socket.socketpair()
        connection = SharedConnection(self._reader, TCPROSSub(name, kind, queue_size=100), name)
        connection.socket = ours
        connection.header = {"callerid": name}
        connection.set_cleanup_callback(self.ended.put)
        self._made += [theirs, connection]
        theirs.sendall(early)
        connection.receive_loop(self._hear)
        return theirs, connection

    def next(self):
        """Return the next message and its sender."""
        message, name = self._messages.get(timeout=PATIENCE)
        return message.data, name

    def close(self):
        """Close both ends of all connections."""
        for end in self._made:
            end.close()

    def _hear(self, messages, _connection):
        self.threads.add(threading.current_thread().name)
        for each in messages:
            self._messages.put((each, each._connection_header["callerid"]))  # noqa: SLF001


@pytest.fixture
def heard():
    heard = Heard(Reader())
    yield heard
    heard.close()


def wire(text):
    """Return a message in wire format."""
    buffer = io.BytesIO()
    String(text).serialize(buffer)
    data = buffer.getvalue()
    return struct.pack("<I", len(data)) + data


def test_what_comes_on_many_connections_is_read_by_one_thread(heard):
    ends = [heard.connect(f"node{number}")[0] for number in range(50)]
    before = threading.active_count()
    for number, end in enumerate(ends):
        end.sendall(wire(f"from {number}"))

    found = sorted(heard.next() for _ in ends)
    assert found == sorted((f"from {number}", f"node{number}") for number in range(50))
    assert heard.threads == {"reading"}
    assert threading.active_count() == before


def test_messages_keep_their_order_however_they_are_cut_into_pieces(heard):
    end, _ = heard.connect()
    texts = [f"{number} " + "x" * 100 * number for number in range(40)]
    stream = b"".join(map(wire, texts))
    for start in range(0, len(stream), 777):
        end.sendall(stream[start : start + 777])

    assert [heard.next()[0] for _ in texts] == texts


def test_a_message_that_never_ends_holds_nobody_up(heard):
    stuck, _ = heard.connect("stuck")
    stuck.sendall(wire("a long one")[:-1])
    end, _ = heard.connect("other")
    end.sendall(wire("here"))

    assert heard.next() == ("here", "other")


def test_what_was_said_before_anybody_read_is_heard_first(heard):
    end, _ = heard.connect(early=wire("early"))
    end.sendall(wire("later"))

    assert [heard.next()[0], heard.next()[0]] == ["early", "later"]


def test_a_connection_whose_other_end_is_gone_is_closed(heard):
    end, connection = heard.connect()
    end.sendall(wire("farewell"))
    end.close()

    assert heard.next()[0] == "farewell"
    assert heard.ended.get(timeout=PATIENCE) is connection
    assert connection.done


def test_a_connection_that_is_closed_here_makes_room_for_one_of_the_same_number(heard):
    old_end, old = heard.connect("old")
    number = old.number
    old.close()
    end, new = heard.connect("new")
    old_end.close()
    end.sendall(wire("here"))

    assert heard.next() == ("here", "new")
    assert new.number == number


def test_after_a_message_that_cannot_be_read_it_connects_anew(heard):
    end, connection = heard.connect(kind=UInt32)
    with socket.create_server(("127.0.0.1", 0)) as server:
        server.settimeout(PATIENCE)
        connection.dest_address = server.getsockname()
        end.sendall(struct.pack("<I", 1) + b"x")  # a number takes four bytes

        assert end.recv(1) == b""
        server.accept()[0].close()
