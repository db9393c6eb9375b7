# SPDX-License-Identifier: BSD-3-Clause
"""Carries topics that are not the core's between a machine's ROS master and Zenoh.

Each robot has a ROS master of its own. Its `move_base` announces where it drives on `traffic`, and
the traffic planner, on the machine of the leader, answers on `routes`. A relay in the process of
each member takes what its machine says out, and brings in what others say.
"""

from __future__ import annotations

from collections import deque
from functools import partial
from typing import TYPE_CHECKING, Any

import genpy
import rospy
import zenoh
from zenoh.handlers import Callback

from blackboard.ros.traffic_kinds import TRAFFIC
from blackboard.zenoh.access import key_of
from blackboard.zenoh.link import deserialized, serialized
from hive_common.ros.signals import is_shutting_down

if TYPE_CHECKING:
    from collections.abc import Callable, Collection

    from blackboard.zenoh.session import Own

RELAYED = "relayed"
"""In the header of connections of a relay's publishers, so that no relay takes their messages."""

_SEQ_SIZE = 4
"""A message with a header begins with its number [B], which rospy sets."""

_MOST_LETTERS = 64
_REMEMBERED = 200
_QUEUE_SIZE = 100


class Relay:
    """Carries topics in or out, message by message.

    Args:
        session: Open; the caller closes it.
        own: The hive, and as whom it speaks.
        namespace: Of the hive on this machine, ending in a slash.
        refuse: Notes a topic, and why a message on it was refused.
        ours: All as whom this process speaks; what they say is not brought in.

    ROS Publishers and Subscribers: the topics, as they are asked for.
    """

    def __init__(
        self,
        session: zenoh.Session,
        own: Own,
        namespace: str,
        refuse: Callable[[str, str], None],
        ours: Collection[str] = (),
    ) -> None:
        self._session = session
        self._ours = ours
        self._own = own
        self._namespace = namespace
        self._refuse = refuse
        self._brought: deque[bytes] = deque(maxlen=_REMEMBERED)
        self._kept: list[Any] = []

    def bring_in(self, topic: str, kind: type[genpy.Message]) -> None:
        """Publish on ROS what others say on a topic, as messages of a type.

        What a robot announces is stamped when it comes in: its clock is not this machine's, and
        one that is behind would make the robot look silent, so that nobody gave way to it.
        """
        publisher = rospy.Publisher(
            self._namespace + topic, kind, queue_size=_QUEUE_SIZE, headers={RELAYED: "1"}
        )

        def tell(msg: Any, sender: str) -> None:  # noqa: ANN401  (of the type)
            if sender in self._ours:
                return
            if topic == TRAFFIC:
                _check_speaker(msg, sender)
                msg.header.stamp = rospy.Time.now()
            self._brought.append(serialized(msg)[_SEQ_SIZE:])
            publisher.publish(msg)

        self.hear(topic, kind, "*", tell)

    def hear(
        self,
        topic: str,
        kind: type[genpy.Message],
        sender: str,
        take: Callable[[Any, str], None],
    ) -> None:
        """Have what someone says on a topic taken, in a thread of Zenoh's.

        Args:
            topic: Below the hive.
            kind: The type of its messages.
            sender: Who is heard; `*` for all others.
            take: Called with a message and its sender; a ValueError tells why it is refused.
        """
        listener = Callback(partial(self._hear, topic, kind, take), indirect=False)
        self._kept.append(
            self._session.declare_subscriber(
                key_of(self._own.hive, topic, sender),
                listener,
                allowed_origin=zenoh.Locality.REMOTE,
            )
        )

    def _hear(
        self,
        topic: str,
        kind: type[genpy.Message],
        take: Callable[[Any, str], None],
        sample: zenoh.Sample,
    ) -> None:
        if sample.kind != zenoh.SampleKind.PUT or rospy.is_shutdown():
            return
        try:
            take(deserialized(kind, sample.payload), str(sample.key_expr).rpartition("/")[2])
        except (ValueError, genpy.DeserializationError) as error:
            self._refuse(topic, str(error))
        except rospy.ROSException:
            if not is_shutting_down():  # else its topics have closed
                raise

    def take_out(self, topic: str, kind: type[genpy.Message]) -> None:
        """Say to others what this machine says on a topic, in messages of a type.

        Of what robots announce, that of its own robot: others here have a relay of their own.

        A process gets each topic in one type, so the bytes alone, as AnyMsg, would keep the rest
        of this process from hearing the topic.
        """
        hear = partial(self._take_out, topic, self.advertise(topic))
        rospy.Subscriber(
            self._namespace + topic, kind, hear, queue_size=_QUEUE_SIZE, tcp_nodelay=True
        )

    def advertise(self, topic: str, *, for_display: bool = False) -> zenoh.Publisher:
        """Return what says a topic to others.

        Args:
            topic: Below the hive.
            for_display: Whether it may be lost, and everything else goes first.
        """
        publisher = self._session.declare_publisher(
            key_of(self._own.hive, topic, self._own.name),
            congestion_control=zenoh.CongestionControl.DROP,
            priority=zenoh.Priority.DATA_LOW if for_display else zenoh.Priority.DATA,
            reliability=(
                zenoh.Reliability.BEST_EFFORT if for_display else zenoh.Reliability.RELIABLE
            ),
            allowed_destination=zenoh.Locality.REMOTE,
        )
        self._kept.append(publisher)
        return publisher

    def _take_out(self, topic: str, publisher: zenoh.Publisher, msg: Any) -> None:  # noqa: ANN401  (of a type)
        if topic == TRAFFIC and msg.name != self._own.name:
            return
        header = msg._connection_header  # noqa: SLF001  (rospy has no other way)
        payload = serialized(msg)
        # This process may have a publisher of its own on the topic, which rospy does not tell
        # from the relay's.
        is_own = header.get("callerid") == rospy.get_name()
        if RELAYED in header and not (is_own and payload[_SEQ_SIZE:] not in self._brought):
            return
        publisher.put(payload)


def _check_speaker(msg: Any, sender: str) -> None:  # noqa: ANN401  (a Traffic)
    """Raise ValueError if a robot announces where another one drives."""
    if msg.name != sender:
        raise ValueError(
            f"{sender} announces where {msg.name[:_MOST_LETTERS]!r} drives; a robot announces for "
            "itself only, by its name"
        )
