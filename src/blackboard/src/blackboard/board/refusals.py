# SPDX-License-Identifier: BSD-3-Clause
"""Counts the messages that a member refuses, and warns of each reason once.

A faulty program sends the same nonsense a thousand times. So a reason is said the first time, then
the tenth, the hundredth and so on, and each time is counted.
"""

from __future__ import annotations

from types import MappingProxyType
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping

MAX_REASONS = 100
"""Reasons that are counted; further ones are counted for each topic under `OTHERS`."""

MAX_REASON = 300
"""Characters of a reason; it may quote what was refused."""

OTHERS = "for other reasons"


class Refusals:
    """Counts refusals by topic and reason, and has `say` warn the person who runs this member."""

    def __init__(self, say: Callable[[str], None]) -> None:
        self._say = say
        self._counts: dict[tuple[str, str], int] = {}

    @property
    def counts(self) -> Mapping[tuple[str, str], int]:
        """Number of refusals by topic and reason."""
        return MappingProxyType(self._counts)

    @property
    def total(self) -> int:
        """Number of all refusals."""
        return sum(self._counts.values())

    def by_topic(self) -> dict[str, int]:
        """Return the number of refusals by topic."""
        sums: dict[str, int] = {}
        for (topic, _), count in self._counts.items():
            sums[topic] = sums.get(topic, 0) + count
        return sums

    def refuse(self, topic: str, reason: str, count: int = 1) -> None:
        """Count some refused messages of a topic; the reason is in words for a person."""
        key = (topic, reason[:MAX_REASON])
        if key not in self._counts and len(self._counts) >= MAX_REASONS:
            key = (topic, OTHERS)
        before = self._counts.get(key, 0)
        now = self._counts[key] = before + count
        if now == 1:
            self._say(f"a message on {topic} is refused: {key[1]}")
        elif before == 0 or len(str(now)) > len(str(before)):
            self._say(f"{now} messages on {topic} were refused so far: {key[1]}")


def is_power_of_ten(number: int) -> bool:
    """Return whether a count is worth a word: the tenth, the hundredth and so on."""
    return str(number).rstrip("0") == "1"
