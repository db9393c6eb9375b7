# SPDX-License-Identifier: BSD-3-Clause
"""Keeps a robot's lease: hears heartbeats, and speaks up in time when it comes or goes."""

from __future__ import annotations

from typing import TYPE_CHECKING

from blackboard.consensus.lease import Lease
from blackboard.domain.record import OrderKind
from blackboard.domain.talker import BACKUP

if TYPE_CHECKING:
    from collections.abc import Callable

    from blackboard.consensus.hive_filter import HiveFilter
    from blackboard.consensus.messages import Heartbeat
    from blackboard.domain.record import Order
    from blackboard.domain.talker import Talker, Timer
    from blackboard.robot.worker import Worker

_PERIODS_UNHEARD = 1.5
"""A status that was not echoed by then got lost, and is sent again at every heartbeat."""

_A_MOMENT = 0.001
"""A timer for the very end of a lease might find, by rounding, that it still holds [s]."""


class LeaseKeeper:
    """Knows whether a robot may work now.

    Args:
        talker: How it hears and knows the time.
        robot_id: Whose leave it is.
        period: Between two statuses [s].
        changed: Called when the robot may work again, and when it may no longer.
        unheard: Called when a status is to be sent again: with every heartbeat while one got lost,
            and when another blackboard is the active one.
        fence: Knows which blackboards count.
    """

    def __init__(
        self,
        talker: Talker,
        robot_id: str,
        period: float,
        changed: Callable[[], None],
        unheard: Callable[[], None],
        fence: HiveFilter,
    ) -> None:
        self._talker = talker
        self._patience = _PERIODS_UNHEARD * period
        self._changed = changed
        self._unheard = unheard
        self._fence = fence
        self._lease = Lease(robot_id, talker.now())
        self._lapse: Timer | None = None
        self._last_hive = ""
        self._epoch = 0

    def start(self) -> None:
        """Begin to listen."""
        self._talker.subscribe(BACKUP, self._hear_beat)

    def holds(self) -> bool:
        """Return whether the robot may work now."""
        return self._lease.holds(self._talker.now())

    def reason(self, work: Worker) -> str:
        """Say why a robot that has work to do stands still; empty where it is not for this."""
        if not work.stands_still or self.holds():
            return ""
        return "stands still until an active blackboard says that it has heard it"

    @property
    def hive(self) -> str:
        """The id of the robot's hive; empty where it belongs to none yet."""
        return self._fence.hive

    def obeys(self, hive: str, epoch: int) -> bool:
        """Return whether the blackboard of a hive and an epoch counts."""
        return self._fence.obeys(hive, epoch)

    def allows(self, order: Order) -> bool:
        """Return whether an order may be carried out: who gave it counts, and it is recent.

        To drop a task may come late, unless a new one of the same id may have come meanwhile.
        """
        if not self.obeys(order.hive, order.epoch):
            return False
        drops = order.kind not in {OrderKind.ASSIGN, OrderKind.FORGOTTEN}
        return drops or self._lease.covers(order.heard, self._talker.now())

    def _hear_beat(self, beat: Heartbeat) -> None:
        if not self.obeys(beat.hive, beat.epoch):
            return
        now = self._talker.now()
        if self._epoch not in {0, beat.epoch}:
            # Statuses have gone to another one; this one may never have heard of the robot. The
            # member beside it has to hear the same heartbeat before it knows whom to tell.
            self._talker.after(0.0, self._unheard)
        self._epoch = beat.epoch
        if self._last_hive not in {"", self.hive}:
            self._lease.begin_anew(now)
        self._last_hive = self.hive
        if self._lease.renew(beat, now):
            if self._lapse is not None:
                self._lapse.cancel()
            lasts = self._lease.remaining(now) + _A_MOMENT
            self._lapse = self._talker.after(lasts, self._changed)
            self._changed()
        elif not self._lease.is_echoed_within(self._patience, now):
            self._unheard()
