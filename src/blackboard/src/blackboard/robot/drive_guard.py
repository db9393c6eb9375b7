# SPDX-License-Identifier: BSD-3-Clause
"""Ends the drives that a robot's process can no longer end, because it hangs or is gone.

A robot drives by its navigation, which is a process of its own: it drives on to its goal whatever
becomes of the robot's process. So a third process, which does nothing else, cancels the goal when
the lease of the robot ends and is not renewed, or when the robot's process ends.
"""

from __future__ import annotations

import math

GRACE = 0.2
"""So long after the end of a lease a drive is cancelled [s]. A robot's process that runs cancels
it by then; the rest of `lease_margin` is for coming to a stop."""


class DriveGuard:
    """Knows how long each drive may go on unless its lease is renewed.

    A drive is known by the name of its action. All times are by one clock, that of the robots'
    process [s].
    """

    def __init__(self) -> None:
        self._until: dict[str, float] = {}

    def hold(self, action: str, until: float) -> None:
        """Let a drive go on until the end of its robot's lease."""
        self._until[action] = until

    def drop(self, action: str) -> None:
        """Forget a drive that has ended."""
        self._until.pop(action, None)

    @property
    def next_due(self) -> float:
        """When the next drive has to be cancelled; infinite if none has to be."""
        return min(self._until.values(), default=math.inf) + GRACE

    def due(self, now: float) -> list[str]:
        """Return the drives that have to be cancelled now, and forget them."""
        late = [action for action, until in self._until.items() if now >= until + GRACE]
        for action in late:
            del self._until[action]
        return late

    def left(self) -> list[str]:
        """Return all drives that have not ended, and forget them: the process has ended."""
        found, self._until = list(self._until), {}
        return found
