# SPDX-License-Identifier: BSD-3-Clause
"""What to do about a clock that is set back: go on, or notice it and begin anew."""

from __future__ import annotations

from threading import Lock
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Callable

_RESET = 1.0  # a clock that goes back by more than this was reset [s]


class OnwardClock:
    """Shows the time of another clock, but never goes back when that is reset.

    Leases, deadlines and timers measure durations. On a clock that is set back they would wait
    until it catches up.

    Args:
        read: The other clock [s].
    """

    def __init__(self, read: Callable[[], float]) -> None:
        self._read = read
        self._lock = Lock()
        self._last = read()
        self._ahead = 0.0

    def now(self) -> float:
        """Return the time [s]; any thread may call this."""
        with self._lock:
            time = self._read()
            if time < self._last - _RESET:
                self._ahead += self._last - time
            self._last = time
            return time + self._ahead


class SetBack:
    """Says whether a clock was set back since it was asked last.

    Who has written down times of that clock would wait until it has caught up with them.

    Args:
        read: The clock [s].
    """

    def __init__(self, read: Callable[[], float]) -> None:
        self._read = read
        self._last = read()

    def __call__(self) -> bool:
        """Return whether it was."""
        time, last = self._read(), self._last
        self._last = time
        return time < last - _RESET
