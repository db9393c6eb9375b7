# SPDX-License-Identifier: BSD-3-Clause
"""How a session is opened, how large a message may be, and what a robot alone is told."""

from __future__ import annotations

import queue
import socket

import pytest

pytest.importorskip("blackboard.msg", reason="the link needs generated messages")

import genpy
import zenoh

from blackboard.codec.tables import WIRES
from blackboard.domain.talker import SET_STATE
from blackboard.errors import NoRouterError, SettingsError
from blackboard.zenoh import link as link_module
from blackboard.zenoh.link import ZenohLink, deserialized, serialized
from blackboard.zenoh.opening import open_session
from blackboard.zenoh.session import Endpoints, Mode, session_config

WITHIN = 20.0  # a busy machine needs no longer [s]
STATE = WIRES[SET_STATE]


class FakeInbox:
    """A talker that notes what arrives, and does nothing."""

    spins = True

    def __init__(self):
        self.arrived = queue.Queue()
        self.receive = self.arrived.put

    def call(self, action):
        pass

    def after(self, delay, action):
        pass

    def node_of(self, name):
        return name

    def next(self):
        """Return the sender of the next arrival, its name below the hive, and its value."""
        arrival = self.arrived.get(timeout=WITHIN)
        return arrival.sender, arrival.name, WIRES[arrival.topic].from_msg(arrival.read())


@pytest.fixture
def taken():
    """An endpoint of this machine that somebody uses."""
    with socket.create_server(("127.0.0.1", 0)) as server:
        yield f"tcp/127.0.0.1:{server.getsockname()[1]}"


@pytest.fixture
def free():
    """An endpoint of this machine that nobody uses."""
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        return f"tcp/127.0.0.1:{probe.getsockname()[1]}"


@pytest.fixture
def absent():
    """An endpoint of this machine that refuses connections, and that nobody else gets."""
    with socket.socket() as bound:
        bound.bind(("127.0.0.1", 0))
        yield f"tcp/127.0.0.1:{bound.getsockname()[1]}"


@pytest.fixture
def start(free):
    """Start processes, the first of which the others connect to; all end with the test."""
    sessions = []

    def begin(name):
        ends = Endpoints(connect=(free,)) if sessions else Endpoints(listen=(free,))
        sessions.append(open_session(session_config(ends)))
        inbox = FakeInbox()
        link = ZenohLink(sessions[-1], "lab", name, ())
        link.attach(inbox)
        return sessions[-1], link, inbox

    yield begin
    for each in sessions:
        each.close()


def test_a_session_opens_though_what_it_connects_to_is_not_there_and_keeps_its_port(free, absent):
    session = open_session(session_config(Endpoints((free,), (absent,))))

    with session, pytest.raises(SettingsError, match=free):
        open_session(session_config(Endpoints((free,))))


def test_a_port_that_is_taken_is_named_with_what_to_do(taken):
    with pytest.raises(SettingsError) as refused:
        open_session(session_config(Endpoints((taken,))))

    said = str(refused.value)
    assert said.startswith(f"Zenoh cannot start (it is to listen at: {taken}): ")
    assert said.endswith(
        "give each process of a machine a port of its own, and an address of this machine"
    )


def test_all_endpoints_are_named_when_one_of_them_is_taken(free, taken):
    with pytest.raises(SettingsError, match=f"to listen at: {free}, {taken}"):
        open_session(session_config(Endpoints((free, taken))))


def test_a_process_that_listens_nowhere_is_told_so_when_zenoh_refuses(free):
    config = session_config(Endpoints(connect=(free,))) | {"mode": "no such mode"}

    with pytest.raises(SettingsError, match="to listen at: nowhere"):
        open_session(config)


def test_a_client_none_of_whose_routers_answers_is_told_which_they_are(free, absent):
    with pytest.raises(NoRouterError, match=f"no router answers at {absent}, {free}; start it"):
        open_session(session_config(Endpoints(connect=(absent, free)), mode=Mode.CLIENT))


def test_a_client_takes_the_first_of_its_routers_that_answers(free, absent):
    with (
        open_session(session_config(Endpoints((free,)), mode=Mode.ROUTER)) as router,
        open_session(session_config(Endpoints((), (absent, free)), mode=Mode.CLIENT)) as client,
    ):
        assert [str(each) for each in client.info.routers_zid()] == [str(router.info.zid())]


def test_a_message_of_the_most_bytes_is_read_and_one_byte_more_is_not(monkeypatch):
    payload = serialized(STATE.encode("defect"))
    monkeypatch.setattr(link_module, "MAX_SIZE", len(payload))
    assert deserialized(STATE.message, zenoh.ZBytes(payload)).data == "defect"

    monkeypatch.setattr(link_module, "MAX_SIZE", len(payload) - 1)
    with pytest.raises(ValueError, match=r"^a message of 10 bytes; allowed: at most 9$"):
        deserialized(STATE.message, zenoh.ZBytes(payload))


def test_eight_megabytes_are_the_most():
    with pytest.raises(ValueError, match="8000001 bytes; allowed: at most 8000000"):
        deserialized(STATE.message, zenoh.ZBytes(bytes(8_000_001)))


@pytest.mark.parametrize("payload", [b"", b"\xff\xff\xff\x7f", b"\x06\x00\x00\x00def"])
def test_bytes_that_end_too_early_are_no_message(payload):
    with pytest.raises(genpy.DeserializationError):
        deserialized(WIRES["task_state"].message, zenoh.ZBytes(payload))


def test_a_robot_is_told_on_its_own_topic_and_the_others_are_not(start, until_heard):
    _, robot1, inbox = start("robot1")
    robot1.listen(SET_STATE, "robot1/set_state")
    _, robot2, other = start("robot2")
    robot2.listen(SET_STATE, "robot2/set_state")
    operator, anna, _ = start("anna")
    until_heard(operator, "hive/lab/robot1/set_state/anna")

    for state in ("defect", "active"):
        anna.publish_to_robot("robot1", SET_STATE, state)

    assert [inbox.next() for _ in range(2)] == [
        ("anna", "robot1/set_state", state) for state in ("defect", "active")
    ]
    assert other.arrived.empty()
