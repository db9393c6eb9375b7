# SPDX-License-Identifier: BSD-3-Clause
"""The Talker on ROS: every callback of a node goes through one queue, in one thread."""

from __future__ import annotations

import queue
import socket
import threading
import time
import xmlrpc.client
from collections import defaultdict
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import genpy
import rosgraph
import rospy

from blackboard.board.intake import why_refused
from blackboard.board.refusals import Refusals
from blackboard.domain.talker import BACKUP, BB_ACK, BB_ENTRIES, BB_VOTE, SET_STATE
from blackboard.ros.codec.conversions import WIRES
from blackboard.ros.liveness import PERIOD, LivenessWatch
from blackboard.ros.rospy_patches.audience import Audience
from blackboard.ros.rospy_patches.unread import unread
from blackboard.ros.speakers import Speakers
from blackboard.ros.timers import Timers
from hive_common.ros.onward_clock import OnwardClock

if TYPE_CHECKING:
    from collections.abc import Callable, Collection, Iterable

    from blackboard.domain.talker import Subscription, Timer

    _Listener = tuple[Callable[[Any], None], Callable[[], bool] | None]

_QUEUE_SIZE = 1000
"""Messages that wait for a slow subscriber; more are dropped, the oldest first."""

_FOR_OTHERS = frozenset({BB_ENTRIES, BB_ACK, BB_VOTE})
"""Topics on which a member only tells others what it knows itself."""

_CLOCK_POLL = 0.02
"""Wall time between two looks at a simulated clock [s]; 50 Hz costs well under 1 % of a core."""

_PING_TIMEOUT = 1.0
"""Wall time that a node may take to answer a ping [s]."""


class RosTalker:
    """Speaks and listens on the hive's topics; see `blackboard.domain.talker.Talker`.

    Make it after `rospy.init_node`, wire up the core, then `spin`. Publishers are made at once
    because ROS drops what is published before a subscriber has connected.

    Args:
        hive: Namespace of the hive, ending in a slash.
        speaks: Topics that will be published on.

    Attributes:
        refusals: What was refused so far.
        steady: The same talker by the machine's own clock.

    ROS Publishers and Subscribers: as the core asks, with the types of `conversions.WIRES`.
    """

    def __init__(self, hive: str, speaks: Iterable[str]) -> None:
        self._hive = hive
        # Not a SimpleQueue: in Python 3.11 its get() waits for ever, whatever the timeout, once a
        # signal handler has taken longer than that.
        self._queue: queue.Queue[Callable[[], None]] = queue.Queue()
        self._spins = False
        self._simulated = bool(rospy.get_param("/use_sim_time", default=False))
        self._clock = OnwardClock(rospy.get_time if self._simulated else time.monotonic)
        self._timers = Timers(self.now)
        self._death: LivenessWatch | None = None
        self._speakers = Speakers()
        self._handlers: dict[str, list[_Listener]] = defaultdict(list)
        self.refusals = Refusals(rospy.logwarn)
        self.steady = SteadyTalker(self)
        self._publishers = {topic: self._advertise(topic) for topic in speaks}
        self._audience = Audience(self._speakers.node_of)
        self._stands_by = BB_ENTRIES in self._publishers
        self._audience.speaks = self._publishers.get(BB_ENTRIES if self._stands_by else BB_ACK)
        # Whoever waits for the queue is to see that the node is shut down.
        rospy.on_shutdown(lambda: self.call(lambda: None))

    def now(self) -> float:
        """Return the time [s]: of the simulation where there is one, else the monotonic clock."""
        return self._clock.now()

    def publish(self, topic: str, message: object, to: Collection[str] | None = None) -> None:
        """Tell everyone who listens to a topic and is not left out."""
        publisher, msg = self._publishers[topic], WIRES[topic].to_msg(message)
        if to is None:
            publisher.publish(msg)
        else:
            self._audience.tell(publisher, msg, to)

    def subscribe(
        self,
        topic: str,
        handler: Callable[[Any], None],
        when: Callable[[], bool] | None = None,
    ) -> Subscription:
        """Have the messages of a topic handed over; what cannot be read is named and dropped.

        A message is read once, however many want it, and not at all where nobody does.
        """
        is_new = topic not in self._handlers
        handlers = self._handlers[topic]
        listener = (handler, when)
        handlers.append(listener)
        if is_new and self._spins:
            # The ROS master has to be asked, which may be slow, or gone.
            threading.Thread(target=self._listen, args=(topic,), daemon=True).start()
        elif is_new:
            self._listen(topic)
        return _Listening(lambda: handlers.remove(listener))

    def _listen(self, topic: str) -> None:
        # Otherwise the system holds small messages back until those before are acknowledged.
        subscriber = rospy.Subscriber(
            self._name(topic),
            unread(WIRES[topic].message),
            lambda msg: self.call(lambda: self._take_in(topic, msg)),
            queue_size=_QUEUE_SIZE,
            tcp_nodelay=True,
        )
        if topic == BACKUP and self._stands_by:
            self._death = LivenessWatch(subscriber)
            self.steady.every(PERIOD, self._death.look)
        elif topic == (BB_ACK if self._stands_by else BB_ENTRIES):
            self._audience.listens = subscriber

    def _take_in(self, topic: str, msg: Any) -> None:  # noqa: ANN401  (see `unread`)
        sender = msg._connection_header.get("callerid", "")  # noqa: SLF001  (rospy has no other way)
        if topic in _FOR_OTHERS and sender == rospy.get_name():
            return
        wanted = [handler for handler, when in self._handlers[topic] if when is None or when()]
        if not wanted:
            return
        try:
            value = WIRES[topic].from_msg(msg.read())
            reason = why_refused(topic, value)
            reason = reason or self._speakers.why_refused(value, sender, time.monotonic())
        except (ValueError, genpy.DeserializationError) as error:
            reason = str(error)
        if reason:
            self.refuse(topic, reason)
            return
        for handler in wanted:
            handler(value)

    def call(self, action: Callable[[], None]) -> None:
        """Have something done by the talker's own thread; may be called from any thread."""
        self._queue.put(action)

    def every(self, period: float, action: Callable[[], None]) -> Timer:
        """Call again and again, the first time after one period [s]."""
        return self._timers.start(period, period, action)

    def after(self, delay: float, action: Callable[[], None]) -> Timer:
        """Call once, after a delay [s]."""
        return self._timers.start(delay, None, action)

    def ping(self, member: str) -> bool:
        """Return whether the node of that name answers within a second."""
        socket_timeout = socket.getdefaulttimeout()
        socket.setdefaulttimeout(_PING_TIMEOUT)
        try:
            uri = rosgraph.Master(rospy.get_name()).lookupNode(member)
            with xmlrpc.client.ServerProxy(uri) as node:
                node.getPid(rospy.get_name())
        except (OSError, rosgraph.MasterException, xmlrpc.client.Error):
            return False
        finally:
            socket.setdefaulttimeout(socket_timeout)
        return True

    def watch(self, member: str, died: Callable[[], None]) -> None:
        """Call once when the node of that name is proved dead; see `death`."""
        if self._death is not None:
            self._death.watch(member, died)

    def warn(self, text: str) -> None:
        """Tell the person who runs this node; the same text at most every ten seconds."""
        rospy.logwarn_throttle_identical(10, text)

    def refuse(self, topic: str, reason: str) -> None:
        """Note that a message of a topic was refused; see `blackboard.domain.talker.Talker.refuse`."""
        self.refusals.refuse(topic, reason)

    def spin(self) -> None:
        """Work through the queue and the timers until the node is shut down."""
        self._spins = True
        while not rospy.is_shutdown():
            self._timers.call_due()
            self.steady.timers.call_due()
            try:
                self._queue.get(timeout=self._patience())()
            except queue.Empty:
                continue

    def _advertise(self, topic: str) -> rospy.Publisher:
        wire = WIRES[topic]
        return rospy.Publisher(
            self._name(topic), wire.message, latch=wire.latched, queue_size=_QUEUE_SIZE
        )

    def _name(self, topic: str) -> str:
        return topic if topic == SET_STATE else self._hive + topic

    def _patience(self) -> float:
        """Return how long to wait for the queue before the next timer is due [s of wall time]."""
        waits = [1.0, self.steady.timers.next_due()]
        waits.append(_CLOCK_POLL if self._simulated else self._timers.next_due())
        return min(wait for wait in waits if wait is not None)


@dataclass(frozen=True)
class _Listening:
    """A topic that is listened to; see `blackboard.domain.talker.Subscription`."""

    cancel: Callable[[], None]


class SteadyTalker:
    """The same talker by the machine's own clock, which no simulation slows down or speeds up.

    A network does not get faster with simulated time, so who is missed, and when, is a matter of
    this clock.

    Args:
        talker: Who speaks and listens.

    Attributes:
        timers: What is going to happen.
    """

    def __init__(self, talker: RosTalker) -> None:
        self._talker = talker
        self.timers = Timers(time.monotonic)
        self.publish = talker.publish
        self.subscribe = talker.subscribe
        self.ping = talker.ping
        self.watch = talker.watch
        self.warn = talker.warn
        self.refuse = talker.refuse

    def now(self) -> float:
        """Return the time [s] by the monotonic clock."""
        return time.monotonic()

    def every(self, period: float, action: Callable[[], None]) -> Timer:
        """Call again and again, the first time after one period [s]."""
        return self.timers.start(period, period, action)

    def after(self, delay: float, action: Callable[[], None]) -> Timer:
        """Call once, after a delay [s]."""
        return self.timers.start(delay, None, action)
