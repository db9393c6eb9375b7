# SPDX-License-Identifier: BSD-3-Clause
"""Timers on one clock, which their owner runs."""

from __future__ import annotations

import heapq
import itertools
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Callable


class ScheduledCall:
    """See `blackboard.domain.talker.Timer`."""

    def __init__(self, due: float, period: float | None, action: Callable[[], None]) -> None:
        self.due = due
        self.period = period
        self.action = action
        self.cancelled = False

    def cancel(self) -> None:
        """Prevent the call."""
        self.cancelled = True


class Timers:
    """The timers on one clock [s]."""

    def __init__(self, now: Callable[[], float]) -> None:
        self.now = now
        self._queue: list[tuple[float, int, ScheduledCall]] = []
        self._order = itertools.count()

    def every(self, period: float, action: Callable[[], None]) -> ScheduledCall:
        """Call repeatedly, the first time after one period [s]."""
        return self._schedule(ScheduledCall(self.now() + period, period, action))

    def after(self, delay: float, action: Callable[[], None]) -> ScheduledCall:
        """Call once after a delay [s]."""
        return self._schedule(ScheduledCall(self.now() + delay, None, action))

    def next_due(self) -> float | None:
        """Return the time until the next call [s]; None if there is none."""
        return max(0.0, self._queue[0][0] - self.now()) if self._queue else None

    def call_due(self) -> None:
        """Make all calls that are due."""
        now = self.now()
        while self._queue and self._queue[0][0] <= now:
            _, _, timer = heapq.heappop(self._queue)
            if timer.cancelled:
                continue
            if timer.period is not None:
                # A clock that jumps ahead must not cause a burst of calls.
                timer.due = max(timer.due + timer.period, now)
                self._schedule(timer)
            timer.action()

    def _schedule(self, timer: ScheduledCall) -> ScheduledCall:
        heapq.heappush(self._queue, (timer.due, next(self._order), timer))
        return timer
