# SPDX-License-Identifier: BSD-3-Clause
"""Whose clock is off, from the stamps of what is heard.

The hive measures its own times with clocks that need not agree (docs/decisions/022). tf and the
navigation stack do need it: a transform that is stamped by a clock 5 s off is of no use.
"""

from __future__ import annotations

from collections import defaultdict, deque

ALLOWED = 1.0
"""Clocks this far apart are left alone [s]; a message rarely takes longer."""

_KEPT = 10  # messages of each that count
_ENOUGH = 5  # fewer prove nothing
_FORGOTTEN = 30.0  # who has not been heard for this long is not named any more [s]


class ClockOffsets:
    """How far the clocks of others are off, each by its last messages.

    A message arrives late by what the clocks differ and by its delay. The delay is never negative,
    so the message that was quickest tells most.
    """

    def __init__(self) -> None:
        self._late: defaultdict[str, deque[float]] = defaultdict(lambda: deque(maxlen=_KEPT))
        self._heard: dict[str, float] = {}

    def hear(self, name: str, late: float, now: float) -> None:
        """Take in by how much a message of somebody came after its stamp [s].

        `now` is the time [s], by a clock that nobody sets.
        """
        self._late[name].append(late)
        self._heard[name] = now

    def behind(self, name: str, now: float) -> float:
        """Return by how much a clock is behind this one [s]; 0 where it is near enough."""
        return self.off(now).get(name, 0.0)

    def off(self, now: float) -> dict[str, float]:
        """Return by how much each clock that is off is behind this one [s]."""
        for name in [name for name, heard in self._heard.items() if now - heard > _FORGOTTEN]:
            del self._heard[name], self._late[name]
        return {
            name: min(late)
            for name, late in sorted(self._late.items())
            if len(late) >= _ENOUGH and abs(min(late)) > ALLOWED
        }


def words(behind: float) -> str:
    """Say how far a clock is behind [s], or ahead."""
    return f"{abs(behind):.1f} s {'behind' if behind > 0 else 'ahead of'}"
