# SPDX-License-Identifier: BSD-3-Clause
"""Connections that send at once lose nothing, keep the order, and block nobody."""

import socket
import threading
import time

import pytest

from hive_common.ros.sending import PromptConnection
from hive_lab.runner.limits import PATIENCE

MEGABYTE = bytes(1_000_000)


class Transport:
    """A fake of rospy's connection to one subscriber."""

    def __init__(self, end):
        self.socket = end
        self.done = False
        self.stat_bytes = self.stat_num_msg = 0
        self.threads = set()

    def write_data(self, data):
        """Send, waiting for the receiver."""
        self.threads.add(threading.current_thread().name)
        self.socket.sendall(data)


@pytest.fixture
def link():
    """Return a connection with a queue of three, its transport and the receiver's socket."""
    ours, theirs = socket.socketpair()
    theirs.settimeout(PATIENCE)
    transport = Transport(ours)
    connection = PromptConnection(transport, 3)
    yield connection, transport, theirs
    transport.done = True
    theirs.close()
    ours.close()


def read(receiver, size):
    """Return so many bytes."""
    found = bytearray()
    while len(found) < size:
        found += receiver.recv(size - len(found))
    return bytes(found)


def threads():
    """Return how many threads send queued messages."""
    return sum(thread.name == "sending" for thread in threading.enumerate())


def test_a_message_is_sent_by_the_thread_that_publishes_it(link):
    connection, transport, receiver = link
    connection.write_data(b"first")
    connection.write_data(b"second")

    assert read(receiver, 11) == b"firstsecond"
    assert transport.threads == set()
    assert threads() == 0
    assert (transport.stat_bytes, transport.stat_num_msg) == (11, 2)


def test_nobody_waits_for_a_receiver_that_does_not_read_and_no_byte_is_lost_or_mixed_up(link):
    connection, _, receiver = link
    messages = [bytes([number]) * 1_000_000 for number in (1, 2, 3)]
    for message in messages:
        connection.write_data(message)

    assert read(receiver, 3_000_000) == b"".join(messages)
    connection.write_data(b"last")
    assert read(receiver, 4) == b"last"
    end = time.monotonic() + PATIENCE
    while threads() and time.monotonic() < end:
        time.sleep(0.01)
    assert threads() == 0


def test_the_oldest_that_waits_is_dropped_and_never_the_rest_of_one_that_was_begun(link):
    connection, _, receiver = link
    connection.write_data(MEGABYTE)
    for number in range(1, 30):
        connection.write_data(bytes([number]) * 10)
    assert read(receiver, len(MEGABYTE)) == MEGABYTE
    kept = [read(receiver, 10)]
    while kept[-1] != bytes([29]) * 10:
        kept.append(read(receiver, 10))

    assert all(len(set(message)) == 1 for message in kept)
    assert kept == sorted(kept)
    # Three may have been handed to the thread, with the rest, before the others came.
    assert len(kept) <= 6


def test_a_connection_that_breaks_tells_whoever_publishes_after_it(link):
    connection, _, receiver = link
    receiver.close()

    def publish_until_told():
        end = time.monotonic() + PATIENCE
        while time.monotonic() < end:
            connection.write_data(b"is anybody there?")

    with pytest.raises(OSError, match=r"Broken pipe|reset"):
        publish_until_told()
