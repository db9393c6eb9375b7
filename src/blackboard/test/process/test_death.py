# SPDX-License-Identifier: BSD-3-Clause
"""What the port of a process answers, and how often it is asked, on this machine's loopback."""

import socket

import pytest

from blackboard.process.death import ATTEMPT, FIRST_PAUSE, LONGEST_PAUSE, Answer, PortProbe


class Asker:
    """Asks a port on a clock of its own.

    Attributes:
        now: The time [s].
    """

    def __init__(self, host, port):
        self.now = 100.0
        self._probe = PortProbe(host, port, lambda: self.now)

    def look(self, after=0.0):
        """Return the answer after some time [s]."""
        self.now += after
        return self._probe.look()

    def close(self):
        self._probe.close()


@pytest.fixture
def ask():
    """Return what asks a port; all end with the test."""
    askers = []

    def begin(host, port):
        askers.append(Asker(host, port))
        return askers[-1]

    yield begin
    for each in askers:
        each.close()


@pytest.fixture(params=["127.0.0.1", "::1"])
def server(request):
    """A process that listens."""
    family = socket.AF_INET6 if ":" in request.param else socket.AF_INET
    with socket.create_server((request.param, 0), family=family) as listening:
        yield listening


@pytest.fixture
def full():
    """The port of a process that is too busy to accept: the kernel drops what is too much."""
    with socket.create_server(("127.0.0.1", 0), backlog=0) as listening:
        waiting = []
        while True:
            waiting.append(socket.socket())
            waiting[-1].settimeout(0.05)
            if waiting[-1].connect_ex(listening.getsockname()):
                break
        yield listening
        for each in waiting:
            each.close()


def connections(server):
    """Return how many connections have come in since the last time."""
    server.settimeout(0.0)
    count = 0
    while True:
        try:
            server.accept()[0].close()
        except BlockingIOError:
            return count
        count += 1


def test_a_port_accepts_while_somebody_listens_and_refuses_afterwards(ask, server):
    asker = ask(*server.getsockname()[:2])
    assert asker.look() is Answer.ACCEPTS

    server.close()
    assert asker.look(after=FIRST_PAUSE) is Answer.REFUSES


def test_who_has_answered_is_asked_ever_less_often(ask, server):
    asker = ask(*server.getsockname()[:2])
    asked = 0
    for _ in range(2000):
        asker.look(after=0.03)
        asked += connections(server)

    assert asked == 6  # after 0, 0.25, 1.25, 5.25, 21.25 and 51.25 s

    for _ in range(3):
        assert asker.look(after=LONGEST_PAUSE) is Answer.ACCEPTS
        assert asker.look(after=LONGEST_PAUSE / 2) is Answer.NONE


def test_who_does_not_answer_is_asked_once_a_second_and_not_waited_for(ask, full):
    asker = ask(*full.getsockname())
    for _ in range(40):
        assert asker.look(after=ATTEMPT / 10) is Answer.NONE

    full.close()
    assert asker.look(after=ATTEMPT) in {Answer.NONE, Answer.REFUSES}
    assert asker.look(after=ATTEMPT) is Answer.REFUSES


@pytest.mark.parametrize(("host", "port"), [("no.such.host.invalid", 7447), ("127.0.0.1", 2**70)])
def test_what_is_no_address_never_answers(ask, host, port):
    asker = ask(host, port)

    assert [asker.look(after=ATTEMPT) for _ in range(3)] == [Answer.NONE] * 3
