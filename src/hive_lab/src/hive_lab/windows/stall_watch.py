# SPDX-License-Identifier: BSD-3-Clause
"""Measures for how long an event loop does not get round to its timers.

On a machine that is busy with other things the loop also waits for a processor. That is not the
program's doing, so what the kernel counts as such (schedstat) is taken off.
"""

from __future__ import annotations

import contextlib
import time
from pathlib import Path

from python_qt_binding.QtCore import QObject, Qt, QTimer

PERIOD = 5  # [ms]
SCHEDSTAT = Path("/proc/self/schedstat")  # of the main thread, which runs the event loop


class StallWatch(QObject):
    """A timer in the event loop that notices when it is called late.

    Attributes:
        longest: The longest that the loop was held up since `reset` [s].
    """

    def __init__(self) -> None:
        super().__init__()
        self.longest = 0.0
        self._due = 0.0
        self._starved = 0.0
        self._timer = QTimer(self, interval=PERIOD, timeout=self._turn)
        self._timer.setTimerType(Qt.PreciseTimer)

    def start(self) -> None:
        """Begin to measure."""
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
    """Return how long the main thread has waited for a processor so far [s]; 0 if not known."""
    with contextlib.suppress(OSError, IndexError, ValueError):
        return int(SCHEDSTAT.read_bytes().split()[1]) / 1e9
    return 0.0
