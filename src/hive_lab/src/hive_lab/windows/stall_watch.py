# SPDX-License-Identifier: BSD-3-Clause
"""Measures how late an event loop serves its timers.

On a busy machine the loop also waits for a processor. That is not the program's fault, so the wait
that the kernel counts (schedstat) is subtracted.
"""

from __future__ import annotations

import contextlib
import time
from pathlib import Path

from python_qt_binding.QtCore import QObject, Qt, QTimer

PERIOD = 5  # [ms]
SCHEDSTAT = Path("/proc/self/schedstat")  # of the main thread, which runs the event loop


class StallWatch(QObject):
    """A timer in the event loop that notices when it is late.

    Attributes:
        longest: The longest stall since `reset` [s].
    """

    def __init__(self) -> None:
        super().__init__()
        self.longest = 0.0
        self._due = 0.0
        self._starved = 0.0
        self._timer = QTimer(self, interval=PERIOD, timeout=self._turn)
        self._timer.setTimerType(Qt.PreciseTimer)

    def start(self) -> None:
        """Start measuring."""
        self.reset()
        self._timer.start()

    def reset(self) -> None:
        """Forget what was measured."""
        self.longest = 0.0
        self._due = time.monotonic() + PERIOD / 1000
        self._starved = starved()

    def _turn(self) -> None:
        now = time.monotonic()
        before, self._starved = self._starved, starved()
        self.longest = max(self.longest, now - self._due - (self._starved - before))
        self._due = now + PERIOD / 1000


def starved() -> float:
    """Return the time the main thread has waited for a processor [s]; 0 where unknown."""
    with contextlib.suppress(OSError, IndexError, ValueError):
        return int(SCHEDSTAT.read_bytes().split()[1]) / 1e9
    return 0.0
