# SPDX-License-Identifier: BSD-3-Clause
"""The link between processes over ROS topics."""

from __future__ import annotations

import threading
from typing import TYPE_CHECKING, Any

import rospy

from blackboard.codec.tables import WIRES
from blackboard.domain.characteristics import RobotStatus
from blackboard.domain.talker import BACKUP, BB_ACK, BB_ENTRIES, BB_VOTE, ROBOT_STATUS
from blackboard.process.link import Arrival
from blackboard.ros.liveness import PERIOD, LivenessWatch
from blackboard.ros.recap import Recap
from blackboard.ros.rospy_patches.audience import Audience
from blackboard.ros.rospy_patches.reading import unread

if TYPE_CHECKING:
    from collections.abc import Callable, Collection, Iterable

    from blackboard.process.link import Inbox

_QUEUE_SIZE = 1000
"""Messages that wait for a slow subscriber; then the oldest are dropped."""


class RosLink:
    """Carries messages on ROS topics; see `process.link.Link`.

    Args:
        hive: Namespace of the hive, ending in a slash.
        advertises: The topics that may be published on.
        robots: The robots of this process; see `ros.talker.RosTalker`.

    Attributes:
        names: That of this node.
    """

    def __init__(self, hive: str, advertises: Iterable[str], robots: Collection[str]) -> None:
        self.names: tuple[str, ...] = (str(rospy.get_name()),)
        self._hive = hive
        self._recap = Recap(robots)
        self._backups: rospy.Subscriber | None = None
        self._watches: dict[str, LivenessWatch] = {}
        self._publishers = {topic: self._advertise(topic) for topic in advertises}
        self._is_voter = BB_ENTRIES in self._publishers

    def attach(self, inbox: Inbox) -> None:
        """Deliver from now on to this talker."""
        self._inbox = inbox
        self._audience = Audience(inbox.node_of)
        self._audience.speaks = self._publishers.get(BB_ENTRIES if self._is_voter else BB_ACK)

    def publish(self, _robot: str, topic: str, value: object, to: Collection[str] | None) -> None:
        """Publish to all subscribers, or without the members that `to` leaves out."""
        publisher = self._publishers[topic]
        if isinstance(value, RobotStatus):
            self._recap.note(value)
        if not (publisher.get_num_connections() or WIRES[topic].latched):
            return
        msg = WIRES[topic].to_msg(value, rospy.get_time())
        # A vote may be for a member whose process is not known yet.
        if to is None or topic == BB_VOTE:
            publisher.publish(msg)
        else:
            self._audience.tell(publisher, msg, to)

    def listen(self, topic: str, name: str) -> None:
        """Subscribe to a topic, by its name below the hive."""
        if self._inbox.spins:
            # This asks the ROS master, which may be slow or gone.
            threading.Thread(target=self._listen, args=(topic, name), daemon=True).start()
        else:
            self._listen(topic, name)

    def _listen(self, topic: str, name: str) -> None:
        # Without tcp_nodelay, Linux holds small messages back until earlier ones are acknowledged.
        subscriber = rospy.Subscriber(
            self._hive + name,
            unread(WIRES[topic].message),
            lambda msg: self._inbox.receive(Arrival(topic, name, _sender(msg), msg.read)),
            queue_size=_QUEUE_SIZE,
            tcp_nodelay=True,
        )
        if topic == BACKUP and self._is_voter:
            self._backups = subscriber
            self._inbox.every(PERIOD, self._check_watches)
        elif topic == (BB_ACK if self._is_voter else BB_ENTRIES):
            self._audience.listens = subscriber

    def why_refused(self, _value: object, _sender: str) -> str:
        """Return an empty text: ROS does not say who a node belongs to."""
        return ""

    def watch(self, watcher: str, node: str, died: Callable[[], None]) -> None:
        """Call once when a node is proved dead; see `liveness`."""
        if self._backups is not None:
            watch = self._watches.setdefault(watcher, LivenessWatch(self._backups))
            watch.watch(node, died)

    def _check_watches(self) -> None:
        for watch in tuple(self._watches.values()):
            watch.check()

    def _advertise(self, topic: str) -> rospy.Publisher:
        wire = WIRES[topic]
        recap = self._recap if topic == ROBOT_STATUS else None
        publisher = rospy.Publisher(
            self._hive + topic,
            wire.message,
            recap,
            latch=wire.latched,
            headers=recap and recap.headers(),
            queue_size=_QUEUE_SIZE,
        )
        if recap is not None:
            recap.attach(publisher)
        return publisher


def _sender(msg: Any) -> str:  # noqa: ANN401  (see `unread`)
    return str(msg._connection_header.get("callerid", ""))  # noqa: SLF001  (rospy has no other way)
