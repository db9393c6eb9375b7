# SPDX-License-Identifier: BSD-3-Clause
"""Virtual links as Zenoh gives them: connections on which messages wait, overtake and are lost.

What they do was seen between two hosts, with Zenoh 1.10.2 and the settings of `blackboard.zenoh`
(docs/benchmarks.md, faults; test/rostest/zenoh_links.test). A cable that is out for 3 s delays all
messages, and then urgent ones come first; after 8 s, everything since the cable was pulled is
lost. A process that was suspended for 12 s may get what was said to it in the first 10 s, or
nothing. Where a connection carries less than is said, ordinary messages are lost one after the
other, and urgent ones are late.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from blackboard.domain.talker import BACKUP, SYNC, URGENT
from blackboard.zenoh.authenticity import Authenticity
from blackboard.zenoh.delivery import REPEATED, is_repeated
from blackboard.zenoh.presence import PERIOD
from blackboard.zenoh.user_timeout import UNACKNOWLEDGED
from hive_lab.fault_schedules.faulty_network import FASTEST, FaultyNetwork

if TYPE_CHECKING:
    from collections.abc import Callable, Collection, Iterable
    from random import Random

    from hive_lab.fault_schedules.faulty_network import Host
    from hive_lab.fault_schedules.schedule import Site

_Packet = tuple[str, object]
_Pair = tuple[str, str]

_NOTICED = 2.5
"""After the user timeout a dead connection is noticed within this time [s]; something is said that
often."""

_LEASE = 10.0
"""A connection on which the other side says nothing for this time is closed [s]."""

_IN_FLIGHT = 10
"""Packets that TCP sends before it waits for the first acknowledgement (RFC 6928)."""

_RETRANSMISSION = 0.2
"""Linux repeats a packet after this time, and then after twice as long each time [s]."""

_MOST_REPEATED = 5

_SOON, _LATER, _LATE = 0.05, 0.5, 0.2
"""Most connections are opened within the first time [s], a share of them within the second [s]."""

_REFUSED_AFTER = 0.003
"""The token of a process that was killed is gone after this time [s]."""


class ZenohNetwork(FaultyNetwork):
    """A hive's links over Zenoh.

    `cut` says between whom no packet passes; what was said waits, and is lost with the connection.
    Of `quality`, `loss` is that of packets, which TCP repeats; `double` has no effect, because
    what arrives twice depends on the site.

    Args:
        random: The source of every chance.
        proofs: Share of the deaths that can be proved.
        site: What the members are connected by.
    """

    def __init__(self, random: Random, proofs: float, site: Site) -> None:
        super().__init__(random, proofs)
        self.site = site
        self.deaf_until = 0.0  # while a router hangs
        self._connections: dict[_Pair, _Connection] = {}  # each by both its pairs
        self._met: dict[_Pair, tuple[int, int]] = {}
        self._last: dict[_Pair, tuple[int, object]] = {}  # by sender and topic
        self._hears_lists: set[tuple[str, int]] = set()  # hosts, each with its generation
        self._authenticity: dict[str, tuple[int, Authenticity]] = {}

    def started(self, host: Host) -> None:
        """Connect a process that has started to the others."""
        super().started(host)
        for other in self.hosts.values():
            if other is not host and other.up:
                self._connect_soon(host, other)

    def stopped(self, host: Host) -> None:
        """End the connections of a process that has ended."""
        super().stopped(host)
        for other in self.hosts.values():
            if (connection := self._connections.get((host.name, other.name))) is not None:
                self._remove(connection)

    def repeat_lists(self, host: Host, _hear: Callable[[Any], None]) -> None:
        """Have the others say their last list again if a process has never listened to lists."""
        if (host.name, host.generation) in self._hears_lists:
            return
        self._hears_lists.add((host.name, host.generation))
        for other in self.hosts.values():
            if (other.name, host.name) in self._connections:
                delay = self.random.uniform(FASTEST, _SOON)
                self.schedule(delay, other, self._repeat, (other, host, (SYNC,)))

    def send(
        self, sender: Host, topic: str, message: object, to: Collection[str] | None = None
    ) -> None:
        """Send a message; see `FaultyNetwork.send`."""
        if is_repeated(topic, message, sender.name):
            self._last[sender.name, topic] = sender.generation, message
        super().send(sender, topic, message, to)

    def pass_on(self, sender: Host, host: Host, packet: _Packet) -> None:
        """Say something on the connection between two hosts, if there is one."""
        connection = self._connections.get((sender.name, host.name))
        if connection is None or self.now < self.deaf_until:
            self.counts["not connected"] += 1
        else:
            connection.say(sender, host, packet)

    def hear(self, sender: Host, host: Host, packet: _Packet) -> None:
        """Deliver what has arrived, unless it is said in the name of another."""
        if BACKUP in host.handlers and self._of(host).why_refused(packet[1], sender.name):
            self.counts["refused"] += 1
        else:
            host.deliver(packet)

    def _of(self, host: Host) -> Authenticity:
        """Return what a member's process knows of who leads."""
        generation, known = self._authenticity.get(host.name, (-1, None))
        if known is None or generation != host.generation:
            known = Authenticity("", lambda: self.now * host.rate)
            self._authenticity[host.name] = host.generation, known
        return known

    def release(self) -> None:
        """Let connections stall between whom no packet passes now, and others go on."""
        for connection in dict.fromkeys(self._connections.values()):
            connection.note_cuts()

    def lose_routers(self, hang: float) -> None:
        """End all connections through the routers, after these have hung for a while [s]."""
        if self.site.routers:
            self.deaf_until = max(self.deaf_until, self.now + hang)
            self.schedule(hang, None, self._close_all)

    def _close_all(self, _: object) -> None:
        for connection in dict.fromkeys(self._connections.values()):
            self.close(connection)

    def close(self, connection: _Connection) -> None:
        """Lose a connection with what waits on it, and connect again as soon as that works.

        What the kernel of the one that listens already has is lost too, or is read.
        """
        connection.forgets = self.random.choice([True, False])
        self._remove(connection)
        self.counts["connections lost"] += 1
        self.counts["lost with a connection"] += connection.waiting
        self._connect_soon(*connection.ends)

    def _remove(self, connection: _Connection) -> None:
        connection.is_open = False
        one, other = (each.name for each in connection.ends)
        self._connections.pop((one, other), None)
        self._connections.pop((other, one), None)

    def _connect_soon(self, one: Host, other: Host) -> None:
        most = _LATER if self.random.random() < _LATE else _SOON
        ends = ((one, one.generation), (other, other.generation))
        self.schedule(self.random.uniform(FASTEST, most), None, self._connect, ends)

    def _connect(self, ends: tuple[tuple[Host, int], tuple[Host, int]]) -> None:
        """Connect two processes, once both run and reach each other."""
        (one, _), (other, _) = ends
        if any(host.generation != generation or not host.up for host, generation in ends):
            return
        pair, back = (one.name, other.name), (other.name, one.name)
        is_cut = pair in self.cut or back in self.cut
        if is_cut or one.frozen or other.frozen or self.now < self.deaf_until:
            self.schedule(self.random.uniform(0.1, _LATER), None, self._connect, ends)
            return
        self._connections[pair] = self._connections[back] = _Connection(self, one, other)
        for here, there in ((one, other), (other, one)):
            self._met[here.name, there.name] = here.generation, there.generation
            delay = self.random.uniform(0.0, _SOON)
            self.schedule(delay, here, self._repeat, (here, there, sorted(REPEATED)))

    def _repeat(self, what: tuple[Host, Host, Iterable[str]]) -> None:
        """Have a host say again to all what it said last, for one that listens from now on."""
        host, newcomer, topics = what
        for topic in topics:
            generation, message = self._last.get((host.name, topic), (-1, None))
            if generation == host.generation and topic in newcomer.handlers:
                self.counts["repeated"] += 1
                for other in self.listening(topic):
                    if other is not host:
                        self.pass_on(host, other, (topic, message))

    def prove_death(self, dead: Host) -> None:
        """Have watchers ask for the address of a process whose token is gone; see `Presence`.

        They know its address only if they were connected to it without a router.
        """
        for host in self.hosts.values():
            watched = host.watched
            if watched is None or watched[0] != dead.name or self.site.routers:
                continue
            met = self._met.get((host.name, dead.name))
            if (
                met == (host.generation, dead.generation - 1)
                and self.random.random() < self.proofs
            ):
                delay = _REFUSED_AFTER + PERIOD * self.random.uniform(0.0, 2.0)
                ended = (host, watched, dead, dead.generation)
                self.schedule(delay, host, self._probe, ended)

    def _probe(self, what: tuple[Host, tuple[str, Callable[[], None]], Host, int]) -> None:
        """Ask the address of a process that seems to have ended, until that refuses or answers."""
        host, watched, dead, generation = what
        if host.watched is not watched or dead.generation != generation:
            return
        if self.cut & {(host.name, dead.name), (dead.name, host.name)}:
            self.schedule(_LATER, host, self._probe, what)
            return
        host.watched = None
        self.counts["deaths proved"] += 1
        watched[1]()


class _Connection:
    """What two processes say to each other over TCP.

    Attributes:
        ends: The two.
        is_open: Whether it has not been lost.
        forgets: Whether what is under way is lost.
    """

    def __init__(self, network: ZenohNetwork, one: Host, other: Host) -> None:
        self.ends = one, other
        self.is_open = True
        self.forgets = False
        self._network = network
        self._ways = {
            (one.name, other.name): _Way(self, network, one, other),
            (other.name, one.name): _Way(self, network, other, one),
        }
        self._stalled_at: float | None = None

    @property
    def waiting(self) -> int:
        """How many messages wait, in both directions."""
        return sum(len(way.waiting) for way in self._ways.values())

    def say(self, sender: Host, host: Host, packet: _Packet) -> None:
        """Send a packet, or keep it while the connection stalls."""
        way = self._ways[sender.name, host.name]
        if self._stalled_at is not None and not way.passes():
            way.waiting.append(packet)
        elif way.is_dead():
            self._network.close(self)
        else:
            way.carry(packet)

    def note_cuts(self) -> None:
        """Stall, or go on a while after the last packet was lost."""
        network, now = self._network, self._network.now
        cut = [way for pair, way in self._ways.items() if pair in network.cut]
        if self._stalled_at is None and cut:
            self._stalled_at = now
            for way in self._ways.values():
                way.may_send = _IN_FLIGHT
            delay = UNACKNOWLEDGED + network.random.uniform(0.0, _NOTICED)
            network.schedule(delay, None, self._give_up, now)
        elif self._stalled_at is not None and not cut:
            # The time between two attempts to repeat a packet grows to that of the stall.
            wait = network.random.choice([0.0, network.random.random()]) * (now - self._stalled_at)
            network.schedule(wait, None, self._go_on, self._stalled_at)
        for way in cut:
            way.may_send = 0

    def _give_up(self, stalled_at: float) -> None:
        if self.is_open and self._stalled_at == stalled_at:
            self._network.close(self)

    def _go_on(self, stalled_at: float) -> None:
        is_cut = any(pair in self._network.cut for pair in self._ways)
        if self.is_open and self._stalled_at == stalled_at and not is_cut:
            self._stalled_at = None
            for way in self._ways.values():
                way.go_on()


class _Way:
    """One direction of a connection.

    Attributes:
        waiting: What is said while it stalls.
        may_send: How many packets pass while the acknowledgements do not.
    """

    def __init__(
        self, connection: _Connection, network: ZenohNetwork, sender: Host, host: Host
    ) -> None:
        self._connection = connection
        self.waiting: list[_Packet] = []
        self.may_send = 0
        self._network = network
        self._sender = sender
        self._host = host
        self._arrivals = {False: 0.0, True: 0.0}  # of the last message, by whether it is urgent
        self._copies = {False: 0.0, True: 0.0}  # the same through the second router
        self._busy_until = 0.0
        self._frozen_since: float | None = None

    def passes(self) -> bool:
        """Return whether a packet passes, though the connection stalls."""
        self.may_send -= 1
        return self.may_send >= 0

    def is_dead(self) -> bool:
        """Return whether the process that listens has been suspended for too long."""
        if not self._host.frozen:
            self._frozen_since = None
            return False
        if self._frozen_since is None:
            self._frozen_since = self._network.now
        return self._network.now - self._frozen_since > _LEASE

    def go_on(self) -> None:
        """Send what has waited."""
        kept, self.waiting = self.waiting, []
        self._network.counts["held back"] += len(kept)
        for packet in kept:
            self.carry(packet)

    def carry(self, packet: _Packet) -> None:
        """Have a message arrive, after those of its priority that were sent before.

        Messages of two priorities overtake each other, as in reality when the kernel's buffers
        are full.
        """
        network, urgent = self._network, packet[0] in URGENT
        waits = self._waits(urgent=urgent)
        if waits is None:
            network.counts["no room"] += 1
            return
        self._arrive(packet, self._sender.held_up + waits + self._takes(), self._arrivals)
        if network.site.twice:
            network.counts["doubled"] += 1
            self._arrive(packet, self._sender.held_up + waits + self._takes(), self._copies)

    def _arrive(self, packet: _Packet, takes: float, arrivals: dict[bool, float]) -> None:
        network, urgent = self._network, packet[0] in URGENT
        at = arrivals[urgent] = max(arrivals[urgent], network.now + takes)
        network.schedule(at - network.now, self._host, self._hear, packet)

    def _hear(self, packet: _Packet) -> None:
        if self._connection.forgets:
            self._network.counts["lost with a connection"] += 1
        else:
            self._network.hear(self._sender, self._host, packet)

    def _waits(self, *, urgent: bool) -> float | None:
        """Return how long a message waits to be sent [s]; None if it finds no room."""
        load, now = self._network.quality.load, self._network.now
        waits = max(0.0, self._busy_until - now)
        if urgent:
            return min(waits, load.buffered)
        if not load.takes:
            return waits
        if waits > load.room:
            return None
        self._busy_until = now + waits + load.takes
        return waits + load.takes

    def _takes(self) -> float:
        """Return how long a message takes, with the packets that TCP repeats [s]."""
        quality, random = self._network.quality, self._network.random
        takes = FASTEST + (quality.delay - FASTEST) * random.random() ** 3
        wait = _RETRANSMISSION
        for _ in range(_MOST_REPEATED):
            if not quality.loss or random.random() >= quality.loss:
                break
            self._network.counts["repeated packets"] += 1
            takes += wait
            wait *= 2.0
        if quality.late and random.random() < quality.late:
            self._network.counts["late"] += 1
            takes += quality.latest * random.random()
        return takes
