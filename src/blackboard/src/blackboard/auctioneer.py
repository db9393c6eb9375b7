# SPDX-License-Identifier: BSD-3-Clause
"""Holds one auction after the other, as long as there is something to auction."""

from __future__ import annotations

from typing import TYPE_CHECKING

from blackboard.auction import Auction, Result
from blackboard.errors import BidRefusedError
from blackboard.record import Broadcast
from blackboard.talker import TASK_BROADCAST, TASK_COST
from blackboard.task import TaskState

if TYPE_CHECKING:
    from collections.abc import Callable

    from blackboard.backup import Backup
    from blackboard.cost import Bids
    from blackboard.talker import Talker, Timer


class Auctioneer:
    """Offers what waits, and hands over what each auction has decided.

    Args:
        talker: How it hears and speaks.
        backup: Knows what waits.
        in_service: Says which robots take tasks.
        bid_timeout: Longest time that an auction stays open [s].
        decide: Called with the result of each auction; what it leaves waiting is not offered again
            before something changes.
    """

    def __init__(
        self,
        talker: Talker,
        backup: Backup,
        in_service: Callable[[], frozenset[str]],
        bid_timeout: float,
        decide: Callable[[Result], None],
    ) -> None:
        self._talker = talker
        self._backup = backup
        self._in_service = in_service
        self._bid_timeout = bid_timeout
        self._decide = decide
        self._auction: Auction | None = None
        self._closing: Timer | None = None
        self._auctions = 0
        self._slow: set[str] = set()
        self._parked: set[str] = set()
        self._changed = False

    def stop(self) -> None:
        """Drop the auction under way; nothing is decided by it."""
        if self._closing is not None:
            self._closing.cancel()
        self._auction = self._closing = None

    def open(self) -> None:
        """Ask for bids on all that waits, unless an auction is under way."""
        waiting = [
            record
            for record in self._backup.records
            if record.state is TaskState.WAITING
            and not record.parts
            and record.task.id not in self._parked
        ]
        if self._auction is not None or not waiting or not self._backup.may_act():
            return
        robots = self._in_service()
        if not robots:
            reason = "no robot is in service"
            self._settle(Result((), tuple((record.task.id, reason) for record in waiting)))
            return
        self._auctions += 1
        self._changed = False
        epoch = self._backup.epoch
        self._auction = Auction(epoch, self._auctions, waiting, robots - self._slow or robots)
        offers = tuple((record.task, record.step) for record in waiting)
        self._closing = self._talker.after(self._bid_timeout, self._close)
        self._talker.publish(
            TASK_BROADCAST, Broadcast(epoch, self._auctions, offers, self._backup.hive)
        )

    def try_again(self) -> None:
        """Offer again what nobody could take: something has changed.

        What the auction under way is going to find impossible may be out of date as well.
        """
        self._parked.clear()
        self._changed = True
        self.open()

    def withdraw(self, task_id: str) -> None:
        """Offer a task no more in the auction under way."""
        if self._auction is not None:
            self._auction.withdraw(task_id)

    def take_bids(self, bids: Bids) -> None:
        """Take in a robot's bids; the last one expected closes the auction."""
        self._slow.discard(bids.robot_id)
        if self._auction is None:
            return
        try:
            self._auction.take(bids)
        except BidRefusedError as error:
            self._talker.refuse(TASK_COST, str(error))
            return
        if not self._auction.missing:
            self._close()

    def _close(self) -> None:
        auction = self._auction
        if auction is None:
            return
        if self._closing is not None:
            self._closing.cancel()
        self._auction = None
        self._slow |= auction.missing
        self._settle(auction.result())
        if self._changed:
            self._parked.clear()
        self._talker.after(0.0, self.open)

    def _settle(self, result: Result) -> None:
        self._parked |= {task_id for task_id, _ in result.impossible}
        self._decide(result)
