# SPDX-License-Identifier: BSD-3-Clause
"""The Talker on ROS: all callbacks of a process go through one queue and one thread."""

from __future__ import annotations

import queue
import socket
import threading
import xmlrpc.client
from collections import defaultdict
from dataclasses import dataclass
from functools import partial
from typing import TYPE_CHECKING, Any

import genpy
import rosgraph
import rospy

from blackboard.board.reception import Reception
from blackboard.codec.tables import WIRES
from blackboard.consensus.member import name_of
from blackboard.consensus.messages import AppendEntries, AppendReply, Ballot, Heartbeat
from blackboard.costing.bid_basis import Bids
from blackboard.domain.characteristics import RobotState, RobotStatus
from blackboard.domain.clock_offsets import ClockOffsets
from blackboard.domain.talker import BACKUP, BB_ACK, BB_ENTRIES, BB_VOTE, ROBOT_STATUS, SET_STATE
from blackboard.ros.liveness import PERIOD, LivenessWatch
from blackboard.ros.rospy_patches.audience import Audience
from blackboard.ros.rospy_patches.reading import unread
from blackboard.ros.timers import Timers
from hive_common.last_heard import LastHeard
from hive_common.machine_clock import machine_time
from hive_common.ros.onward_clock import OnwardClock

if TYPE_CHECKING:
    from collections.abc import Callable, Collection, Iterable

    from blackboard.domain.talker import Subscription, Topic

_QUEUE_SIZE = 1000
"""Messages that wait for a slow subscriber; then the oldest are dropped."""

_FOR_OTHERS = frozenset({BB_ENTRIES, BB_ACK, BB_VOTE})
"""Topics on which a member ignores its own messages."""

_CLOCK_POLL = 0.02
"""Wall time between two checks of a simulated clock [s]; costs well under 1 % of a core."""

_PING_TIMEOUT = 1.0
"""Wall time that a node may take to answer a ping [s]."""

LEADER = "the leader"
"""Whose clock the heartbeats show, in `RosTalker.clocks`."""

SPEAKER_TIMEOUT = 5.0
"""A node that is silent for longer has given up its robot's name [s]; as long as the default of
`reassign`."""


@dataclass(frozen=True)
class _Listener:
    """A handler of one member, and when it wants messages."""

    member: str
    handler: Callable[[Any], None]
    when: Callable[[], bool] | None


class RosTalker:
    """Publishes and subscribes on the hive's topics, for the members of this process.

    Make it after `rospy.init_node`, connect the core to a `MemberTalker` of each member, then call
    `spin`. It advertises at once because ROS drops what is published before a subscriber has
    connected. Members of one process hand each other values; nothing is encoded for them.

    Args:
        hive: Namespace of the hive, ending in a slash.
        advertises: The topics that may be published on.
        robots: The robots of this process. New subscribers of `robot_status` get the last status
            of each; the header of their connection names them in `robots`.

    Attributes:
        refusals: What was refused so far.
        failures: The exceptions that messages have caused so far.
        clocks: How far the clocks of robots, by their names, and of the leader, `LEADER`, are off.
            Under simulated time all have one clock.
        world: Simulated time if `/use_sim_time` is set, else this talker's own clock.
        date: Returns ROS's time [s].

    ROS Publishers and Subscribers: as the core asks, with the types in `codec.tables.WIRES`.
    """

    def __init__(self, hive: str, advertises: Iterable[str], robots: Collection[str] = ()) -> None:
        self._hive = hive
        self._recap = _Recap(robots)
        # Not a SimpleQueue: in Python 3.11 its get() never times out once a signal handler has
        # taken longer than the timeout.
        self._queue: queue.Queue[Callable[[], None]] = queue.Queue()
        self._spins = False
        self._simulated = bool(rospy.get_param("/use_sim_time", default=False))
        self._timers = own = Timers(machine_time)
        self.now, self.every, self.after = own.now, own.every, own.after
        self.world = Timers(OnwardClock(rospy.get_time).now) if self._simulated else own
        self.date = rospy.get_time
        self._backups: rospy.Subscriber | None = None
        self._watches: dict[str, LivenessWatch] = {}
        self._members: dict[str, str] = {}
        self._speakers = Speakers()
        self._handlers: dict[str, list[_Listener]] = defaultdict(list)
        self._reception = Reception(rospy.logwarn)
        self.refusals, self.failures = self._reception.refusals, self._reception.failures
        self.refuse = self.refusals.refuse
        self.clocks = ClockOffsets()
        self._publishers = {topic: self._advertise(topic) for topic in advertises}
        self._audience = Audience(self._node_of)
        self._is_voter = BB_ENTRIES in self._publishers
        self._audience.speaks = self._publishers.get(BB_ENTRIES if self._is_voter else BB_ACK)
        # Wakes `spin`, so that it sees the shutdown.
        rospy.on_shutdown(lambda: self.call(lambda: None))

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
        publisher = self._publishers[topic]
        if isinstance(message, RobotStatus):
            self._recap.note(message)
        if publisher.get_num_connections() or WIRES[topic].latched:
            msg = WIRES[topic].to_msg(message, self.date())
            # A vote may be for a member whose process is not known yet.
            if to is None or topic == BB_VOTE:
                publisher.publish(msg)
            else:
                self._audience.tell(publisher, msg, to)
        name = self._hive + topic
        if name in self._handlers:
            self.call(lambda: self._hand_over(member, topic, name, message, to))

    def _hand_over(
        self, member: str, topic: str, name: str, message: object, to: Collection[str] | None
    ) -> None:
        """Give what a member has published to the members of this process."""
        for each in tuple(self._handlers[name]):
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
        name = member.own + topic if topic == SET_STATE else self._hive + topic
        is_new = name not in self._handlers
        listeners = self._handlers[name]
        listener = _Listener(member.name, handler, when)
        listeners.append(listener)
        if is_new and self._spins:
            # This asks the ROS master, which may be slow or gone.
            threading.Thread(target=self._listen, args=(topic, name), daemon=True).start()
        elif is_new:
            self._listen(topic, name)
        return _Subscription(lambda: listeners.remove(listener))

    def _listen(self, topic: str, name: str) -> None:
        # Without tcp_nodelay, Linux holds small messages back until earlier ones are acknowledged.
        subscriber = rospy.Subscriber(
            name,
            unread(WIRES[topic].message),
            lambda msg: self.call(lambda: self._receive(topic, name, msg)),
            queue_size=_QUEUE_SIZE,
            tcp_nodelay=True,
        )
        if topic == BACKUP and self._is_voter:
            self._backups = subscriber
            self.every(PERIOD, self._check_watches)
        elif topic == (BB_ACK if self._is_voter else BB_ENTRIES):
            self._audience.listens = subscriber

    def _receive(self, topic: str, name: str, msg: Any) -> None:  # noqa: ANN401  (see `unread`)
        sender = msg._connection_header.get("callerid", "")  # noqa: SLF001  (rospy has no other way)
        if sender == rospy.get_name():
            return  # handed over already
        wanted = [each for each in self._handlers[name] if each.when is None or each.when()]
        if not wanted:
            return
        try:
            message = msg.read()
        except (ValueError, genpy.DeserializationError) as error:
            self.refuse(topic, str(error))
            return
        value = self._reception.read(
            topic,
            message,
            WIRES[topic].from_msg,
            lambda value: self._speakers.why_refused(value, sender, machine_time()),
        )
        if value is not None:
            self._compare_clocks(value, message)
            self._reception.hand(topic, value, [each.handler for each in wanted])

    def _compare_clocks(self, value: object, message: Any) -> None:  # noqa: ANN401  (see `unread`)
        """Note how late a message is by its stamp, if it says whose clock made that."""
        if isinstance(value, Heartbeat):
            name = LEADER
        elif isinstance(value, RobotStatus) and value.state is not RobotState.OFFLINE:
            name = value.robot_id
        else:
            return
        if not (self._simulated or message.header.stamp.is_zero()):
            late = rospy.get_time() - message.header.stamp.to_sec()
            self.clocks.hear(name, late, self.now())

    def _node_of(self, name: str) -> str:
        """Return the node that speaks for a member or a robot; empty if unknown."""
        if name in self._members or name in self._members.values():
            return str(rospy.get_name())
        return self._speakers.node_of(name)

    def call(self, action: Callable[[], None]) -> None:
        """Run an action in the talker's own thread; any thread may call this."""
        self._queue.put(action)

    def take(self, topic: str, handle: Callable[[Any], None]) -> Callable[[Any], None]:
        """Return a subscriber's callback that handles messages in the talker's own thread.

        It is for topics that are not the hive's. An exception costs the message only, as on those.
        """
        return lambda msg: self.call(lambda: self._reception.hand(topic, msg, (handle,)))

    def ping(self, member: str) -> bool:
        """Return whether the node of that name answers within a second."""
        socket_timeout = socket.getdefaulttimeout()
        socket.setdefaulttimeout(_PING_TIMEOUT)
        try:
            uri = rosgraph.Master(rospy.get_name()).lookupNode(self._node_of(member))
            with xmlrpc.client.ServerProxy(uri) as node:
                node.getPid(rospy.get_name())
        except (OSError, rosgraph.MasterException, xmlrpc.client.Error):
            return False
        finally:
            socket.setdefaulttimeout(socket_timeout)
        return True

    def watch(self, watcher: str, member: str, died: Callable[[], None]) -> None:
        """Call once when the process of a member is proved dead; see `liveness`."""
        if self._backups is not None:
            watch = self._watches.setdefault(watcher, LivenessWatch(self._backups))
            watch.watch(self._node_of(member), died)

    def _check_watches(self) -> None:
        for watch in tuple(self._watches.values()):
            watch.check()

    def warn(self, text: str) -> None:
        """Log a warning; the same text at most every ten seconds."""
        rospy.logwarn_throttle_identical(10, text)

    def spin(self) -> None:
        """Run the queue and the timers until the node is shut down."""
        self._spins = True
        while not rospy.is_shutdown():
            try:
                act = self._queue.get(timeout=self._patience())
            except queue.Empty:
                act = None
            # What is overdue comes first: the machine may have slept, and a lease ended.
            self._timers.call_due()
            self.world.call_due()
            if act is not None:
                act()

    def _advertise(self, topic: str) -> rospy.Publisher:
        wire = WIRES[topic]
        recap = self._recap if topic == ROBOT_STATUS else None
        publisher = rospy.Publisher(
            self._hive + topic,
            wire.message,
            recap,
            latch=wire.latched,
            headers=recap and recap.headers,
            queue_size=_QUEUE_SIZE,
        )
        if recap is not None:
            recap.lock = publisher.impl.publock
        return publisher

    def _patience(self) -> float:
        """Return how long to wait for the queue until the next timer is due [s, wall time]."""
        waits = [1.0, self._timers.next_due(), _CLOCK_POLL if self._simulated else None]
        return min(wait for wait in waits if wait is not None)


class _Recap(rospy.SubscribeListener):  # type: ignore[misc]  # rospy is not typed
    """Gives a new subscriber the last status of each robot of this process.

    A latched topic gives the last message only.
    """

    def __init__(self, robots: Collection[str]) -> None:
        self.headers = {"robots": " ".join(robots)}
        self.lock: threading.Lock | None = None  # rospy's own, which it does not take here
        self._robots = robots
        self._last: dict[str, RobotStatus] = {}

    def note(self, status: RobotStatus) -> None:
        """Note what is published."""
        if status.robot_id in self._robots:
            self._last[status.robot_id] = status

    def peer_subscribe(
        self, _name: str, _publish: Callable[[object], None], tell: Callable[[object], None]
    ) -> None:
        """Tell a new subscriber; rospy calls this."""
        if self.lock is None:
            return
        with self.lock:
            for status in tuple(self._last.values()):
                tell(WIRES[ROBOT_STATUS].to_msg(status, rospy.get_time()))


class MemberTalker:
    """One member's talker; see `blackboard.domain.talker.Talker`.

    Attributes:
        name: The member's name.
        own: Namespace of its robot, ending in a slash.
        world, date: As those of `RosTalker`.
        clocks: As that of `RosTalker`.
    """

    def __init__(self, talker: RosTalker, name: str, own: str) -> None:
        self.name, self.own = name, own
        self.publish = partial(talker.publish, name)
        self.subscribe = partial(talker.subscribe, self)
        self.watch = partial(talker.watch, name)
        self.now, self.every, self.after = talker.now, talker.every, talker.after
        self.world, self.date = talker.world, talker.date
        self.call, self.take = talker.call, talker.take
        self.ping, self.warn, self.refuse = talker.ping, talker.warn, talker.refuse
        self.refusals, self.failures = talker.refusals, talker.failures
        self.clocks = talker.clocks


class _Subscription:
    def __init__(self, cancel: Callable[[], None]) -> None:
        self.cancel = cancel


class Speakers:
    """Refuses a second node that speaks for a robot while the first still does.

    It is thread-safe: ROS calls back in one thread for each connection.
    """

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self._heard = LastHeard[tuple[str, float]]()
        self._hosts = LastHeard[str]()  # of members that share a process with others

    def node_of(self, name: str) -> str:
        """Return the name of the node that speaks for a robot or a member; empty if unknown."""
        with self._lock:
            return self._hosts.get(name) or (self._heard.get(name) or ("", 0.0))[0]

    def why_refused(self, message: object, node: str, now: float) -> str:
        """Return why a message from a node is refused now [s]; empty if it is not.

        Only a robot's status and bids are checked.
        """
        if isinstance(message, Heartbeat | AppendEntries):
            self._note_host(message.leader, node, now)
        elif isinstance(message, AppendReply | Ballot):
            self._note_host(message.member, node, now)
        if not isinstance(message, RobotStatus | Bids):
            return ""
        if isinstance(message, RobotStatus) and message.state is RobotState.OFFLINE:
            return ""  # published by the blackboard, about the robot
        with self._lock:
            first, heard = self._heard.get(message.robot_id) or (node, now)
            if first != node and now - heard < SPEAKER_TIMEOUT:
                return (
                    f"{node} speaks as {message.robot_id[:64]}, which {first} does already; "
                    "give the robots names of their own"
                )
            self._heard.hear(message.robot_id, (node, now), now)
        return ""

    def _note_host(self, member: str, node: str, now: float) -> None:
        with self._lock:
            self._hosts.hear(name_of(member), node, now)
