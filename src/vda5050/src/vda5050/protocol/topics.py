# SPDX-License-Identifier: BSD-3-Clause
"""The names of topics: `interface/vN/manufacturer/serial/topic`."""

import enum
import re
from typing import Annotated

import attrs

from hive_common.structuring import Allowed
from vda5050.protocol.versions import Version

_PART = re.compile(r"[^/+#$\x00-\x1f]{1,128}")

TopicPart = Annotated[str, Allowed("a text without / + # $, 1 to 128 characters", _PART.fullmatch)]


class Topic(enum.Enum):
    """The last part of a topic's name."""

    ORDER = "order"
    INSTANT_ACTIONS = "instantActions"
    STATE = "state"
    VISUALIZATION = "visualization"
    CONNECTION = "connection"
    FACTSHEET = "factsheet"


@attrs.frozen
class Address:
    """One AGV's place among the topics of a broker."""

    interface: str
    major: str
    """`v2` or `v3`."""
    manufacturer: str
    serial: str

    @classmethod
    def of(
        cls, version: Version, manufacturer: str, serial: str, interface: str | None = None
    ) -> "Address":
        """Return the address of an AGV; the interface is the version's unless it is given."""
        return cls(interface or version.interface, version.major, manufacturer, serial)

    def topic(self, topic: Topic) -> str:
        """Return the name of one of the AGV's topics."""
        return "/".join((*attrs.astuple(self), topic.value))


def parse_topic(name: str) -> tuple[Address, Topic] | None:
    """Return whose topic a name is and which; None if it is no topic of the standard."""
    parts = name.split("/")
    if len(parts) != len(attrs.fields(Address)) + 1:
        return None
    try:
        return Address(*parts[:-1]), Topic(parts[-1])
    except ValueError:
        return None
