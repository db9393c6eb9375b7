# SPDX-License-Identifier: BSD-3-Clause
"""Keeps a robot's lease: hears heartbeats, and speaks up in time when it comes or goes."""

from __future__ import annotations

from typing import TYPE_CHECKING

from blackboard.lease import Lease
from blackboard.talker import BACKUP

if TYPE_CHECKING:
    from collections.abc import Callable

    from blackboard.backup import Heartbeat
    from blackboard.talker import Talker, Timer

_A_MOMENT = 0.001
"""A timer for the very end of a lease might find, by rounding, that it still holds [s]."""


class Leave:
    """Knows whether a robot may work now.

    Args:
        talker: How it hears and knows the time.
        robot_id: Whose leave it is.
        patience: A status that was not echoed by then got lost [s].
        changed: Called when the robot may work again, and when it may no longer.
        unheard: Called with every heartbeat while a status that got lost is to be sent again.
    """

    def __init__(
        self,
        talker: Talker,
        robot_id: str,
        patience: float,
        changed: Callable[[], None],
        unheard: Callable[[], None],
    ) -> None:
        self._talker = talker
        self._patience = patience
        self._changed = changed
        self._unheard = unheard
        self._lease = Lease(robot_id, talker.now())
        self._lapse: Timer | None = None

    def start(self) -> None:
        """Begin to listen."""
        self._talker.subscribe(BACKUP, self._hear_beat)

    def holds(self) -> bool:
        """Return whether the robot may work now."""
        return self._lease.holds(self._talker.now())

    def covers(self, heard: float) -> bool:
        """Return whether an order that echoes a time of the robot [s] is recent enough."""
        return self._lease.covers(heard, self._talker.now())

    def _hear_beat(self, beat: Heartbeat) -> None:
        now = self._talker.now()
        if self._lease.renew(beat, now):
            if self._lapse is not None:
                self._lapse.cancel()
            lasts = self._lease.remaining(now) + _A_MOMENT
            self._lapse = self._talker.after(lasts, self._changed)
            self._changed()
        elif not self._lease.is_echoed_within(self._patience, now):
            self._unheard()
