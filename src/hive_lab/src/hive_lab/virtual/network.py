# SPDX-License-Identifier: BSD-3-Clause
"""The virtual network: an in-process replacement for ROS.

Time passes only inside `Network.run`, which jumps from event to event: hours of a hive take
seconds, and every run is identical. Whoever creates the network chooses how long each message
takes and which ones get lost.
"""

from __future__ import annotations

import heapq
import itertools
import math
from collections import defaultdict
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from blackboard.board.reception import Reception
from blackboard.domain.talker import SET_STATE

if TYPE_CHECKING:
    from collections.abc import Callable, Collection

    from blackboard.domain.talker import Clock

LATENCY = 0.001  # default message latency [s]


@dataclass
class Call:
    """A scheduled event; see `blackboard.domain.talker.Timer`."""

    action: Callable[[], None]
    cancelled: bool = False

    def cancel(self) -> None:
        """Cancel the event."""
        self.cancelled = True


@dataclass(frozen=True)
class Subscription:
    """See `blackboard.domain.talker.Subscription`."""

    cancel: Callable[[], None]


@dataclass(frozen=True)
class Encoded:
    """A message as it comes from elsewhere: each member that hears it decodes it.

    Attributes:
        message: What came.
        decode: Makes the value of it, as the member's talker on ROS does.
    """

    message: object
    decode: Callable[[Any], object]


def _decoded(message: object) -> object:
    return message.decode(message.message) if isinstance(message, Encoded) else message


class Network:
    """Virtual time, and the messages in flight.

    As in ROS, messages of one topic reach one listener in the order they were sent; nothing else
    is ordered.

    Args:
        delay: Returns the latency of the next message to its next listener [s].
        lose: Returns whether a message of a topic gets lost.
        world_rate: Simulated time per time of the network; 0 while the simulation is paused.
        survives: Whether an exception of a handler ends the handling of its message only, as on
            ROS. By default it passes, because a test wants to see it.
        begun: The date at the time 0 [s].

    Attributes:
        now: The time [s].
        sent: Every message with its topic, in sending order.
        heard: The messages that were not lost.
    """

    def __init__(
        self,
        delay: Callable[[], float] = lambda: LATENCY,
        lose: Callable[[str, Any], bool] = lambda _topic, _message: False,
        world_rate: float = 1.0,
        *,
        survives: bool = False,
        begun: float = 0.0,
    ) -> None:
        self.now = 0.0
        self.begun = begun
        self.world_rate = world_rate
        self.survives = survives
        self.sent: list[tuple[str, Any]] = []
        self.heard: list[tuple[str, Any]] = []
        self._delay = delay
        self._lose = lose
        self._calls: list[tuple[float, int, Call]] = []
        self._order = itertools.count()
        self._handlers: dict[str, list[tuple[Callable[[Any], None], str]]] = defaultdict(list)
        self._arrivals: dict[Callable[[Any], None], float] = defaultdict(float)
        self._watchers: list[Callable[[], None]] = []

    def schedule(self, delay: float, action: Callable[[], None]) -> Call:
        """Run an action after a delay [s]."""
        call = Call(action)
        heapq.heappush(self._calls, (self.now + delay, next(self._order), call))
        return call

    def send(self, topic: str, message: object, to: Collection[str] | None = None) -> None:
        """Send a message to every listener, or only to the members named in `to`."""
        self.sent.append((topic, message))
        if self._lose(topic, message):
            return
        self.heard.append((topic, message))
        self.deliver(topic, message, to)

    def deliver(self, topic: str, message: object, to: Collection[str] | None = None) -> None:
        """Have every listener hear a message, which is not among those that were sent."""
        for handler, member in self._handlers[topic]:
            if to is None or not member or member in to:
                self._deliver(handler, message)

    def listen(self, topic: str, handler: Callable[[Any], None], member: str = "") -> Subscription:
        """Subscribe a new function object; `member` names its owner, if it is a member."""
        listener = (handler, member)
        self._handlers[topic].append(listener)
        return Subscription(lambda: self._handlers[topic].remove(listener))

    def watch(self, look: Callable[[], None]) -> None:
        """Call a function after every event."""
        self._watchers.append(look)

    def run(self, duration: float) -> None:
        """Let time pass [s]."""
        end = self.now + duration
        while self._calls and self._calls[0][0] <= end:
            self._happen()
        self.now = end

    def run_until(self, condition: Callable[[], bool], limit: float) -> bool:
        """Let time pass until a condition holds; return whether it does within a limit [s]."""
        end = self.now + limit
        while not condition():
            if not self._calls or self._calls[0][0] > end:
                self.now = end
                return condition()
            self._happen()
        return True

    def _deliver(self, handler: Callable[[Any], None], message: object) -> None:
        arrival = max(self._arrivals[handler], self.now + self._delay())
        self._arrivals[handler] = arrival
        self.schedule(arrival - self.now, lambda: handler(message))

    def _happen(self) -> None:
        self.now, _, call = heapq.heappop(self._calls)
        if not call.cancelled:
            call.action()
            for look in self._watchers:
                look()


class WorldClock:
    """A simulated clock that runs at another speed than the network's."""

    def __init__(self, talker: NetworkTalker, network: Network) -> None:
        self._talker = talker
        self._network = network

    def now(self) -> float:
        """Return the simulated time [s]."""
        return self._network.now * self._network.world_rate

    def every(self, period: float, action: Callable[[], None]) -> Call:
        """Call periodically, for the first time after one period [s]."""
        return self._talker.every(self._on_network(period), action)

    def after(self, delay: float, action: Callable[[], None]) -> Call:
        """Call once, after a delay [s]."""
        return self._talker.after(self._on_network(delay), action)

    def _on_network(self, duration: float) -> float:
        rate = self._network.world_rate
        return duration / rate if rate else math.inf


class NetworkTalker:
    """One member's talker on a `Network`; see `blackboard.domain.talker.Talker`.

    Attributes:
        warnings: What the member has told its operator.
        connected: Whether the network reaches the member. A disconnected member keeps running.
        running: Whether the member's process is alive.
    """

    def __init__(self, network: Network, member: str) -> None:
        self._network = network
        self._member = member
        self.warnings: list[str] = []
        self._reception = Reception(self.warn)
        self.refusals, self.failures = self._reception.refusals, self._reception.failures
        self.connected = True
        self.running = True

    def now(self) -> float:
        """Return the virtual time [s]."""
        return self._network.now

    @property
    def world(self) -> Clock:
        """The clock of what robots do."""
        return self if self._network.world_rate == 1.0 else WorldClock(self, self._network)

    def date(self) -> float:
        """Return the time that messages state [s]."""
        return self._network.begun + self.world.now()

    def publish(self, topic: str, message: object, to: Collection[str] | None = None) -> None:
        """Send a message to every listener, or only to the members in `to`."""
        if self.connected and self.running:
            self._network.send(self._name(topic), message, to)

    def subscribe(
        self, topic: str, handler: Callable[[Any], None], when: Callable[[], bool] | None = None
    ) -> Subscription:
        """Subscribe to a topic."""

        def receive(message: object) -> None:
            if not (self.connected and self.running) or (when is not None and not when()):
                return
            value = self._reception.read(topic, message, _decoded)
            if value is not None and self._network.survives:
                self._reception.hand(topic, value, (handler,))
            elif value is not None:
                handler(value)

        return self._network.listen(self._name(topic), receive, self._member)

    def every(self, period: float, action: Callable[[], None]) -> Call:
        """Call periodically, for the first time after one period [s]."""

        def repeat() -> None:
            if self.running and not handle.cancelled:
                self._network.schedule(period, repeat)
                action()

        handle = self._network.schedule(period, repeat)
        return handle

    def after(self, delay: float, action: Callable[[], None]) -> Call:
        """Call once, after a delay [s]."""

        def act() -> None:
            if self.running:
                action()

        return self._network.schedule(delay, act)

    def watch(self, member: str, died: Callable[[], None]) -> None:
        """Watch a member; this network never proves a death."""

    def warn(self, text: str) -> None:
        """Record a warning to the operator."""
        self.warnings.append(text)

    def refuse(self, topic: str, reason: str) -> None:
        """Record a refused message."""
        self.refusals.refuse(topic, reason)

    def _name(self, topic: str) -> str:
        return f"{self._member}/{topic}" if topic == SET_STATE else topic
