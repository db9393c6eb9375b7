# SPDX-License-Identifier: BSD-3-Clause
"""A clock that goes on where the simulation that it shows is reset."""

from __future__ import annotations

from threading import Lock
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Callable

_RESET = 1.0
"""A clock that goes back by more than this has been reset [s]."""


class OnwardClock:
    """The time since some moment by another clock, of which no reset takes anything away.

    Leases, deadlines and timers count how long something takes. With a clock that is set back they
    would wait until it has caught up.

    Args:
        read: The other clock [s].
    """

    def __init__(self, read: Callable[[], float]) -> None:
        self._read = read
        self._lock = Lock()
        self._last = read()
        self._ahead = 0.0

    def now(self) -> float:
        """Return the time [s]; may be called from any thread."""
        with self._lock:
            time = self._read()
            if time < self._last - _RESET:
                self._ahead += self._last - time
            self._last = time
            return time + self._ahead
