# SPDX-License-Identifier: BSD-3-Clause
"""Calls that are going to happen, by one clock."""

from __future__ import annotations

import heapq
import itertools
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Callable


class RosTimer:
    """A call that is going to happen; see `blackboard.domain.talker.Timer`."""

    def __init__(self, due: float, period: float | None, action: Callable[[], None]) -> None:
        self.due = due
        self.period = period
        self.action = action
        self.cancelled = False

    def cancel(self) -> None:
        """Make it not happen."""
        self.cancelled = True


class Timers:
    """The timers that run by one clock.

    Args:
        now: The clock [s].
    """

    def __init__(self, now: Callable[[], float]) -> None:
        self._now = now
        self._queue: list[tuple[float, int, RosTimer]] = []
        self._order = itertools.count()

    def start(self, delay: float, period: float | None, action: Callable[[], None]) -> RosTimer:
        """Have something called after a delay [s], and then again after every period [s]."""
        return self._schedule(RosTimer(self._now() + delay, period, action))

    def next_due(self) -> float | None:
        """Return the time until the next call [s]; None where there is none."""
        return max(0.0, self._queue[0][0] - self._now()) if self._queue else None

    def call_due(self) -> None:
        """Make the calls whose time has come."""
        now = self._now()
        while self._queue and self._queue[0][0] <= now:
            _, _, timer = heapq.heappop(self._queue)
            if timer.cancelled:
                continue
            if timer.period is not None:
                # A clock that ran ahead must not bring a burst of calls.
                timer.due = max(timer.due + timer.period, now)
                self._schedule(timer)
            timer.action()

    def _schedule(self, timer: RosTimer) -> RosTimer:
        heapq.heappush(self._queue, (timer.due, next(self._order), timer))
        return timer
