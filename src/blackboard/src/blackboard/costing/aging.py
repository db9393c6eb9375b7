# SPDX-License-Identifier: BSD-3-Clause
"""What a second of waiting counts for a task, so that no task waits forever.

Where short tasks go before long ones, new short ones might keep doing so. The longer a task has
waited, the more its waiting counts, until it goes before everything new.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Callable

    from blackboard.domain.task import Task

_MAX_DOUBLINGS = 20.0
"""A factor of a million is more than any schedule is long."""


class Aging:
    """Says what a task's waiting counts now.

    Args:
        now: Gives the time on the clock of `Task.posted` [s].
        doubling: Time in which it doubles [s]; infinite if age does not count.
    """

    def __init__(self, now: Callable[[], float] = lambda: 0.0, doubling: float = math.inf) -> None:
        self._now = now
        self._doubling = doubling

    def weight(self, task: Task) -> float:
        """Return what a second counts; 1 for a task that is new or does not say how old it is."""
        if task.posted <= 0.0:
            return 1.0
        age = max(0.0, self._now() - task.posted)
        return float(2.0 ** min(age / self._doubling, _MAX_DOUBLINGS))
