# SPDX-License-Identifier: BSD-3-Clause
"""Which connections the kernel ends when nothing is acknowledged on them any more."""

from __future__ import annotations

import os
import queue
import socket
from pathlib import Path

import psutil
import pytest

pytest.importorskip("blackboard.msg", reason="the link needs generated messages")

from blackboard.zenoh import user_timeout
from blackboard.zenoh.opening import open_session
from blackboard.zenoh.session import Endpoints, session_config
from blackboard.zenoh.user_timeout import UNACKNOWLEDGED, limit

DESCRIPTORS = Path("/proc/self/fd")
WITHIN = 20.0  # a busy machine needs no longer [s]


def timeout_of(connection):
    """Return a connection's user timeout [ms]; 0 stands for the kernel's own."""
    return connection.getsockopt(socket.IPPROTO_TCP, socket.TCP_USER_TIMEOUT)


def text(address):
    host, port = address[:2]
    return f"[{host}]:{port}" if ":" in host else f"{host}:{port}"


def timeouts_between(here, there):
    """Return the user timeouts of this process's connections between two addresses [ms]."""
    for each in psutil.Process().connections("tcp4"):
        if each.raddr and (text(each.laddr), text(each.raddr)) == (here, there):
            with socket.socket(fileno=os.dup(each.fd)) as copy:
                yield timeout_of(copy)


@pytest.fixture(params=["127.0.0.1", "::1"])
def connections(request):
    """Two connections to one port of this machine, each with both ends; none blocks."""
    family = socket.AF_INET6 if ":" in request.param else socket.AF_INET
    with socket.create_server((request.param, 0), family=family) as server:
        address = server.getsockname()[:2]
        near = [socket.create_connection(address) for _ in range(2)]
        far = [server.accept()[0] for _ in near]
        for each in (*near, *far):
            each.setblocking(False)
        yield near, far
        for each in (*near, *far):
            each.close()


def test_the_one_connection_between_two_addresses_is_limited_at_one_end(connections):
    (one, other), far = connections
    limit(text(one.getsockname()), text(one.getpeername()))

    assert timeout_of(one) == 1000 * UNACKNOWLEDGED
    assert [timeout_of(each) for each in (other, *far)] == [0, 0, 0]


def test_of_all_that_is_open_only_connections_are_looked_at_and_nothing_stays_open(connections):
    (one, _), _ = connections
    with Path(os.devnull).open("rb"), socket.socketpair()[0], socket.socket() as unconnected:
        before = set(DESCRIPTORS.iterdir())
        limit(text(one.getsockname()), text(one.getpeername()))
        limit("127.0.0.1:1", "127.0.0.1:2")

        assert timeout_of(unconnected) == 0
        assert set(DESCRIPTORS.iterdir()) <= before


def test_sockets_that_block_go_on_to_block_where_rospy_has_set_a_default_timeout(connections):
    (one, other), _ = connections
    before = socket.getdefaulttimeout()
    with socket.create_server(("127.0.0.1", 0)) as server:
        for each in (other, server):
            each.setblocking(True)
        socket.setdefaulttimeout(60.0)
        try:
            limit(text(one.getsockname()), text(one.getpeername()))
        finally:
            socket.setdefaulttimeout(before)

        assert os.get_blocking(server.fileno())
    assert os.get_blocking(other.fileno())
    assert timeout_of(one) == 1000 * UNACKNOWLEDGED


def test_an_interface_that_only_one_of_them_names_does_not_matter(connections):
    (one, _), _ = connections
    host, port = one.getsockname()[:2]
    if ":" not in host:
        pytest.skip("only addresses of IPv6 name interfaces")
    limit(f"[{host}%7]:{port}", text(one.getpeername()))

    assert timeout_of(one) == 1000 * UNACKNOWLEDGED


def test_connections_of_a_session_are_limited_at_both_ends(monkeypatch):
    limited = queue.Queue()

    def note(*ends):
        limit(*ends)
        limited.put(ends)

    monkeypatch.setattr(user_timeout, "limit", note)
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        endpoint = f"tcp/127.0.0.1:{probe.getsockname()[1]}"
    with (
        open_session(session_config(Endpoints(listen=(endpoint,)))),
        open_session(session_config(Endpoints(connect=(endpoint,)))),
    ):
        ends = {limited.get(timeout=WITHIN) for _ in range(2)}
        found = [each for pair in ends for each in timeouts_between(*pair)]

    assert found == [1000 * UNACKNOWLEDGED] * 2
