# SPDX-License-Identifier: BSD-3-Clause
"""The Talker of a process: all callbacks go through one queue and one thread."""

from __future__ import annotations

import queue
from collections import defaultdict, deque
from dataclasses import dataclass
from functools import partial
from typing import TYPE_CHECKING, Any, Protocol

import genpy

from blackboard.board.reception import Reception
from blackboard.codec.tables import WIRES
from blackboard.consensus.messages import Heartbeat
from blackboard.domain.characteristics import RobotState, RobotStatus
from blackboard.domain.clock_offsets import ClockOffsets
from blackboard.domain.talker import BB_ACK, BB_ENTRIES, BB_VOTE, SET_STATE, URGENT
from blackboard.process.backlog import Backlog
from blackboard.process.speakers import Speakers
from blackboard.process.timers import Timers
from hive_common.machine_clock import machine_time

if TYPE_CHECKING:
    from collections.abc import Callable, Collection

    from blackboard.domain.talker import Subscription, Topic
    from blackboard.process.link import Arrival, Link

_FOR_OTHERS = frozenset({BB_ENTRIES, BB_ACK, BB_VOTE})
"""Topics on which a member ignores its own messages."""

_CLOCK_POLL = 0.02
"""Wall time between two checks of a simulated clock [s]; costs well under 1 % of a core."""

LEADER = "the leader"
"""Whose clock the heartbeats show, in `ProcessTalker.clocks`."""


class Runtime(Protocol):
    """What a process gives its talker.

    Attributes:
        simulated: Returns simulated time [s]; None outside a simulation.
    """

    simulated: Callable[[], float] | None

    def date(self) -> float:
        """Return the time that messages state [s]."""

    def warn(self, text: str) -> None:
        """Tell the person who runs this process."""

    def warn_seldom(self, text: str) -> None:
        """Tell the person who runs this process; the same text at most every ten seconds."""

    def is_shutdown(self) -> bool:
        """Return whether the process is to end."""


@dataclass(frozen=True)
class _Listener:
    """A handler of one member, and when it wants messages."""

    member: str
    handler: Callable[[Any], None]
    when: Callable[[], bool] | None


class ProcessTalker:
    """Publishes and subscribes on the hive's topics, for the members of this process.

    Connect the core to a `MemberTalker` of each member, then call `spin`. Members of one process
    hand each other values; nothing is encoded for them.

    Args:
        hive: Namespace of the hive, ending in a slash.
        link: Carries messages to and from other processes.
        runtime: The process's clocks and log.

    Attributes:
        spins: Whether `spin` runs.
        refusals: What was refused so far.
        failures: The exceptions that messages have caused so far.
        clocks: How far the clocks of robots, by their names, and of the leader, `LEADER`, are off.
            Under simulated time all have one clock.
        world: Simulated time in a simulation, else this talker's own clock.
        date: Returns the time that messages state [s].
    """

    def __init__(self, hive: str, link: Link, runtime: Runtime) -> None:
        self._hive = hive
        self._link = link
        self._runtime = runtime
        # Not a SimpleQueue: in Python 3.11 its get() never times out once a signal handler has
        # taken longer than the timeout.
        self._queue: queue.Queue[Callable[[], None] | None] = queue.Queue()
        self._urgent: deque[Callable[[], None]] = deque()
        self._backlog = Backlog()
        self.spins = False
        self._timers = own = Timers(machine_time)
        self.now, self.every, self.after = own.now, own.every, own.after
        self.world = own if runtime.simulated is None else Timers(runtime.simulated)
        self.date = runtime.date
        self.warn = runtime.warn_seldom
        self._members: dict[str, str] = {}
        self._speakers = Speakers()
        self._handlers: dict[str, list[_Listener]] = defaultdict(list)
        self._reception = Reception(runtime.warn)
        self.refusals, self.failures = self._reception.refusals, self._reception.failures
        self.refuse = self.refusals.refuse
        self.clocks = ClockOffsets()
        link.attach(self)

    def member(self, node: str, robot: str = "", own: str = "") -> MemberTalker:
        """Return the talker of a member of this process.

        Args:
            node: The member's name, that of its node if it runs alone.
            robot: The robot that it speaks for; empty if none.
            own: Namespace of the robot, ending in a slash.
        """
        self._members[node] = robot
        return MemberTalker(self, node, own)

    def publish(
        self, member: str, topic: str, message: object, to: Collection[str] | None = None
    ) -> None:
        """Publish to all subscribers, or without the members that `to` leaves out."""
        self._link.publish(self._members.get(member, ""), topic, message, to)
        if topic in self._handlers:
            self.call(lambda: self._hand_over(member, topic, message, to))

    def _hand_over(
        self, member: str, topic: str, message: object, to: Collection[str] | None
    ) -> None:
        """Give what a member has published to the members of this process."""
        for each in tuple(self._handlers[topic]):
            if topic in _FOR_OTHERS and each.member == member:
                continue
            if to is not None and not {each.member, self._members.get(each.member)} & set(to):
                continue
            # One after the other: what one does may say whether the next wants it.
            if each.when is None or each.when():
                self._reception.hand(topic, message, (each.handler,))

    def subscribe(
        self,
        member: MemberTalker,
        topic: Topic[Any],
        handler: Callable[[Any], None],
        when: Callable[[], bool] | None = None,
    ) -> Subscription:
        """Pass on the messages of a topic; those that cannot be decoded are refused.

        A message is decoded once for all handlers, and not at all if none wants it.
        """
        own = member.own.removeprefix(self._hive) if topic == SET_STATE else ""
        name = own + topic
        is_new = name not in self._handlers
        listeners = self._handlers[name]
        listener = _Listener(member.name, handler, when)
        listeners.append(listener)
        if is_new:
            self._link.listen(topic, name)
        return _Subscription(lambda: listeners.remove(listener))

    def receive(self, arrival: Arrival) -> None:
        """Take a message from another process; any thread may call this.

        One of an urgent topic overtakes all others that wait.
        """
        if not self._backlog.admits(arrival.sender, arrival.topic):
            return
        if arrival.topic in URGENT:
            self._urgent.append(lambda: self._take_waiting(arrival))
            self._queue.put(None)  # wakes `spin`
        else:
            self.call(lambda: self._take_waiting(arrival))

    def _take_waiting(self, arrival: Arrival) -> None:
        for topic, count in self._backlog.leaves(arrival.sender).items():
            self.refuse(topic, f"{arrival.sender} says more than is read here", count)
        self._receive(arrival)

    def _receive(self, arrival: Arrival) -> None:
        if arrival.sender in self._link.names:
            return  # handed over already
        listeners = self._handlers[arrival.name]
        wanted = [
            each
            for each in listeners
            if not arrival.to or self._members.get(each.member) == arrival.to
            if each.when is None or each.when()
        ]
        if not wanted:
            return
        topic = arrival.topic
        try:
            message = arrival.read()
        except ValueError as error:
            self.refuse(topic, str(error))
            return
        except genpy.DeserializationError:
            kind = WIRES[topic].message.__name__
            self.refuse(topic, f"{arrival.sender} sends bytes that are no {kind}")
            return
        value = self._reception.read(
            topic,
            message,
            WIRES[topic].from_msg,
            lambda value: self._why_refused(value, arrival.sender),
        )
        if value is not None:
            self._compare_clocks(value, message)
            self._reception.hand(topic, value, [each.handler for each in wanted])

    def _why_refused(self, value: object, sender: str) -> str:
        return self._link.why_refused(value, sender) or self._speakers.why_refused(
            value, sender, machine_time()
        )

    def _compare_clocks(self, value: object, message: Any) -> None:  # noqa: ANN401  (a topic's)
        """Note how late a message is by its stamp, if it says whose clock made that."""
        if isinstance(value, Heartbeat):
            name = LEADER
        elif isinstance(value, RobotStatus) and value.state is not RobotState.OFFLINE:
            name = value.robot_id
        else:
            return
        if self._runtime.simulated is None and not message.header.stamp.is_zero():
            late = self.date() - message.header.stamp.to_sec()
            self.clocks.hear(name, late, self.now())

    def node_of(self, name: str) -> str:
        """Return the process that speaks for a member or a robot; empty if unknown."""
        if name in self._members or name in self._members.values():
            return self._link.names[0]
        return self._speakers.node_of(name)

    def call(self, action: Callable[[], None]) -> None:
        """Run an action in the talker's own thread; any thread may call this."""
        self._queue.put(action)

    def take(self, topic: str, handle: Callable[[Any], None]) -> Callable[[Any], None]:
        """Return a subscriber's callback that handles messages in the talker's own thread.

        It is for topics that are not the hive's. An exception costs the message only, as on those.
        """
        return lambda msg: self.call(lambda: self._reception.hand(topic, msg, (handle,)))

    def watch(self, watcher: str, member: str, died: Callable[[], None]) -> None:
        """Call once when the process of a member is proved dead."""
        self._link.watch(watcher, self.node_of(member), died)

    def spin(self) -> None:
        """Run the queue and the timers until the process is to end."""
        self.spins = True
        while not self._runtime.is_shutdown():
            try:
                act = self._queue.get(timeout=self._patience())
            except queue.Empty:
                act = None
            # Else a leader that has a burst of tasks to take in would believe that nobody answers.
            for _ in range(len(self._urgent)):
                self._urgent.popleft()()
            # What is overdue comes first: the machine may have slept, and a lease ended.
            self._timers.call_due()
            self.world.call_due()
            if act is not None:
                act()

    def _patience(self) -> float:
        """Return how long to wait for the queue until the next timer is due [s, wall time]."""
        simulated = self.world is not self._timers
        waits = [1.0, self._timers.next_due(), _CLOCK_POLL if simulated else None]
        return min(wait for wait in waits if wait is not None)


class MemberTalker:
    """One member's talker; see `blackboard.domain.talker.Talker`.

    Attributes:
        name: The member's name.
        own: Namespace of its robot, ending in a slash.
        world, date: As those of `ProcessTalker`.
        clocks: As that of `ProcessTalker`.
    """

    def __init__(self, talker: ProcessTalker, name: str, own: str) -> None:
        self.name, self.own = name, own
        self.publish = partial(talker.publish, name)
        self.subscribe = partial(talker.subscribe, self)
        self.watch = partial(talker.watch, name)
        self.now, self.every, self.after = talker.now, talker.every, talker.after
        self.world, self.date = talker.world, talker.date
        self.call, self.take = talker.call, talker.take
        self.warn, self.refuse = talker.warn, talker.refuse
        self.refusals, self.failures = talker.refusals, talker.failures
        self.clocks = talker.clocks


class _Subscription:
    def __init__(self, cancel: Callable[[], None]) -> None:
        self.cancel = cancel
