# SPDX-License-Identifier: BSD-3-Clause
"""What was heard last by name, without those who have left: names come and go for months."""

from __future__ import annotations

from typing import Generic, TypeVar

Value = TypeVar("Value")

FORGOTTEN_AFTER = 3600.0
"""Who is silent for so long has left, and is forgotten [s].

That is much longer than any silence that a program reckons with, so nothing is decided by it.
"""


class LastHeard(Generic[Value]):
    """Keeps a value for each name until that has not been heard for `FORGOTTEN_AFTER`."""

    def __init__(self) -> None:
        self._values: dict[str, tuple[float, Value]] = {}  # whoever was heard longest ago is first

    def __len__(self) -> int:
        return len(self._values)

    def get(self, name: str) -> Value | None:
        """Return the value of a name; None if it was never heard, or is forgotten."""
        known = self._values.get(name)
        return None if known is None else known[1]

    def hear(self, name: str, value: Value, now: float) -> list[Value]:
        """Note the value of a name that is heard now [s].

        Returns:
            The values of the names that are forgotten: they have been silent for too long, or were
            heard by a clock that has been set back since.
        """
        self._values.pop(name, None)
        self._values[name] = now, value
        gone = []
        while abs(now - self._values[first := next(iter(self._values))][0]) >= FORGOTTEN_AFTER:
            gone.append(self._values.pop(first)[1])
        return gone
