# SPDX-License-Identifier: BSD-3-Clause
"""Reads what comes from the broker, and refuses what cannot be meant for the hive.

A faulty AGV sends the same nonsense a thousand times. So each kind of refusal is said once for
each AGV and topic, and counted.
"""

from __future__ import annotations

import math
from collections import Counter
from typing import TYPE_CHECKING

from vda5050.errors import MessageError
from vda5050.protocol.codec import decode
from vda5050.protocol.state import State
from vda5050.protocol.topics import Topic

if TYPE_CHECKING:
    from collections.abc import Callable

    from vda5050.protocol.codec import Body, Message
    from vda5050.protocol.header import Header
    from vda5050.protocol.topics import Address
    from vda5050.protocol.versions import Version

FROM_AGVS = (Topic.STATE, Topic.VISUALIZATION, Topic.CONNECTION, Topic.FACTSHEET)

AHEAD = 60.0
"""How much later than now a message may say that it was sent [s]: clocks differ by less."""

FORGOTTEN = 30.0
"""After this silence an AGV may count its messages, and its time, from anew [s]."""


class Inspector:
    """Reads the messages of one AGV.

    Args:
        address: The AGV's place at the broker.
        version: What it speaks.
        wall: Returns the time of day [s since 1970].
        knows_order: Tells of an order id and update id whether the hive sent them; an id that the
            hive did not make is somebody else's, and true.
        say: Tells a person.

    Attributes:
        refused: How many messages were refused, by topic and kind.
    """

    def __init__(
        self,
        address: Address,
        version: Version,
        wall: Callable[[], float],
        knows_order: Callable[[str, int], bool],
        say: Callable[[str], None],
    ) -> None:
        self.refused: Counter[tuple[Topic, str]] = Counter()
        self._address = address
        self._version = version
        self._wall = wall
        self._knows_order = knows_order
        self._say = say
        self._last: dict[Topic, tuple[int, float, float]] = {}

    def read(self, topic: Topic, payload: bytes) -> Body | None:
        """Return what a message says; None if it was refused."""
        try:
            message = decode(payload, topic, self._version)
            self._check(topic, message)
        except MessageError as error:
            self._refuse(topic, error)
            return None
        return message.body

    def _check(self, topic: Topic, message: Message) -> None:
        header, body = message.header, message.body
        if header is not None:
            self._check_sender(header)
            if topic is not Topic.CONNECTION:  # a last will was written when the AGV connected
                self._check_age(topic, header)
        if isinstance(body, State) and not self._knows_order(body.order_id, body.order_update_id):
            text = (
                f"orderId {body.order_id!r} with orderUpdateId {body.order_update_id}: "
                "the hive has not sent that update"
            )
            raise MessageError("echo", text)

    def _check_sender(self, header: Header) -> None:
        said = (header.manufacturer, header.serial_number)
        expected = (self._address.manufacturer, self._address.serial)
        if said != expected:
            text = f"manufacturer and serialNumber are {said}, on the topic of {expected}"
            raise MessageError("sender", text)

    def _check_age(self, topic: Topic, header: Header) -> None:
        """Refuse what comes from the future, and what is older than what came before."""
        stamp = header.stamp
        ahead = stamp - self._wall()
        if ahead > AHEAD:
            text = f"timestamp {header.timestamp} is {ahead:.0f} s ahead; set the AGV's clock"
            raise MessageError("future", text)
        now = self._wall()
        number, since, heard = self._last.get(topic, (-1, -math.inf, -math.inf))
        if header.header_id <= number and stamp <= since and now - heard < FORGOTTEN:
            text = f"headerId {header.header_id} after {number}, and no newer: it comes late"
            raise MessageError("old", text)
        self._last[topic] = (header.header_id, stamp, now)

    def _refuse(self, topic: Topic, error: MessageError) -> None:
        self.refused[topic, error.kind] += 1
        if self.refused[topic, error.kind] == 1:
            address = self._address.topic(topic)
            self._say(f"{address}: refused a message: {error}; further ones are only counted")
