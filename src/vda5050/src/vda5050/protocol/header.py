# SPDX-License-Identifier: BSD-3-Clause
"""The header that every message begins with, and its time."""

import re
from datetime import datetime, timezone
from typing import Annotated

import attrs

from vda5050.protocol.rules import Rule, Text, UInt32

_TIME = re.compile(r"(\d{4}-\d\d-\d\dT\d\d:\d\d:\d\d)(?:\.(\d+))?(Z|[+-]\d\d:\d\d)")


@attrs.frozen
class Header:
    """Who sent a message, when, and as which of its messages on this topic."""

    header_id: Annotated[int, UInt32]
    """Counts the messages of one sender on one topic."""
    timestamp: Annotated[str, Rule(pattern=f"^{_TIME.pattern}$", maxLength=40)]
    """ISO 8601, UTC."""
    version: Annotated[str, Text]
    """Such as 2.0.0."""
    manufacturer: Annotated[str, Text]
    serial_number: Annotated[str, Text]

    @property
    def stamp(self) -> float:
        """The timestamp [s since 1970]; ValueError if there is no such day or hour."""
        return seconds_from(self.timestamp)


def timestamp_of(seconds: float) -> str:
    """Return a time [s since 1970] as it stands in messages, with milliseconds."""
    moment = datetime.fromtimestamp(seconds, timezone.utc)
    return f"{moment:%Y-%m-%dT%H:%M:%S}.{moment.microsecond // 1000:03d}Z"


def seconds_from(timestamp: str) -> float:
    """Return the time [s since 1970] that a message says.

    Raises:
        ValueError: There is no such time.
    """
    found = _TIME.fullmatch(timestamp)
    if found is None:
        raise ValueError(f"{timestamp!r} is no time; allowed: such as 2024-05-01T12:00:00.000Z")
    whole, fraction, zone = found.groups()
    moment = datetime.fromisoformat(whole + zone.replace("Z", "+00:00"))
    return moment.timestamp() + float(f"0.{fraction or 0}")
