# SPDX-License-Identifier: BSD-3-Clause
"""Keeps a robot's lease: hears heartbeats, and says at once when the lease comes or ends."""

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

_PERIODS_UNHEARD = 1.5
"""A status that has not been echoed by then got lost, and is sent again at every heartbeat."""

_A_MOMENT = 0.001
"""Without it a timer for the end of a lease might find, by rounding, that it still holds [s]."""


class LeaseKeeper:
    """Knows whether a robot may work now.

    Args:
        period: Between two statuses [s].
        changed: Called when the robot may work again, and when it may no longer.
        unheard: Called when the status is to be sent again: with every heartbeat while one got
            lost, and when the leader changes.
        hive_filter: Says which blackboards to obey.

    Attributes:
        makes_room: Whether the leader asks the robot to leave its charger to another.
    """

    def __init__(
        self,
        talker: Talker,
        robot_id: str,
        period: float,
        changed: Callable[[], None],
        unheard: Callable[[], None],
        hive_filter: HiveFilter,
    ) -> None:
        self._talker = talker
        self._period = period
        self._changed = changed
        self._unheard = unheard
        self._filter = hive_filter
        self._id = robot_id
        self._lease = Lease(robot_id, talker.now())
        self.makes_room = False
        self._lapse: Timer | None = None
        self._tell: Callable[[float], None] = lambda _: None
        self._last_hive = ""
        self._epoch = 0

    def start(self) -> None:
        """Begin to listen."""
        self._talker.subscribe(BACKUP, self._hear_beat)

    def tell_to(self, hear: Callable[[float], None]) -> None:
        """Tell when the lease ends [s, the talker's time], at once and whenever that changes."""
        self._tell = hear
        hear(self._talker.now() + self._lease.remaining(self._talker.now()))

    def holds(self) -> bool:
        """Return whether the robot may work now."""
        return self._lease.holds(self._talker.now())

    def allows(self, order: Order) -> bool:
        """Return whether to carry out an order: its sender is to be obeyed, and it is recent.

        An order to drop a task may come late, unless a new task may have got the same id since.
        """
        if not self._filter.obeys(order.hive, order.epoch):
            return False
        drops = order.kind not in {OrderKind.ASSIGN, OrderKind.FORGOTTEN}
        return drops or self._lease.covers(order.heard, self._talker.now())

    def _hear_beat(self, beat: Heartbeat) -> None:
        if not self._filter.obeys(beat.hive, beat.epoch):
            return
        now = self._talker.now()
        if self._epoch not in {0, beat.epoch}:
            # Statuses went to another leader; this one may never have heard of the robot. The
            # member beside it has to hear the same heartbeat before it knows whom to tell.
            self._talker.after(0.0, self._unheard)
        self._epoch = beat.epoch
        self.makes_room = self._id in beat.make_room
        if self._last_hive not in {"", self._filter.hive}:
            self._lease.begin_anew(now)
        self._last_hive = self._filter.hive
        if self._lease.renew(beat, now):
            if self._lapse is not None:
                self._lapse.cancel()
            lasts = self._lease.remaining(now) + _A_MOMENT
            self._tell(now + lasts)
            self._lapse = self._talker.after(lasts, self._changed)
            self._changed()
        elif not self._lease.is_echoed_within(_PERIODS_UNHEARD * self._period, now):
            self._unheard()
