# SPDX-License-Identifier: BSD-3-Clause
"""A process on a machine of its own that crashes and freezes, and the port that the core sees."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from hive_lab.virtual.network import Listening

if TYPE_CHECKING:
    from collections.abc import Callable, Collection

    from hive_lab.fault_schedules.network import Network


class Host:
    """One process on a machine of its own.

    Args:
        network: What it is connected to.
        name: Its name.
        rate: How fast its clock runs; 1.01 gains 1 %.

    Attributes:
        up: Whether it runs.
        frozen: Whether it is stopped for a while and knows nothing of it.
        generation: How often it has been started; what was meant for an earlier one is lost.
        on_crash: Called when it crashes by itself.
    """

    def __init__(self, network: Network, name: str, rate: float = 1.0) -> None:
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

    def boot(self) -> None:
        """Start, with nothing in memory."""
        self.generation += 1
        self.up, self.frozen = True, False
        self.handlers, self.watched, self.backlog = {}, None, []
        self.network.forget_listeners()

    def crash(self) -> None:
        """End; those who watch it may get proof of it."""
        self.generation += 1
        self.up, self.frozen = False, False
        self.handlers, self.backlog = {}, []
        self.network.forget_listeners()
        self.network.prove_death(self)

    def thaw(self) -> None:
        """Go on: timers that have become due come first, then what has arrived meanwhile."""
        self.frozen = False
        backlog, self.backlog = self.backlog, []
        for _, action, argument in sorted(backlog, key=lambda each: not each[0]):
            if not self.up or self.frozen:
                return
            self.network.act(self, action, argument)

    def timer(self, action: Callable[[], None], period: float | None = None) -> _Timer:
        """Return a call on this host that has not been scheduled yet."""
        return _Timer(self, action, period)

    def deliver(self, message: tuple[str, object]) -> None:
        """Hand a message to who listens here."""
        topic, value = message
        for handler in tuple(self.handlers.get(topic, ())):
            handler(value)


class _Timer:
    """A call on one host that is going to happen; see `blackboard.domain.talker.Timer`."""

    __slots__ = ("action", "cancelled", "host", "period")

    def __init__(self, host: Host, action: Callable[[], None], period: float | None) -> None:
        self.host = host
        self.action = action
        self.period = period
        self.cancelled = False

    def cancel(self) -> None:
        """Make it not happen."""
        self.cancelled = True

    def fire(self, _: None) -> None:
        """Let it happen."""
        if self.cancelled:
            return
        if self.period is not None:
            self.host.network.schedule(
                self.period / self.host.rate, self.host, self.fire, timer=True
            )
        self.action()


class HostTalker:
    """The talker of one host; see `blackboard.domain.talker.Talker`.

    Args:
        host: Whose it is.
        namespace: Put before the names of a robot's own topics.
    """

    def __init__(self, host: Host, namespace: str = "") -> None:
        self._host = host
        self._own = f"{namespace}/set_state"

    def now(self) -> float:
        """Return the time by this host's own clock [s]."""
        return self._host.network.now * self._host.rate

    def publish(self, topic: str, message: object, to: Collection[str] | None = None) -> None:
        """Send a message to everyone who listens and is not left out."""
        self._host.network.send(self._host, topic, message, to)

    def subscribe(
        self,
        topic: str,
        handler: Callable[[Any], None],
        when: Callable[[], bool] | None = None,
    ) -> Listening:
        """Have the messages of a topic handed over."""

        def hear(message: object) -> None:
            if when is None or when():
                handler(message)

        name = self._own if topic == "set_state" else topic
        handlers = self._host.handlers.setdefault(name, [])
        handlers.append(hear)
        self._host.network.forget_listeners()
        return Listening(lambda: handlers.remove(hear))

    def every(self, period: float, action: Callable[[], None]) -> _Timer:
        """Call again and again."""
        return self._start(_Timer(self._host, action, period), period)

    def after(self, delay: float, action: Callable[[], None]) -> _Timer:
        """Call once."""
        return self._start(_Timer(self._host, action, None), delay)

    def _start(self, timer: _Timer, delay: float) -> _Timer:
        host = self._host
        host.network.schedule(delay / host.rate, host, timer.fire, timer=True)
        return timer

    def ping(self, member: str) -> bool:
        """Return whether a host runs and can be reached."""
        host = self._host.network.hosts.get(member)
        return host is not None and host.up and not host.frozen

    def watch(self, member: str, died: Callable[[], None]) -> None:
        """Be told if a host ends while it is watched."""
        self._host.watched = (member, died)

    def refuse(self, topic: str, reason: str) -> None:
        """Note that a message was refused, which nobody reads in a simulation."""

    def warn(self, text: str) -> None:
        """Note what a person should know."""
        self._host.warnings.append(f"{self._host.network.now:.2f} {self._host.name}: {text}")
