# SPDX-License-Identifier: BSD-3-Clause
"""A vehicle's end of its topics: headers, JSON, and the refusal of what is no message."""

from __future__ import annotations

from typing import TYPE_CHECKING

from vda5050.errors import MessageError
from vda5050.protocol.actions import InstantActions
from vda5050.protocol.codec import decode, encode, prepare
from vda5050.protocol.header import Header, timestamp_of
from vda5050.protocol.order import Order
from vda5050.protocol.state import Connection, ConnectionState
from vda5050.protocol.topics import Topic, parse_topic

if TYPE_CHECKING:
    from collections.abc import Callable

    from vda5050.protocol.codec import Body
    from vda5050.protocol.topics import Address
    from vda5050.protocol.versions import Version

HEARD = (Topic.ORDER, Topic.INSTANT_ACTIONS)
"""What a vehicle subscribes to."""

RETAINED = frozenset({Topic.CONNECTION, Topic.FACTSHEET})
SURE = frozenset({Topic.CONNECTION})
"""What is sent with quality of service 1, as the standard wants."""


class Channel:
    """Writes and reads the messages of one vehicle.

    Args:
        address: Its place among the topics.
        version: What it speaks.
        send: Sends bytes on a topic, with a quality of service, retained or not.
        wall: Gives the time of headers [s since 1970].
    """

    def __init__(
        self,
        address: Address,
        version: Version,
        send: Callable[[str, bytes, int, bool], object],
        wall: Callable[[], float],
    ) -> None:
        self._address, self._version = address, version
        self._send, self._wall = send, wall
        self._sent: dict[Topic, int] = {}
        prepare(version, HEARD)

    @property
    def will(self) -> tuple[str, bytes]:
        """The topic and bytes of what the broker says when it loses the vehicle."""
        return self._written(Topic.CONNECTION, Connection(ConnectionState.CONNECTION_BROKEN))

    @property
    def heard(self) -> tuple[str, ...]:
        """The names of the topics to subscribe to."""
        return tuple(self._address.topic(topic) for topic in HEARD)

    def publish(self, topic: Topic, body: Body) -> None:
        """Send a message."""
        name, payload = self._written(topic, body)
        self._send(name, payload, int(topic in SURE), topic in RETAINED)

    def say_goodbye(self) -> None:
        """Tell that the vehicle leaves."""
        self.publish(Topic.CONNECTION, Connection(ConnectionState.OFFLINE))

    def _written(self, topic: Topic, body: Body) -> tuple[str, bytes]:
        number = self._sent.get(topic, -1) + 1
        self._sent[topic] = number
        header = Header(
            number % 2**32,
            timestamp_of(self._wall()),
            self._version.text,
            self._address.manufacturer,
            self._address.serial,
        )
        return self._address.topic(topic), encode(header, body, self._version)

    def read(self, name: str, payload: bytes) -> Order | InstantActions | None:
        """Return a message to the vehicle; None for one that is not for it.

        Raises:
            MessageError: It is for the vehicle, but not what the standard allows.
        """
        found = parse_topic(name)
        if found is None or found[0] != self._address or found[1] not in HEARD:
            return None
        message = decode(payload, found[1], self._version)
        if message.header is not None and (
            message.header.manufacturer != self._address.manufacturer
            or message.header.serial_number != self._address.serial
        ):
            raise MessageError("header", f"for {message.header.serial_number}, not for us")
        body = message.body
        return body if isinstance(body, Order | InstantActions) else None
