# SPDX-License-Identifier: BSD-3-Clause
"""Virtual time, and links that lose, duplicate, delay, hold and cut messages.

The network's one generator draws every chance, so the same seed gives the same run.
"""

from __future__ import annotations

import heapq
import itertools
from collections import Counter, deque
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from blackboard.domain.talker import BB_VOTE, SYNC
from hive_lab.virtual.network import Subscription

if TYPE_CHECKING:
    from collections.abc import Callable, Collection
    from random import Random


class Host:
    """One process on a machine of its own.

    Attributes:
        rate: How fast its clock runs; 1.01 gains 1 %.
        frozen: Whether it is suspended.
        held_up: How long it has stood still in the present event [s].
        generation: Counts starts and ends; events for an earlier generation are dropped.
    """

    def __init__(self, network: FaultyNetwork, name: str, rate: float = 1.0) -> None:
        self.network = network
        self.name = name
        self.rate = rate
        self.up = False
        self.frozen = False
        self.generation = 0
        self.handlers: dict[str, list[Callable[[Any], None]]] = {}
        self.watched: tuple[str, Callable[[], None]] | None = None
        self.backlog: list[tuple[bool, Callable[[Any], None], Any]] = []
        self.warnings: list[str] = []
        self.held_up = 0.0

    def hold_up(self, duration: float) -> None:
        """Stand still for a while [s] in the present event, as for a write to a slow disk.

        What it sends in the rest of the event is late by that.
        """
        self.held_up += duration

    def boot(self) -> None:
        """Start, with empty memory."""
        self.generation += 1
        self.up, self.frozen = True, False
        self.handlers, self.watched, self.backlog = {}, None, []
        self.network.started(self)

    def crash(self) -> None:
        """Crash; watchers may get proof of the death."""
        self.generation += 1
        self.up, self.frozen = False, False
        self.handlers, self.backlog = {}, []
        self.network.stopped(self)
        self.network.prove_death(self)

    def thaw(self) -> None:
        """Resume: overdue timers fire first, then the messages that arrived meanwhile."""
        self.frozen = False
        overdue = deque(sorted(self.backlog, key=lambda each: not each[0]))
        self.backlog = []
        while overdue and self.up:
            if self.frozen:  # held up again by what it did
                self.backlog = [*overdue, *self.backlog]
                return
            _, action, argument = overdue.popleft()
            self.network.act(self, action, argument)

    def timer(self, action: Callable[[], None], period: float | None = None) -> _Timer:
        """Return a timer on this host that is not scheduled yet."""
        return _Timer(self, action, period)

    def deliver(self, message: tuple[str, object]) -> None:
        """Deliver a message to its handlers."""
        topic, value = message
        for handler in tuple(self.handlers.get(topic, ())):
            handler(value)


class _Timer:
    """A timer on one host; see `blackboard.domain.talker.Timer`."""

    __slots__ = ("action", "cancelled", "host", "period")

    def __init__(self, host: Host, action: Callable[[], None], period: float | None) -> None:
        self.host = host
        self.action = action
        self.period = period
        self.cancelled = False

    def cancel(self) -> None:
        """Cancel the timer."""
        self.cancelled = True

    def fire(self, _: None) -> None:
        """Run the action, and schedule the next period."""
        if self.cancelled:
            return
        if self.period is not None:
            self.host.network.schedule(
                self.period / self.host.rate, self.host, self.fire, timer=True
            )
        self.action()


class HostTalker:
    """The talker of one host; `namespace` comes before a robot's own topics."""

    def __init__(self, host: Host, namespace: str = "") -> None:
        self._host = host
        self._own = f"{namespace}/set_state"

    def now(self) -> float:
        """Return the time of this host's own clock [s]."""
        return self._host.network.now * self._host.rate

    @property
    def world(self) -> HostTalker:
        """This talker: a simulated robot moves by its host's clock."""
        return self

    def date(self) -> float:
        """Return the same as `now`: in a simulation the date is the world's time."""
        return self.now()

    def publish(self, topic: str, message: object, to: Collection[str] | None = None) -> None:
        """Send a message to every listener, or only to the members in `to`."""
        self._host.network.send(self._host, topic, message, to)

    def subscribe(
        self, topic: str, handler: Callable[[Any], None], when: Callable[[], bool] | None = None
    ) -> Subscription:
        """Subscribe to a topic."""

        def hear(message: object) -> None:
            if when is None or when():
                handler(message)

        name = self._own if topic == "set_state" else topic
        handlers = self._host.handlers.setdefault(name, [])
        handlers.append(hear)
        self._host.network.forget_listeners()
        if topic == SYNC:
            self._host.network.repeat_lists(self._host, hear)
        return Subscription(lambda: handlers.remove(hear))

    def every(self, period: float, action: Callable[[], None]) -> _Timer:
        """Call periodically."""
        return self._start(_Timer(self._host, action, period), period)

    def after(self, delay: float, action: Callable[[], None]) -> _Timer:
        """Call once."""
        return self._start(_Timer(self._host, action, None), delay)

    def _start(self, timer: _Timer, delay: float) -> _Timer:
        host = self._host
        host.network.schedule(delay / host.rate, host, timer.fire, timer=True)
        return timer

    def watch(self, member: str, died: Callable[[], None]) -> None:
        """Watch for the death of a host."""
        self._host.watched = (member, died)

    def refuse(self, topic: str, reason: str) -> None:
        """Ignore a refusal: nobody reads it in a simulation."""

    def warn(self, text: str) -> None:
        """Record a warning to the operator."""
        self._host.warnings.append(f"{self._host.network.now:.2f} {self._host.name}: {text}")


_INSIDE = 0.0005  # latency of a message from a host to itself [s]
FASTEST = 0.001  # least latency between two hosts [s]


@dataclass(frozen=True, slots=True)
class Load:
    """How far a link carries less than is said, for links that keep an order.

    Attributes:
        takes: How long it takes to send an ordinary message [s].
        buffered: Urgent messages wait for what will be sent within this time [s].
        room: Ordinary messages that would have to wait for longer are dropped [s].
    """

    takes: float = 0.0
    buffered: float = 0.0
    room: float = 0.0

    def __str__(self) -> str:
        return (
            f"each message takes {self.takes:.2f} s, urgent ones overtake what waits longer than "
            f"{self.buffered:.2f} s, ordinary ones wait for at most {self.room:.2f} s"
        )


@dataclass(frozen=True, slots=True)
class Quality:
    """The quality of all links.

    Attributes:
        loss: Share of the messages that are lost.
        double: Share of the messages that arrive twice.
        delay: Longest latency of most messages [s]; messages overtake each other.
        late: Share of the messages with a longer latency ...
        latest: ... of up to this [s].
        load: Of links over Zenoh.
    """

    loss: float = 0.0
    double: float = 0.0
    delay: float = 0.02
    late: float = 0.0
    latest: float = 0.0
    load: Load = Load()


class SimulatedCrashError(Exception):
    """The process crashes here, in the middle of its work."""


class FaultyNetwork:
    """The event queue, and all links.

    Attributes:
        proofs: Share of the deaths of which watchers get proof.
        now: The true time [s].
        cut: Pairs of names (sender, receiver) between which no message passes.
        holding: The cut pairs whose messages are kept until `release`.
        after_event: Called with the host after every event on it.
        said: Called with sender, topic and message before each send.
        counts: Lost, late, doubled and held messages, and proven deaths.
    """

    def __init__(self, random: Random, proofs: float = 0.9) -> None:
        self.random = random
        self.proofs = proofs
        self.now = 0.0
        self.events = 0
        self.quality = Quality()
        self.cut: set[tuple[str, str]] = set()
        self.holding: set[tuple[str, str]] = set()
        self.hosts: dict[str, Host] = {}
        self.after_event: Callable[[Host], None] = lambda _: None
        self.said: Callable[[Host, str, object], None] = lambda *_: None
        self.counts: Counter[str] = Counter()
        self._queue: list[Any] = []
        self._held: list[tuple[tuple[str, str], Host, int, tuple[str, object]]] = []
        self._order = itertools.count()
        self._listeners: dict[str, list[Host]] = {}
        self._lists: dict[str, tuple[int, object]] = {}  # by sender, the last of its process

    def add_host(self, name: str, rate: float = 1.0) -> Host:
        """Connect a host."""
        host = self.hosts[name] = Host(self, name, rate)
        self.forget_listeners()
        return host

    def started(self, _host: Host) -> None:
        """Note that a process has started."""
        self.forget_listeners()

    def stopped(self, _host: Host) -> None:
        """Note that a process has ended."""
        self.forget_listeners()

    def forget_listeners(self) -> None:
        """Recompute the listeners of every topic: those of a host have changed."""
        self._listeners.clear()

    def schedule(
        self,
        delay: float,
        host: Host | None,
        action: Callable[[Any], None],
        argument: object = None,
        *,
        timer: bool = False,
    ) -> None:
        """Schedule an action on a host, or in the world if it is None, after a delay [s]."""
        generation = host.generation if host else 0
        entry = (self.now + delay, next(self._order), host, generation, timer, action, argument)
        heapq.heappush(self._queue, entry)

    def run(self, until: float, finished: Callable[[], bool] | None = None) -> None:
        """Let time pass up to a time [s], or until `finished`, asked once a second, is true."""
        queue = self._queue
        next_look = self.now + 1.0
        while queue and queue[0][0] <= until:
            self.now, _, host, generation, timer, action, argument = heapq.heappop(queue)
            if finished is not None and self.now >= next_look:
                next_look = self.now + 1.0
                if finished():
                    return
            if host is None:
                action(argument)
            elif generation == host.generation:
                if host.frozen:
                    host.backlog.append((timer, action, argument))
                else:
                    self.act(host, action, argument)
        self.now = max(self.now, until)

    def act(self, host: Host, action: Callable[[Any], None], argument: object) -> None:
        """Run one event on a host."""
        self.events += 1
        try:
            action(argument)
        except SimulatedCrashError:
            host.crash()
        held_up, host.held_up = host.held_up, 0.0
        if held_up and host.up and not host.frozen:
            host.frozen = True
            self.schedule(held_up, None, self._go_on, (host, host.generation))
        self.after_event(host)

    def _go_on(self, what: tuple[Host, int]) -> None:
        """End the time for which a host stood still."""
        host, generation = what
        if host.frozen and host.generation == generation:
            host.thaw()

    def send(
        self, sender: Host, topic: str, message: object, to: Collection[str] | None = None
    ) -> None:
        """Send a message to every host that listens, the sender included.

        `to` restricts which members, the hosts that listen to votes, get it.
        """
        self.said(sender, topic, message)
        if topic == SYNC:
            self._lists[sender.name] = sender.generation, message
        packet = (topic, message)
        for host in self.listening(topic):
            if to is not None and host.name not in to and BB_VOTE in host.handlers:
                continue
            if host is sender:
                self.schedule(_INSIDE, host, host.deliver, packet)
            else:
                self.pass_on(sender, host, packet)

    def pass_on(self, sender: Host, host: Host, packet: tuple[str, object]) -> None:
        """Have a message arrive at another host, unless it gets lost."""
        quality, random = self.quality, self.random
        if self.cut and (sender.name, host.name) in self.cut:
            self._stop(sender, host, packet)
            return
        if quality.loss and random.random() < quality.loss:
            self.counts["lost"] += 1
            return
        spread = quality.delay - FASTEST
        takes = sender.held_up + FASTEST + spread * random.random() ** 3
        if quality.late and random.random() < quality.late:
            self.counts["late"] += 1
            takes += quality.latest * random.random()
        self.schedule(takes, host, host.deliver, packet)
        if quality.double and random.random() < quality.double:
            self.counts["doubled"] += 1
            self.schedule(FASTEST + spread * random.random(), host, host.deliver, packet)

    def repeat_lists(self, host: Host, hear: Callable[[Any], None]) -> None:
        """Give a new listener the last task list of every process: that topic is latched."""
        for name, (generation, known) in self._lists.items():
            is_up = self.hosts[name].up and self.hosts[name].generation == generation
            if is_up and (name, host.name) not in self.cut:
                self.schedule(_INSIDE if name == host.name else FASTEST, host, hear, known)

    def listening(self, topic: str) -> list[Host]:
        """Return the hosts that listen to a topic."""
        found = self._listeners.get(topic)
        if found is None:
            found = [host for host in self.hosts.values() if topic in host.handlers]
            self._listeners[topic] = found
        return found

    def _stop(self, sender: Host, host: Host, packet: tuple[str, object]) -> None:
        """Lose a message, or keep it until the link is back."""
        pair = sender.name, host.name
        if pair in self.holding:
            self._held.append((pair, host, host.generation, packet))
        else:
            self.counts["cut off"] += 1

    def release(self) -> None:
        """Deliver the kept messages of links that are back, to processes that still run."""
        kept = self._held
        self._held = [each for each in kept if each[0] in self.cut]
        for pair, host, generation, packet in kept:
            if pair not in self.cut and generation == host.generation:
                self.counts["held back"] += 1
                delay = FASTEST + self.quality.delay * self.random.random()
                self.schedule(delay, host, host.deliver, packet)

    def prove_death(self, dead: Host) -> None:
        """Tell most of the watchers that can reach a host that it is dead."""
        for host in self.hosts.values():
            reached = (host.name, dead.name) not in self.cut
            if host.watched is None or host.watched[0] != dead.name or not reached:
                continue
            _, died = host.watched
            host.watched = None
            if self.random.random() < self.proofs:
                self.counts["deaths proved"] += 1
                delay = 0.02 + 0.08 * self.random.random()
                self.schedule(delay, host, host.timer(died).fire)
