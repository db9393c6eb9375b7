# SPDX-License-Identifier: BSD-3-Clause
"""The bids of the last auction of every task."""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from blackboard.auction.decision import Decision
    from blackboard.costing.bid_basis import Bids
    from blackboard.domain.bid import Bid


class BidBook:
    """Keeps, for each task, what the robots bid when it was last auctioned."""

    def __init__(self) -> None:
        self._auctions: dict[str, tuple[int, int]] = {}
        self._counts: dict[str, int] = {}
        self._bids: dict[str, dict[str, Bid]] = {}

    def of(self, task_id: str) -> tuple[Bid, ...]:
        """Return the bids on a task, cheapest first."""
        bids = self._bids.get(task_id, {}).values()
        return tuple(sorted(bids, key=lambda bid: (bid.cost, bid.robot_id)))

    def auctions(self, task_id: str) -> int:
        """Return in how many auctions a task has been seen."""
        return self._counts.get(task_id, 0)

    def add(self, answer: Bids | Decision) -> list[str]:
        """Write down what a robot has answered, or what was noted about all answers.

        Returns:
            The ids of the tasks that were bid on.
        """
        auction = (answer.epoch, answer.auction)
        for bid in answer.bids:
            known = self._auctions.get(bid.task_id)
            if known is not None and auction < known:
                continue
            if auction != known:
                self._auctions[bid.task_id] = auction
                self._bids[bid.task_id] = {}
                self._counts[bid.task_id] = self.auctions(bid.task_id) + 1
            self._bids[bid.task_id][bid.robot_id] = bid
        return [bid.task_id for bid in answer.bids]

    def forget(self, task_id: str) -> None:
        """Drop what was bid on a task that is no longer on the list."""
        self._bids.pop(task_id, None)
        self._auctions.pop(task_id, None)
        self._counts.pop(task_id, None)
