# SPDX-License-Identifier: BSD-3-Clause
"""What a connection over Zenoh does to messages while its cable, its far end or its room is gone.

`hive_lab.fault_schedules.zenoh_network` simulates the same; what fails here is to change there.
"""

import signal
import subprocess
import sys
import threading
from types import SimpleNamespace

import pytest
from launching import wait_until_empty
from live_network import OFFICE, network_of

from blackboard.consensus.messages import AppendReply
from blackboard.domain.record import TaskUpdate
from blackboard.domain.talker import BB_ACK, TASK_STATE
from blackboard.domain.task import TaskState
from blackboard.zenoh.access import Role
from blackboard.zenoh.link import ZenohLink
from blackboard.zenoh.opening import open_session
from blackboard.zenoh.session import Endpoints, session_config
from fleet_manager.certs.site import Site

URGENT, ORDINARY = BB_ACK, TASK_STATE
HOST = "robot2"
PORT = 61_990
FILLER = "x" * 120
MORE_THAN_WAITS = 30_000
"""Messages; at about 200 B each they are more than the kernel and Zenoh keep for a connection."""

HEARER = """
import os
import sys
from pathlib import Path
from types import SimpleNamespace

from blackboard.codec.tables import WIRES
from blackboard.domain.talker import BB_ACK, TASK_STATE
from blackboard.zenoh.link import ZenohLink
from blackboard.zenoh.opening import open_session
from blackboard.zenoh.session import Endpoints, session_config

folder, endpoint, speaker = sys.argv[1:]


def receive(arrival):
    value = WIRES[arrival.topic].from_msg(arrival.read())
    number = value.version if arrival.topic == BB_ACK else value.assignment
    os.write(1, f"{arrival.topic} {number}\\n".encode())  # at once: Zenoh calls from two threads


ends = Endpoints((endpoint,), (speaker,))
session = open_session(session_config(ends, Path(folder)))
link = ZenohLink(session, "site", "robot2", ())
link.attach(SimpleNamespace(receive=receive, after=lambda *_: None, call=lambda action: None))
for topic in (BB_ACK, TASK_STATE):
    link.listen(topic, topic)
sys.stdin.read()
"""
"""Prints the topic and the number of each message that it hears, until its input ends."""


UNHEARD = SimpleNamespace(receive=lambda _: None, after=lambda *_: None, call=lambda _: None)
"""A talker that hears nothing."""


class Line:
    """A speaker in the office, and a process on another host that hears it.

    Attributes:
        heard: The numbers of the messages that arrived, in that order, each with its topic.
    """

    def __init__(self, network, certificates):
        here, there = (f"tls/{each}:{PORT}" for each in (OFFICE, network.address(HOST)))
        folder = str(certificates / HOST)
        words = (*network.prefix(HOST), sys.executable, "-c", HEARER, folder, there, here)
        self.heard = []
        self._hearer = subprocess.Popen(
            words, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True
        )
        self._reader = threading.Thread(target=self._read)
        self._reader.start()
        ends = Endpoints((here,), (there,))
        self._session = open_session(session_config(ends, certificates / "robot1"))
        self._link = ZenohLink(self._session, "site", "robot1", (URGENT, ORDINARY))
        self._link.attach(UNHEARD)

    def wait_until_connected(self):
        """Return once what is said is listened to."""
        topics = (URGENT, ORDINARY)
        wait_until_empty(lambda: [each for each in topics if not self._link.is_heard(each)])

    def wait_until_ended(self):
        """Return once the connection is given up."""
        wait_until_empty(self._session.info.links)

    def say(self, topic, *numbers):
        """Send a message for each number."""
        for number in numbers:
            if topic == URGENT:
                self._link.publish("robot1", topic, AppendReply("robot1", 1, number, 0.0), None)
            else:
                update = TaskUpdate(
                    "T1", TaskState.STARTED, "robot1", assignment=number, reason=FILLER
                )
                self._link.publish("robot1", topic, update, None)

    def wait_for(self, topic, number):
        """Return once a message was heard."""
        wait_until_empty(lambda: [] if (topic, number) in self.heard else [(topic, number)])

    def say_until_heard(self, topic, number):
        """Send a message again and again, because there may be no room for it."""

        def unheard():
            if (topic, number) in self.heard:
                return []
            self.say(topic, number)
            return [(topic, number)]

        wait_until_empty(unheard)

    def numbers(self, topic):
        """Return what was heard on a topic."""
        return [number for about, number in self.heard if about == topic]

    def signal(self, number):
        """Send a signal to the process that hears."""
        self._hearer.send_signal(number)

    def end(self):
        """End both."""
        self._hearer.send_signal(signal.SIGCONT)
        self._hearer.stdin.close()
        self._hearer.wait()
        self._reader.join()
        self._session.close()

    def _read(self):
        for line in self._hearer.stdout:
            topic, _, number = line.partition(" ")
            if topic in {URGENT, ORDINARY}:
                self.heard.append((topic, int(number)))
            else:  # Zenoh logs there, too
                sys.stdout.write(line)


@pytest.fixture(scope="module")
def network():
    """A network with one more host than the office."""
    with network_of([HOST]) as network:
        yield network


@pytest.fixture(scope="module")
def certificates(tmp_path_factory):
    """The folder of the certificates of two robots."""
    site = Site.new(tmp_path_factory.mktemp("certificates") / "site")
    for name in ("robot1", HOST):
        site.add(name, Role.ROBOT)
    return site.folder / "members"


@pytest.fixture
def line(network, certificates):
    """Two processes that are connected."""
    line = Line(network, certificates)
    line.wait_until_connected()
    yield line
    network.heal()
    line.end()


def test_what_is_said_while_a_cable_is_out_arrives_in_order_when_it_is_back_soon(network, line):
    network.unplug(HOST)
    for number in range(50):
        line.say(ORDINARY, number)
        line.say(URGENT, number)
    network.heal()
    for topic in (URGENT, ORDINARY):
        line.wait_for(topic, 49)

    assert line.numbers(URGENT) == line.numbers(ORDINARY) == list(range(50))


def test_all_that_was_said_since_the_cable_was_out_is_lost_with_the_connection(network, line):
    network.unplug(HOST)
    line.say(ORDINARY, 1)
    line.say(URGENT, 1)
    line.wait_until_ended()
    line.say(ORDINARY, 2)
    network.heal()
    line.wait_until_connected()
    line.say(ORDINARY, 3)
    line.wait_for(ORDINARY, 3)

    assert line.heard == [(ORDINARY, 3)]


def test_a_suspended_process_may_get_what_was_said_to_it_until_its_connection_ended(line):
    line.signal(signal.SIGSTOP)
    line.say(ORDINARY, 1)
    line.wait_until_ended()
    line.say(ORDINARY, 2)
    line.signal(signal.SIGCONT)
    line.wait_until_connected()
    line.say(ORDINARY, 3)
    line.wait_for(ORDINARY, 3)

    assert line.numbers(ORDINARY) in ([1, 3], [3])


def test_where_more_is_said_than_passes_ordinary_messages_are_lost_and_urgent_ones_overtake(
    network, line
):
    network.limit(HOST, 50)
    line.say(ORDINARY, *range(MORE_THAN_WAITS))
    line.say(URGENT, *range(10))
    network.heal()
    line.wait_for(URGENT, 9)
    line.say_until_heard(ORDINARY, MORE_THAN_WAITS)

    ordinary = line.numbers(ORDINARY)
    assert line.numbers(URGENT) == list(range(10))
    assert ordinary == sorted(ordinary)
    assert len(set(ordinary)) < MORE_THAN_WAITS
    after = line.heard[line.heard.index((URGENT, 9)) :]
    assert any(topic == ORDINARY and number < MORE_THAN_WAITS for topic, number in after)
