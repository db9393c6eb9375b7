# SPDX-License-Identifier: BSD-3-Clause
"""Ends the drives that a robot's process can no longer end, because it hangs or has ended.

A robot's navigation is a process of its own: it drives on to its goal whatever becomes of the
robot's process. So a third process, which does nothing else, cancels the goal when the robot's
lease ends and is not renewed, and when the robot's process ends.
"""

from __future__ import annotations

import math
from typing import NamedTuple, Protocol

GRACE = 0.2
"""So long after the end of a lease a drive is cancelled [s]. A robot's process that runs has
cancelled it by then; the rest of `lease_margin` is for coming to a stop."""


class Drive(NamedTuple):
    """A goal of a robot's navigation."""

    action: str  # name of the action, with its namespace
    goal: str  # id of the goal


class Guard(Protocol):
    """What a robot tells of its drives."""

    def hold(self, drive: Drive, until: float) -> None:
        """Let a drive go on until its robot's lease ends, by the machine's clock [s]."""

    def drop(self, drive: Drive) -> None:
        """Forget a drive that has ended."""


class DriveGuard:
    """Knows until when each drive may go on; see `Guard`."""

    def __init__(self) -> None:
        self._until: dict[Drive, float] = {}

    def hold(self, drive: Drive, until: float) -> None:
        """See `Guard.hold`."""
        self._until[drive] = until

    def drop(self, drive: Drive) -> None:
        """See `Guard.drop`."""
        self._until.pop(drive, None)

    @property
    def next_due(self) -> float:
        """When the next drive has to be cancelled [s]; infinite if there is none."""
        return min(self._until.values(), default=math.inf) + GRACE

    def due(self, now: float) -> list[Drive]:
        """Return the drives that have to be cancelled now [s], and forget them."""
        late = [drive for drive, until in self._until.items() if now >= until + GRACE]
        for drive in late:
            del self._until[drive]
        return late

    def left(self) -> list[Drive]:
        """Return all drives, and forget them: the process of their robots has ended."""
        found = list(self._until)
        self._until.clear()
        return found
