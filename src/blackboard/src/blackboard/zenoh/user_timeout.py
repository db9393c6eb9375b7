# SPDX-License-Identifier: BSD-3-Clause
"""Ends connections on which nothing is acknowledged any more.

Where a cable is out, TCP keeps a connection for a quarter of an hour. Zenoh 1.10.2 gives one up
after ten seconds without a word. It cannot close it, though, while the kernel holds bytes that
were never sent; it connects again as soon as the cable is back, and when it has closed the old
connection at last, it removes the new one: two processes stay deaf to each other for good, though
they are connected (issues 1886 and 2806 of eclipse-zenoh/zenoh). The kernel can end a connection
sooner, by the user timeout of RFC 5482, for which Zenoh has no setting.
"""

from __future__ import annotations

import contextlib
import os
import socket
from pathlib import Path

import zenoh
from zenoh.handlers import Callback

_End = tuple[str, int]

UNACKNOWLEDGED = 5.0
"""How long bytes may stay without an acknowledgement [s]. Something is said every 2.5 s at least,
so both ends are told before Zenoh's ten seconds are over."""

_DESCRIPTORS = Path("/proc/self/fd")


def end_dead_connections(session: zenoh.Session) -> None:
    """Have the kernel end connections of a session that are dead, now and later ones."""

    def note(event: zenoh.LinkEvent) -> None:
        if event.kind == zenoh.SampleKind.PUT:
            limit(_address(event.link.src), _address(event.link.dst))

    session.info.declare_link_events_listener(Callback(note, indirect=False), history=True)


def limit(here: str, there: str) -> None:
    """Set the user timeout of this process's connection between two addresses, HOST:PORT each.

    Only sockets that never block are looked at, as all of Zenoh's: `socket.socket` makes one that
    blocks non-blocking where rospy has set a default timeout, and rospy's server then ends.
    """
    ends = (_read(here), _read(there))
    for each in _DESCRIPTORS.iterdir():
        with contextlib.suppress(OSError):  # it is no connection, or closed by now
            copy = os.dup(int(each.name))
            try:
                if not os.get_blocking(copy):
                    _limit(copy, ends)
            finally:
                os.close(copy)


def _limit(descriptor: int, ends: tuple[_End, _End]) -> None:
    """Set the user timeout of a socket if it is the connection between two ends."""
    found = socket.socket(fileno=descriptor)
    try:
        if found.getsockopt(socket.SOL_SOCKET, socket.SO_PROTOCOL) != socket.IPPROTO_TCP:
            return
        if (_end(*found.getsockname()[:2]), _end(*found.getpeername()[:2])) == ends:
            milliseconds = round(1000 * UNACKNOWLEDGED)
            found.setsockopt(socket.IPPROTO_TCP, socket.TCP_USER_TIMEOUT, milliseconds)
    finally:
        found.detach()


def _read(address: str) -> _End:
    """Return the end of a connection at an address, which may be one of IPv6 in brackets."""
    host, _, port = address.rpartition(":")
    return _end(host.strip("[]"), int(port))


def _end(host: str, port: int) -> _End:
    """Return an end without its interface, which Zenoh and the kernel name in different ways."""
    return host.partition("%")[0], port


def _address(locator: str) -> str:
    """Return the address of a locator of Zenoh's, such as `tls/10.0.0.2:7447`."""
    return locator.partition("/")[2]
