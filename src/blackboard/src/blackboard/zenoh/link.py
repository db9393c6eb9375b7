# SPDX-License-Identifier: BSD-3-Clause
"""The link between processes over Zenoh."""

from __future__ import annotations

import io
import time
from functools import partial
from typing import TYPE_CHECKING, Any

import zenoh
from zenoh.handlers import Callback

from blackboard.codec.tables import WIRES
from blackboard.domain.talker import URGENT
from blackboard.process.link import Arrival
from blackboard.zenoh.access import ALIVE, LISTENS, key_of, keys_for, keys_to
from blackboard.zenoh.authenticity import Authenticity
from blackboard.zenoh.delivery import BEST_EFFORT, REPEATED, is_repeated
from blackboard.zenoh.presence import NO_ADDRESS, Presence, Token
from hive_common.machine_clock import machine_time

if TYPE_CHECKING:
    from collections.abc import Callable, Collection, Iterable, Mapping, Sequence

    from blackboard.codec.tables import Wire
    from blackboard.process.link import Inbox

MAX_SIZE = 8_000_000
"""Size of a message [B]; a list of 10,000 tasks takes about 5 MB."""


class ZenohLink:
    """Carries messages over Zenoh, on the keys that `access` describes.

    A message that a slow listener has no room for is dropped for that listener, so that it holds
    nobody up; whoever needs an answer asks again.

    Args:
        session: Open; the caller closes it.
        hive: The hive's name, one part of a key.
        name: That of this process, one part of a key; of a robot's process, the robot's.
        advertises: The topics that may be published on.
        namespace: Of the hive, ending in a slash; names of members begin with it.
        is_member: Whether it is left out of what concerns other members only.
        among: All robots of this process, if it has several; see `links`.
        address: Where others reach this session, as HOST:PORT; empty if nowhere.
        date: Returns the time that messages state [s].
        wires: The messages of each topic.

    Attributes:
        names: That of this process.
    """

    def __init__(
        self,
        session: zenoh.Session,
        hive: str,
        name: str,
        advertises: Iterable[str],
        *,
        namespace: str = "/",
        is_member: bool = True,
        among: Sequence[str] = (),
        address: str = "",
        date: Callable[[], float] = time.time,
        wires: Mapping[str, Wire] = WIRES,
    ) -> None:
        self.names: tuple[str, ...] = (name,)
        self._name = name
        self._session = session
        self._hive = hive
        self._namespace = namespace
        self._is_member = is_member
        self._among = among
        self._hears_all = not among or name == among[0]
        self._date = date
        self._wires = wires
        self._publishers = {topic: self._advertise(topic) for topic in advertises}
        self._last: dict[str, bytes] = {}
        self._authenticity = Authenticity(namespace, machine_time)
        self._token = Token(name, str(session.info.zid()), address or NO_ADDRESS)
        self._tokens: list[Any] = []

    def attach(self, inbox: Inbox) -> None:
        """Deliver from now on to this talker."""
        self._inbox = inbox
        if self._hears_all:
            self._presence = Presence(self._hosts, inbox.after)
            self._follow(ALIVE, "*/*/*", self._presence.appear, self._presence.vanish)
        for topic in REPEATED & self._publishers.keys():
            self._follow(f"{LISTENS}/{topic}", "*/*/*", partial(self._repeat, topic))
        self._declare(self._token.key(self._key(ALIVE)))

    def publish(self, _robot: str, topic: str, value: object, to: Collection[str] | None) -> None:
        """Send a value to all who listen, or to programs and those members that it concerns."""
        publisher = self._publishers[topic]
        payload = serialized(self._wires[topic].to_msg(value, self._date()))
        if is_repeated(topic, value, self._name):
            self._last[topic] = payload
        if to is None:
            publisher.put(payload)
            return
        processes = {self._process_of(name) for name in to} - {self._name, *self._among}
        for key in keys_to(self._hive, topic, self._name, processes):
            self._session.put(
                key,
                payload,
                congestion_control=publisher.congestion_control,
                priority=publisher.priority,
                allowed_destination=zenoh.Locality.REMOTE,
            )

    def _process_of(self, name: str) -> str:
        """Return the name of the process of a member or a robot."""
        return name.removeprefix(self._namespace).partition("/")[0]

    def publish_to_robot(self, robot: str, topic: str, value: object) -> None:
        """Send a value on a topic in the namespace of a robot."""
        payload = serialized(self._wires[topic].to_msg(value, self._date()))
        self._publisher(f"{robot}/{topic}").put(payload)

    def is_heard(self, name: str) -> bool:
        """Return whether anybody listens to what this process says on a topic.

        Args:
            name: Of the topic, below the hive.
        """
        # Zenoh's type hints say that it is a bool, which it is not.
        status: Any = self._publisher(name).matching_status
        return bool(status.matching)

    def _publisher(self, name: str) -> zenoh.Publisher:
        if name not in self._publishers:
            self._publishers[name] = self._advertise(name)
        return self._publishers[name]

    def _repeat(self, topic: str, token: Token) -> None:
        """Say what was said last, for someone who has begun to listen."""
        if token.sender != self._name and topic in self._last:
            self._publishers[topic].put(self._last[topic])

    def listen(self, topic: str, name: str) -> None:
        """Deliver what others say on a topic, by its name below the hive."""
        hear = Callback(partial(self._hear, topic, name), indirect=False)
        to_all, to_me = keys_for(self._hive, name, self._name if self._is_member else "")
        self._session.declare_subscriber(to_me, hear)
        if not self._hears_all:
            return
        self._session.declare_subscriber(to_all, hear)
        if topic in REPEATED:
            self._declare(self._token.key(self._key(f"{LISTENS}/{topic}")))

    def _hear(self, topic: str, name: str, sample: zenoh.Sample) -> None:
        if sample.kind == zenoh.SampleKind.PUT:
            said = str(sample.key_expr).removeprefix(key_of(self._hive, name, ""))
            sender, _, to = said.partition("/")
            read = partial(deserialized, self._wires[topic].message, sample.payload)
            robot = to if self._among else ""
            self._inbox.receive(Arrival(topic, name, sender, read, robot))

    def why_refused(self, value: object, sender: str) -> str:
        """Return why a process may not say this; empty if it may."""
        return self._authenticity.why_refused(value, sender)

    def watch(self, watcher: str, node: str, died: Callable[[], None]) -> None:
        """Call once when a process is proved dead; see `presence`."""
        self._presence.watch(watcher, node, died)

    def _advertise(self, topic: str) -> zenoh.Publisher:
        urgent = topic in URGENT
        return self._session.declare_publisher(
            key_of(self._hive, topic, self._name),
            congestion_control=zenoh.CongestionControl.DROP,
            priority=zenoh.Priority.INTERACTIVE_HIGH if urgent else zenoh.Priority.DATA,
            # What this process listens to itself is no reason to encode a message.
            allowed_destination=zenoh.Locality.REMOTE,
            reliability=(
                zenoh.Reliability.BEST_EFFORT
                if topic in BEST_EFFORT
                else zenoh.Reliability.RELIABLE
            ),
        )

    def _follow(
        self,
        kind: str,
        whose: str,
        appear: Callable[[Token], None],
        vanish: Callable[[Token], None] = lambda _token: None,
    ) -> None:
        """Tell in the talker's thread which tokens appear and vanish, and which are there."""

        def note(sample: zenoh.Sample) -> None:
            tell = appear if sample.kind == zenoh.SampleKind.PUT else vanish
            token = Token.read(str(sample.key_expr))
            self._inbox.call(lambda: tell(token))

        self._session.liveliness().declare_subscriber(
            f"{self._key(kind)}/{whose}", Callback(note, indirect=False), history=True
        )

    def _declare(self, key: str) -> None:
        self._tokens.append(self._session.liveliness().declare_token(key))

    def _key(self, kind: str) -> str:
        return f"hive/{self._hive}/{kind}"

    def _hosts(self) -> dict[str, str]:
        """Return the hosts that this session is connected to, by the ids of their sessions."""
        return {
            str(each.zid): each.dst.partition("/")[2].rpartition(":")[0]
            for each in self._session.info.links()
        }


def serialized(msg: Any) -> bytes:  # noqa: ANN401  (a message of any type)
    """Return a message as bytes, as ROS sends it."""
    written = io.BytesIO()
    msg.serialize(written)
    return written.getvalue()


def deserialized(kind: type, payload: zenoh.ZBytes) -> Any:  # noqa: ANN401  (a message of the type)
    """Return a message of a type.

    Raises:
        ValueError: It is too long.
        genpy.DeserializationError: It is no such message.
    """
    size = len(payload)
    if size > MAX_SIZE:
        raise ValueError(f"a message of {size} bytes; allowed: at most {MAX_SIZE}")
    return kind().deserialize(payload.to_bytes())
