# SPDX-License-Identifier: BSD-3-Clause
"""Proof that a process has ended: its port refuses connections."""

from __future__ import annotations

import errno
import select
import socket
from enum import Enum
from typing import TYPE_CHECKING, Protocol

from hive_common.machine_clock import machine_time

if TYPE_CHECKING:
    from collections.abc import Callable

WAIT = 0.002
"""The longest wait for an answer [s]; most machines of a network answer sooner."""

ATTEMPT = 1.0
"""A question that has no answer for so long is asked anew [s]."""

UNREACHABLE = 0.1
"""Until the next question where there is no way to the machine [s]."""

FIRST_PAUSE, GROWTH, LONGEST_PAUSE = 0.25, 4.0, 30.0
"""Until the next question to a process that has answered [s], and by how much this grows. Each is
a connection that leads to nothing, and whoever accepts connections lets others wait for it."""


class Answer(Enum):
    """What a port has answered."""

    NONE = "none"  # none yet, or the machine is out of reach
    ACCEPTS = "accepts"
    REFUSES = "refuses"  # only a machine that is up can do that, so the process has ended


class Probe(Protocol):
    """Asks a port whether a process still listens at it."""

    def look(self) -> Answer:
        """Ask, if it is time, and return what is known now."""

    def close(self) -> None:
        """Ask no more."""


class PortProbe:
    """Asks by connecting; see `Probe`.

    It hardly waits, so it may be called often from a thread that has better things to do.

    Args:
        host: A name or an address; one that does not exist never answers.
        port: Of TCP.
        clock: Returns the time [s].
    """

    def __init__(self, host: str, port: int, clock: Callable[[], float] = machine_time) -> None:
        self._address = (host, port)
        self._clock = clock
        self._socket: socket.socket | None = None
        self._begun = 0.0
        self._next = clock()
        self._pause = FIRST_PAUSE

    def look(self) -> Answer:
        """See `Probe`."""
        now = self._clock()
        if self._socket is None:
            if now < self._next:
                return Answer.NONE
            self._begun = now
            error = self._connect()
        else:
            error = _error_of(self._socket, 0.0)
        if error == errno.EINPROGRESS:
            if now - self._begun >= ATTEMPT:
                self.close()
            return Answer.NONE
        self.close()
        return self._answer(error, now)

    def close(self) -> None:
        """See `Probe`."""
        if self._socket is not None:
            self._socket.close()
            self._socket = None

    def _answer(self, error: int, now: float) -> Answer:
        if error == errno.ECONNREFUSED:
            return Answer.REFUSES
        if error:
            self._next = now + UNREACHABLE
            return Answer.NONE
        self._next = now + self._pause
        self._pause = min(GROWTH * self._pause, LONGEST_PAUSE)
        return Answer.ACCEPTS

    def _connect(self) -> int:
        """Begin to connect; return the error, EINPROGRESS while there is no answer."""
        try:
            [(family, kind, protocol, _, address), *_] = socket.getaddrinfo(
                *self._address, type=socket.SOCK_STREAM
            )
            self._socket = socket.socket(family, kind, protocol)
            self._socket.setblocking(False)
            error = self._socket.connect_ex(address)
        except (OSError, OverflowError):  # also a name or a number that is none
            return errno.EHOSTUNREACH
        return _error_of(self._socket, WAIT) if error == errno.EINPROGRESS else error


def _error_of(connecting: socket.socket, wait: float) -> int:
    """Return how connecting has ended, after so long at most [s]: 0 where it has worked."""
    _, ended, _ = select.select([], [connecting], [], wait)
    if not ended:
        return errno.EINPROGRESS
    return connecting.getsockopt(socket.SOL_SOCKET, socket.SO_ERROR)
