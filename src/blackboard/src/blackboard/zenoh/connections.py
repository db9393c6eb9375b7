# SPDX-License-Identifier: BSD-3-Clause
"""Ends connections that are dead, and gives up those that do not open.

Where a cable is out, TCP keeps a connection for a quarter of an hour. Zenoh 1.10.2 gives one up
after ten seconds without a word. It cannot close it, though, while the kernel holds bytes that
were never sent; it connects again as soon as the cable is back, and when it has closed the old
connection at last, it removes the new one: two processes stay deaf to each other for good, though
they are connected (issues 1886 and 2806 of eclipse-zenoh/zenoh). The kernel can end a connection
sooner, by the user timeout of RFC 5482, for which Zenoh has no setting.

Nor has it one for opening a connection. To a host that does not answer at all, the kernel asks
again after 1, 2, 4 s and so on, and gives up after two minutes. Until then a client tries none of
its other routers, and a host that is back after a minute is asked half a minute later.
"""

from __future__ import annotations

import contextlib
import functools
import os
import socket
import threading
import time
from pathlib import Path
from typing import TYPE_CHECKING

import zenoh
from zenoh.handlers import Callback

if TYPE_CHECKING:
    from collections.abc import Callable

_End = tuple[str, int]

UNACKNOWLEDGED = 5.0
"""How long bytes may stay without an acknowledgement [s]. Something is said every 2.5 s at least,
so both ends are told before Zenoh's ten seconds are over."""

ASKED_AGAIN = 1
"""How often the kernel asks a host again that does not answer; it gives up after 3 s then."""

LOOK_EVERY = 0.5
"""Time between two looks for connections that are being opened [s]."""

_SYN_SENT = b"\x02"
"""State of a connection that is being opened (netinet/tcp.h)."""

_DESCRIPTORS = Path("/proc/self/fd")


def end_dead_connections(session: zenoh.Session) -> None:
    """Have the kernel end connections of a session that are dead, now and later ones."""

    def note(event: zenoh.LinkEvent) -> None:
        if event.kind == zenoh.SampleKind.PUT:
            limit(_address(event.link.src), _address(event.link.dst))

    session.info.declare_link_events_listener(Callback(note, indirect=False), history=True)


@functools.cache
def give_up_connecting() -> None:
    """Have the kernel give up connections of this process that do not open, from now on."""

    def look() -> None:
        while True:
            limit_opening()
            time.sleep(LOOK_EVERY)

    threading.Thread(target=look, name="connections", daemon=True).start()


def limit(here: str, there: str) -> None:
    """Set the user timeout of this process's connection between two addresses, HOST:PORT each."""
    ends = (_read(here), _read(there))

    def set_timeout(found: socket.socket) -> None:
        if (_end(*found.getsockname()[:2]), _end(*found.getpeername()[:2])) == ends:
            milliseconds = round(1000 * UNACKNOWLEDGED)
            found.setsockopt(socket.IPPROTO_TCP, socket.TCP_USER_TIMEOUT, milliseconds)

    _for_connections(set_timeout)


def limit_opening() -> None:
    """Have the kernel ask only `ASKED_AGAIN` times where connections are being opened."""

    def set_count(found: socket.socket) -> None:
        if found.getsockopt(socket.IPPROTO_TCP, socket.TCP_INFO, 1) == _SYN_SENT:
            found.setsockopt(socket.IPPROTO_TCP, socket.TCP_SYNCNT, ASKED_AGAIN)

    _for_connections(set_count)


def _for_connections(act: Callable[[socket.socket], None]) -> None:
    """Do something with each TCP socket of this process; one that it cannot be done with is left.

    Only sockets that never block are looked at, as all of Zenoh's: `socket.socket` makes one that
    blocks non-blocking where rospy has set a default timeout, and rospy's server then ends.
    """
    for each in _DESCRIPTORS.iterdir():
        with contextlib.suppress(OSError):  # it is no connection, or closed by now
            copy = os.dup(int(each.name))
            try:
                if not os.get_blocking(copy):
                    _act(copy, act)
            finally:
                os.close(copy)


def _act(descriptor: int, act: Callable[[socket.socket], None]) -> None:
    """Do something with a socket if it is one of TCP."""
    found = socket.socket(fileno=descriptor)
    try:
        if found.getsockopt(socket.SOL_SOCKET, socket.SO_PROTOCOL) == socket.IPPROTO_TCP:
            act(found)
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
