# SPDX-License-Identifier: BSD-3-Clause
"""A subscriber hears every publisher that is alive, however often connecting to it has failed."""

import contextlib
import io
import os
import queue
import socket
import struct
import threading
from xmlrpc.server import SimpleXMLRPCServer

import pytest

pytest.importorskip("rospy", reason="needs ROS")

import rospy
import rospy.impl.registration
from rosgraph.network import encode_ros_handshake_header, read_ros_handshake_header
from rospy.impl import tcpros_base, tcpros_pubsub
from rospy.impl.masterslave import ROSHandler
from rospy.topics import Subscriber, _SubscriberImpl, _TopicManager
from std_msgs.msg import String

from hive_common.ros import reconnecting
from hive_common.ros.reconnecting import keep_connected

TOPIC = "/task_state"
PATIENCE = 60.0
"""Limit for what hangs [s]."""
ACCEPTED = {"callerid": "/publisher", "md5sum": String._md5sum, "type": String._type}  # noqa: SLF001  (the only way to know it)


class Publisher:
    """A node that does a number of things with its first callers, and tells the others "here".

    Args:
        acts: What it does with them, in order: functions of the caller's socket.

    Attributes:
        topics: What it says that it publishes, with types.
        answers: What it says to who wants to connect, before it says where; in order.
        is_confused: How often it fails when it is asked what it publishes.
        asked: The names of the calls that this test's node makes. Others may call: nodes of other
            tests, which look for one that has ended and had the same port.
        goes_on: Until it is set, nobody is told where to connect.
    """

    def __init__(self, *acts):
        self._acts = list(acts)
        self.topics = [[TOPIC, ACCEPTED["type"]]]
        self.answers = []
        self.is_confused = 0
        self.asked = queue.Queue()
        self.goes_on = threading.Event()
        self.goes_on.set()
        self._kept = []
        self._door = socket.create_server(("127.0.0.1", 0))
        self._api = SimpleXMLRPCServer(("127.0.0.1", 0), logRequests=False)
        self._api.register_function(self._request, "requestTopic")
        self._api.register_function(self._list, "getPublications")
        self.uri = "http://{}:{}/".format(*self._api.server_address)
        threading.Thread(target=self._receive, daemon=True).start()
        threading.Thread(target=self._api.serve_forever, args=(0.01,), daemon=True).start()

    def end(self):
        """End as a killed process would."""
        self._api.shutdown()
        self._api.server_close()
        with contextlib.suppress(OSError):
            self._door.shutdown(socket.SHUT_RDWR)
        self._door.close()

    def _note(self, caller, call):
        if caller == rospy.get_name():
            self.asked.put(call)

    def _request(self, caller, _topic, _protocols):
        self._note(caller, "requestTopic")
        self.goes_on.wait(PATIENCE)
        if self.answers:
            return self.answers.pop(0)
        return [1, "", ["TCPROS", *self._door.getsockname()]]

    def _list(self, caller):
        self._note(caller, "getPublications")
        if self.is_confused:
            self.is_confused -= 1
            raise RuntimeError("not now")
        return [1, "", self.topics]

    def _receive(self):
        with contextlib.suppress(OSError):
            while True:
                caller, _ = self._door.accept()
                act = self._acts.pop(0) if self._acts else serve
                act(caller)
                self._kept.append(caller)


def hang_up(caller):
    """Close the connection before a word is said."""
    caller.close()


def reset(caller):
    """Close it as a host does that knows nothing of it."""
    caller.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, struct.pack("ii", 1, 0))
    caller.close()


def hear_and_hang_up(caller):
    """Close it after the caller's first words."""
    read_ros_handshake_header(caller, io.BytesIO(), 4096)
    caller.close()


def say_half(caller):
    """Close it in the middle of the answer."""
    read_ros_handshake_header(caller, io.BytesIO(), 4096)
    caller.sendall(encode_ros_handshake_header(ACCEPTED)[:20])
    caller.close()


def talk_nonsense(caller):
    """Answer what is no header."""
    read_ros_handshake_header(caller, io.BytesIO(), 4096)
    caller.sendall(struct.pack("<I", 8) + b"\xff" * 8)
    caller.close()


def refuse(caller):
    """Answer as to a wrong type."""
    read_ros_handshake_header(caller, io.BytesIO(), 4096)
    caller.sendall(encode_ros_handshake_header({"error": "topic types do not match"}))
    caller.close()


def greet_and_hang_up(caller):
    """Close it as soon as the connection is made."""
    read_ros_handshake_header(caller, io.BytesIO(), 4096)
    caller.sendall(encode_ros_handshake_header(ACCEPTED))
    caller.close()


def say_what_is_no_message(caller):
    """Send a message that ends too early."""
    read_ros_handshake_header(caller, io.BytesIO(), 4096)
    caller.sendall(encode_ros_handshake_header(ACCEPTED) + struct.pack("<I", 1) + b"x")


def serve(caller):
    """Let the caller in and say something."""
    read_ros_handshake_header(caller, io.BytesIO(), 4096)
    text = struct.pack("<I", 4) + b"here"
    caller.sendall(encode_ros_handshake_header(ACCEPTED) + struct.pack("<I", len(text)) + text)


def run_timers_at_once(monkeypatch):
    """Let what a timer does begin before whoever has started it goes on."""

    class Timer(threading.Timer):
        def start(self):
            self.interval = 0.0
            super().start()
            self.join(0.2)  # it may have to wait for the one who started it

    monkeypatch.setattr(reconnecting.threading, "Timer", Timer)


class Listener:
    """A node that subscribes to the topic.

    Attributes:
        heard: What came.
    """

    def __init__(self, handler):
        self._handler = handler
        self.heard = queue.Queue()
        self.subscriber = Subscriber(TOPIC, String, lambda message: self.heard.put(message.data))

    def told_of(self, publisher):
        """Do what rospy does when the master has told of a publisher."""
        self._handler.reg_man._connect_topic_thread(TOPIC, publisher.uri)  # noqa: SLF001  (rospy's)


@pytest.fixture
def handler(monkeypatch):
    """The part of a node that connects; there is no master."""
    monkeypatch.setattr(reconnecting, "FIRST_PAUSE", 0.01)
    monkeypatch.setattr(reconnecting, "LONGEST_PAUSE", 0.01)
    monkeypatch.setattr(tcpros_base, "_use_tcp_keepalive", False)
    monkeypatch.setattr(rospy.names, "_caller_id", f"/listener_{os.getpid()}")
    for place, name in (
        (_SubscriberImpl, "_remove_connection"),
        (tcpros_pubsub, "robust_connect_subscriber"),
    ):
        monkeypatch.setattr(place, name, getattr(place, name))
    monkeypatch.setattr(rospy.core, "_preshutdown_hooks", [])
    handler = ROSHandler("/listener", "http://127.0.0.1:1")
    topics, listeners = _TopicManager(), rospy.impl.registration.RegistrationListeners()
    listeners.listeners.append(handler.reg_man)
    monkeypatch.setattr(rospy.impl.registration, "_topic_manager", topics)
    monkeypatch.setattr(rospy.impl.registration, "_registration_listeners", listeners)
    monkeypatch.setattr(rospy.topics, "get_topic_manager", lambda: topics)
    before = socket.getdefaulttimeout()
    yield handler
    topics.close_all()
    while wait_for_timers():
        pass
    socket.setdefaulttimeout(before)  # rospy sets one


@pytest.fixture
def listener(handler):
    keep_connected.__wrapped__()
    return Listener(handler)


@pytest.fixture
def publisher():
    """Return a function that makes a publisher from what it does with its first callers."""
    made = []

    def make(*acts):
        made.append(Publisher(*acts))
        return made[-1]

    yield make
    for each in made:
        each.end()


@pytest.mark.parametrize(
    "act",
    [
        hang_up,
        reset,
        hear_and_hang_up,
        say_half,
        talk_nonsense,
        say_what_is_no_message,
        greet_and_hang_up,
    ],
    ids=lambda act: act.__name__,
)
def test_a_publisher_that_drops_the_first_connections_is_heard(listener, publisher, act):
    listener.told_of(publisher(act, act, act))

    assert listener.heard.get(timeout=PATIENCE) == "here"


def test_a_publisher_whose_connection_took_too_long_is_heard(listener, publisher, monkeypatch):
    connect, fails = tcpros_base.TCPROSTransport.connect, [True, True]

    def connect_late(self, *where, **options):
        if fails:
            fails.pop()
            self.socket = socket.socket()
            raise rospy.exceptions.TransportInitError("timed out")
        connect(self, *where, **options)

    monkeypatch.setattr(tcpros_base.TCPROSTransport, "connect", connect_late)
    listener.told_of(publisher())

    assert listener.heard.get(timeout=PATIENCE) == "here"


def test_a_publisher_that_does_not_say_at_once_where_it_is_is_heard(listener, publisher):
    speaker = publisher()
    speaker.answers = [[0, "not yet", []], [-1, "not yet", []]]
    listener.told_of(speaker)

    assert listener.heard.get(timeout=PATIENCE) == "here"


def test_a_publisher_that_does_not_say_whether_it_is_one_is_asked_again(listener, publisher):
    speaker = publisher(hang_up)
    speaker.is_confused = 2
    listener.told_of(speaker)

    assert listener.heard.get(timeout=PATIENCE) == "here"


def test_a_publisher_that_is_none_any_more_is_asked_and_then_left_alone(listener, publisher):
    speaker = publisher(hang_up)
    speaker.topics = []
    listener.told_of(speaker)

    assert speaker.asked.get(timeout=PATIENCE) == "requestTopic"
    assert speaker.asked.get(timeout=PATIENCE) == "getPublications"
    other = publisher()
    listener.told_of(other)
    assert listener.heard.get(timeout=PATIENCE) == "here"
    # A call whose answer got lost is made again; who asks for ever always has a timer.
    assert any(not wait_for_timers() for _ in range(100))


def wait_for_timers():
    """Wait until what timers do is done; return whether there were any."""
    timers = [thread for thread in threading.enumerate() if isinstance(thread, threading.Timer)]
    for timer in timers:
        timer.join(PATIENCE)
    return bool(timers)


def test_a_loss_is_seen_by_who_connects_again_at_once(listener, publisher, monkeypatch):
    """A connection is taken off the list only after rospy has told of the loss."""
    run_timers_at_once(monkeypatch)
    listener.told_of(publisher(hang_up))

    assert listener.heard.get(timeout=PATIENCE) == "here"


def test_who_is_refused_does_not_ask_again(listener, publisher, monkeypatch):
    later = []
    monkeypatch.setattr(reconnecting._Keeper, "attempt_later", lambda _, *link: later.append(link))  # noqa: SLF001
    before = set(threading.enumerate())
    listener.told_of(publisher(refuse))
    for thread in set(threading.enumerate()) - before:
        if thread.name == TOPIC:  # the one in which rospy connects
            thread.join(PATIENCE)
    listener.told_of(publisher())

    assert listener.heard.get(timeout=PATIENCE) == "here"
    assert later == []


def test_news_of_a_publisher_that_come_twice_make_one_connection(listener, publisher):
    speaker = publisher()
    speaker.goes_on.clear()
    first = threading.Thread(target=listener.told_of, args=(speaker,))
    first.start()
    assert speaker.asked.get(timeout=PATIENCE) == "requestTopic"
    listener.told_of(speaker)
    speaker.goes_on.set()
    first.join(PATIENCE)

    assert listener.heard.get(timeout=PATIENCE) == "here"
    assert speaker.asked.empty()


def test_the_pauses_double_and_begin_anew_after_a_time_without_a_loss(monkeypatch):
    now, pauses = [0.0], []
    monkeypatch.setattr(reconnecting.time, "monotonic", lambda: now[0])
    keeper = reconnecting._Keeper(None)  # noqa: SLF001  (there is one in each node)
    for passed in (0.0, 1.0, 2.0, 4.0, 8.0, 16.0, 32.0, 90.0, 121.0):
        now[0] += passed
        pauses.append(keeper._next_pause((TOPIC, "http://robot:1/")))  # noqa: SLF001

    assert pauses == [0.5, 1.0, 2.0, 4.0, 8.0, 16.0, 30.0, 30.0, 0.5]
