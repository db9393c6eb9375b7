# SPDX-License-Identifier: BSD-3-Clause
"""Proves that the process behind a Zenoh session has ended.

A session declares a liveliness token with its address. When its connection closes, Zenoh removes
the token everywhere. That proves nothing yet: a cable may be out. Proof is that its address then
refuses connections. The address counts only if this session was connected to a process of that id
on that very host; through a router or address translation, it may be another machine's.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from blackboard.process.death import Answer, PortProbe

if TYPE_CHECKING:
    from collections.abc import Callable

    from blackboard.process.death import Probe

NO_ADDRESS = "-"
"""In the token of a session that others cannot connect to."""

_HIGHEST_PORT = 65_535

PERIOD = 0.03
"""Time between two looks at a watched process whose token is gone [s]."""

_FIRST_LOOK = 0.01
"""From a change until the first look [s]: a process that ends takes a moment to close its port."""


@dataclass(frozen=True)
class Token:
    """What a session tells of itself while it lives.

    Attributes:
        sender: The process, as in its keys.
        session: The id of its session, which is new after each start.
        address: Where it is reached, as HOST:PORT; `NO_ADDRESS` if nowhere.
    """

    sender: str
    session: str
    address: str = NO_ADDRESS

    @classmethod
    def read(cls, key: str) -> Token:
        """Return the token of a key, of which it is the end.

        Raises:
            ValueError: The key is too short.
        """
        _, sender, session, address = key.rsplit("/", 3)
        return cls(sender, session, address)

    def key(self, prefix: str) -> str:
        """Return the key of the token below a prefix."""
        return f"{prefix}/{self.sender}/{self.session}/{self.address}"


class Presence:
    """Follows the tokens of all processes. Use it from one thread.

    It looks at the watched processes after each change, and then again and again only while the
    token of one is gone: in a large fleet, looking all the time costs more than all messages.

    Args:
        hosts_of: Returns the hosts that this session is connected to, by the ids of sessions.
        after: Calls once after a time [s], in that thread.
        probe: Returns what asks a port of a host.
    """

    def __init__(
        self,
        hosts_of: Callable[[], dict[str, str]],
        after: Callable[[float, Callable[[], None]], object],
        probe: Callable[[str, int], Probe] = PortProbe,
    ) -> None:
        self._hosts_of = hosts_of
        self._after = after
        self._probe = probe
        self._here: dict[str, Token] = {}
        self._watches: dict[str, _Watch] = {}
        self._will_look = False

    def appear(self, token: Token) -> None:
        """Note the token of a process; that of an earlier start may go later."""
        self._here[token.sender] = token
        self._look_soon()

    def vanish(self, token: Token) -> None:
        """Note that a token is gone."""
        if self._here.get(token.sender) == token:
            del self._here[token.sender]
            self._look_soon()

    def watch(self, watcher: str, sender: str, died: Callable[[], None]) -> None:
        """Call once when a process has ended; see `process.link.Link.watch`."""
        if watcher in self._watches:
            self._watches[watcher].stop()
        self._watches[watcher] = _Watch(sender, died)
        self._look_soon()

    def _look_soon(self) -> None:
        if not self._will_look:
            self._will_look = True
            self._after(_FIRST_LOOK, self._look)

    def _look(self) -> None:
        self._will_look = False
        self._check()
        if any(each.probe is not None for each in self._watches.values()):
            self._will_look = True
            self._after(PERIOD, self._look)

    def _check(self) -> None:
        for watcher, watch in tuple(self._watches.items()):
            token = self._here.get(watch.sender)
            if token is not None:
                watch.stop()
                self._note_address(watch, token)
            elif watch.address is not None and self._refuses(watch, *watch.address):
                watch.stop()
                del self._watches[watcher]
                watch.died()

    def _note_address(self, watch: _Watch, token: Token) -> None:
        """Note where a process is reached, as long as its connection says on which host it is."""
        if watch.token == token:
            return
        watch.token, watch.address = token, None
        host, _, port = token.address.rpartition(":")
        is_port = port.isdecimal() and 0 < int(port) <= _HIGHEST_PORT
        if host and is_port and self._hosts_of().get(token.session) == host:
            watch.address = (host.strip("[]"), int(port))

    def _refuses(self, watch: _Watch, host: str, port: int) -> bool:
        if watch.probe is None:
            watch.probe = self._probe(host, port)
        return watch.probe.look() is Answer.REFUSES


@dataclass
class _Watch:
    sender: str
    died: Callable[[], None]
    token: Token | None = None
    address: tuple[str, int] | None = None
    probe: Probe | None = None  # while the token is gone

    def stop(self) -> None:
        """Ask no more."""
        if self.probe is not None:
            self.probe.close()
            self.probe = None
