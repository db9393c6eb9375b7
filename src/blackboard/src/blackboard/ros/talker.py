# SPDX-License-Identifier: BSD-3-Clause
"""The Talker on ROS: every callback of a node goes through one queue, in one thread."""

from __future__ import annotations

import heapq
import itertools
import queue
import socket
import time
import xmlrpc.client
from typing import TYPE_CHECKING, Any

import rosgraph
import rospy

from blackboard.ros.conversions import WIRES
from blackboard.talker import SET_STATE

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable

_QUEUE_SIZE = 1000
"""Messages that wait for a slow subscriber; more are dropped, the oldest first."""

_CLOCK_POLL = 0.02
"""Wall time between two looks at a simulated clock [s]; 50 Hz costs well under 1 % of a core."""

_CLOCK_RESET = 1.0
"""A clock that goes back by more than this has been reset [s]."""

_PING_TIMEOUT = 1.0
"""Wall time that a node may take to answer a ping [s]."""


class _Timer:
    """A call that is going to happen; see `blackboard.talker.Timer`."""

    def __init__(self, due: float, period: float | None, action: Callable[[], None]) -> None:
        self.due = due
        self.period = period
        self.action = action
        self.cancelled = False

    def cancel(self) -> None:
        """Make it not happen."""
        self.cancelled = True


class RosTalker:
    """Speaks and listens on the hive's topics; see `blackboard.talker.Talker`.

    Make it after `rospy.init_node`, wire up the core, then `spin`. Publishers are made at once
    because ROS drops what is published before a subscriber has connected.

    Args:
        hive: Namespace of the hive, ending in a slash.
        speaks: Topics that will be published on.

    ROS Publishers and Subscribers: as the core asks, with the types of `conversions.WIRES`.
    """

    def __init__(self, hive: str, speaks: Iterable[str]) -> None:
        self._hive = hive
        self._queue: queue.SimpleQueue[Callable[[], None]] = queue.SimpleQueue()
        self._timers: list[tuple[float, int, _Timer]] = []
        self._order = itertools.count()
        self._simulated = bool(rospy.get_param("/use_sim_time", default=False))
        self._latest = self.now()
        self._publishers = {topic: self._advertise(topic) for topic in speaks}
        # A get() that a signal interrupts waits for ever where the handler outlasts its timeout
        # (CPython 3.11), and rospy shuts down inside the handler: so something has to come.
        rospy.on_shutdown(lambda: self.call(lambda: None))

    def now(self) -> float:
        """Return the time [s]: of the simulation where there is one, else the monotonic clock."""
        return float(rospy.get_time()) if self._simulated else time.monotonic()

    def publish(self, topic: str, message: object) -> None:
        """Tell everyone who listens to a topic."""
        self._publishers[topic].publish(WIRES[topic].to_msg(message))

    def subscribe(self, topic: str, handler: Callable[[Any], None]) -> None:
        """Have every message of a topic handed over; what cannot be read is named and dropped."""
        wire = WIRES[topic]

        def receive(msg: Any) -> None:  # noqa: ANN401  (of the topic's type)
            try:
                value = wire.from_msg(msg)
            except ValueError as error:
                rospy.logwarn_throttle_identical(10, f"a message on {topic} is refused: {error}")
                return
            self.call(lambda: handler(value))

        rospy.Subscriber(self._name(topic), wire.message, receive, queue_size=_QUEUE_SIZE)

    def call(self, action: Callable[[], None]) -> None:
        """Have something done by the talker's own thread; may be called from any thread."""
        self._queue.put(action)

    def every(self, period: float, action: Callable[[], None]) -> _Timer:
        """Call again and again, the first time after one period [s]."""
        return self._schedule(_Timer(self.now() + period, period, action))

    def after(self, delay: float, action: Callable[[], None]) -> _Timer:
        """Call once, after a delay [s]."""
        return self._schedule(_Timer(self.now() + delay, None, action))

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

    def warn(self, text: str) -> None:
        """Tell the person who runs this node; the same text at most every ten seconds."""
        rospy.logwarn_throttle_identical(10, text)

    def spin(self) -> None:
        """Work through the queue and the timers until the node is shut down."""
        while not rospy.is_shutdown():
            self._follow_clock()
            self._call_due()
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

    def _schedule(self, timer: _Timer) -> _Timer:
        heapq.heappush(self._timers, (timer.due, next(self._order), timer))
        return timer

    def _follow_clock(self) -> None:
        """Move all timers along when a simulated clock has been reset."""
        now = self.now()
        shift = now - self._latest
        self._latest = now
        if shift < -_CLOCK_RESET:
            timers = [timer for _, _, timer in self._timers]
            self._timers = []
            for timer in timers:
                timer.due += shift
                self._schedule(timer)

    def _call_due(self) -> None:
        now = self.now()
        while self._timers and self._timers[0][0] <= now:
            _, _, timer = heapq.heappop(self._timers)
            if timer.cancelled:
                continue
            if timer.period is not None:
                # A clock that ran ahead must not bring a burst of calls.
                timer.due = max(timer.due + timer.period, now)
                self._schedule(timer)
            timer.action()

    def _patience(self) -> float:
        """Return how long to wait for the queue before the next timer is due [s of wall time]."""
        if self._simulated:
            return _CLOCK_POLL
        if not self._timers:
            return 1.0
        return max(0.0, min(1.0, self._timers[0][0] - self.now()))
