# SPDX-License-Identifier: BSD-3-Clause
"""Holds one auction after the other, as long as there is something to auction."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

from blackboard.auction.auction import Auction, Result
from blackboard.domain.record import Broadcast
from blackboard.domain.talker import TASK_BROADCAST, TASK_COST
from blackboard.domain.task import TaskState
from blackboard.errors import BidRefusedError

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from blackboard.auction.candidate_selection import CandidateSelection
    from blackboard.auction.central import Central
    from blackboard.auction.reallocation import Bundle, Reallocation
    from blackboard.auction.transfers import Exchange, Move, Transfers
    from blackboard.consensus.node import RaftNode
    from blackboard.costing.bid_basis import Bids
    from blackboard.domain.bid import Bid
    from blackboard.domain.record import TaskRecord
    from blackboard.domain.talker import Talker, Timer


class Auctioneer:
    """Offers what waits, and hands over what each auction has decided.

    Args:
        talker: How it hears and speaks.
        backup: Knows what waits.
        in_service: Says which robots take tasks.
        bid_timeout: Longest time that an auction stays open [s].
        improving: Chooses what is offered while nothing waits.
        handing_over: Takes care of what is to change hands because of that.
        patience: What is to change hands is auctioned if it does not within this time [s].
        decide: Called with the result of each round, and with what is to follow once it is carried
            out; what it leaves as impossible is not offered again before something changes.
        reach: Limits what one call for bids offers, and to whom.
        central: Works the bids out; robots bid themselves where it is left out.
    """

    def __init__(
        self,
        talker: Talker,
        backup: RaftNode,
        in_service: Callable[[], frozenset[str]],
        bid_timeout: float,
        reallocation: Reallocation,
        transfers: Transfers,
        patience: float,
        decide: Callable[[Result, Callable[[], None]], None],
        reach: CandidateSelection,
        central: Central | None = None,
    ) -> None:
        self._talker = talker
        self._backup = backup
        self._in_service = in_service
        self._bid_timeout = bid_timeout
        self._reallocation = reallocation
        self._transfers = transfers
        self._patience = patience
        self._decide = decide
        self._candidates = reach
        self._central = central
        self._improves = False
        self._auction: Auction | None = None
        self._offers = Broadcast(0, 0, ())
        self._bundles: dict[str, Bundle] = {}
        self._closing: Timer | None = None
        self._giving_up: Timer | None = None
        self._decided_in = (0, 0, 0)
        self._dropped = (0, 0)
        self._auctions = 0
        self._slow: set[str] = set()
        self._parked: set[str] = set()
        self._left_out = False
        self._hard: set[str] = set()
        self._changed = False

    def stop(self) -> None:
        """Drop the auction under way; nothing is decided by it."""
        self._drop()
        if self._giving_up is not None:
            self._giving_up.cancel()
            self._giving_up = None
        self._transfers.give_up()

    def open(self) -> None:
        """Ask for bids on all that waits, unless an auction of that is under way."""
        if not self._backup.may_act() or not self._make_way():
            return
        self._changed = False
        moves = self._transfers.ready(self._in_service())
        waiting = self._waiting()
        if moves:
            self._give_out(moves)
        elif waiting and not self._in_service():
            reason = "no robot is in service"
            self._settle(Result((), tuple((record.task.id, reason) for record in waiting)))
        elif waiting:
            self._begin(improves=False)
            self._begin_round(())

    def improve(self) -> None:
        """Have some of what has not begun offered again, while there is nothing else to do."""
        if self._auction is not None or not self._backup.may_act():
            return
        if self._waiting() or self._transfers.kept:
            return
        robots = self._in_service()
        bundles = self._reallocation.offers(robots, self._candidates.max_bundles(len(robots)))
        if bundles:
            self._begin(improves=True)
            offers = [record for bundle in bundles for record in bundle]
            holders = {record.robot for record in offers}
            self._ask(bundles, self._candidates.asked(offers, robots) | holders, ())

    def try_again(self) -> None:
        """Offer again what nobody could take: something has changed.

        What the auction under way is going to find impossible may be out of date as well.
        """
        self._parked.clear()
        self._changed = True
        self._reallocation.note_change()
        self.open()

    def bids_better(self, robot_id: str) -> None:
        """Have a robot bid again that might bid better now, on what nobody could take as well."""
        self._parked.clear()
        self._reallocation.note_change()
        if self._auction is not None:
            self._auction.outdate(robot_id)
        self.open()

    def withdraw(self, task_id: str) -> None:
        """Offer a task no more in the auction under way."""
        self._parked.discard(task_id)
        self._hard.discard(task_id)
        if self._auction is not None:
            self._auction.withdraw(task_id)

    def list_changed(self, robot_id: str) -> None:
        """Note that a robot's list is not what it was: what it has bid holds no more."""
        self._reallocation.note_change()
        if self._auction is not None:
            self._auction.forget(robot_id)

    def take_bids(self, bids: Bids) -> None:
        """Take in a robot's bids; the last one expected closes the round."""
        self._slow.discard(bids.robot_id)
        if self._auction is None or (bids.epoch, bids.auction) == self._dropped:
            return
        try:
            if self._central is not None:
                bids = self._central.bids(bids, self._offers)
            self._auction.take(bids, self._in_service())
        except BidRefusedError as error:
            self._talker.refuse(TASK_COST, str(error))
            return
        if self._closing is not None and not self._auction.missing:
            self._close_round()

    def _make_way(self) -> bool:
        """Drop an improvement that something waits for; return whether an auction may begin."""
        auction = self._auction
        if auction is not None and self._improves and self._waiting():
            self._dropped = (auction.epoch, auction.number)
            self._drop()
        return self._auction is None

    def _drop(self) -> None:
        if self._closing is not None:
            self._closing.cancel()
        self._auction = self._closing = None

    def _waiting(self) -> list[TaskRecord]:
        kept = self._transfers.kept
        return [
            record
            for record in self._backup.records.values()
            if record.state is TaskState.WAITING
            and not record.parts
            and record.task.id not in self._parked
            and record.task.id not in kept
        ]

    def _begin(self, *, improves: bool) -> None:
        self._auctions += 1
        self._auction = Auction(self._backup.epoch, self._auctions)
        self._improves = improves

    def _begin_round(self, awards: tuple[Bid, ...]) -> None:
        """Ask those for bids whose bids do not hold, or end the auction where nothing is left.

        What the robots that were asked first cannot take is offered to all.
        """
        auction, waiting, robots = self._auction, self._waiting(), self._in_service()
        if auction is None or not self._backup.may_act():
            return
        if not waiting or not robots or self._changed:
            self._auction = None
            self.open()
            return
        hard = [record for record in waiting if record.task.id in self._hard]
        most = len(robots) if hard else min(len(robots), self._candidates.most_asked)
        offers = self._candidates.offers(hard or waiting, most, auction.offered)
        asked = robots if hard else self._candidates.asked(offers, robots)
        self._left_out = asked != robots
        self._hard -= {record.task.id for record in offers}
        self._ask([(record,) for record in offers], asked, awards)

    def _ask(
        self, bundles: Sequence[Bundle], robots: frozenset[str], awards: tuple[Bid, ...]
    ) -> None:
        auction = self._auction
        assert auction is not None  # noqa: S101  (whoever asks has begun one)
        self._bundles = {bundle[0].task.id: bundle for bundle in bundles}
        sizes = {task_id: len(bundle) for task_id, bundle in self._bundles.items()}
        asked = auction.ask([bundle[0] for bundle in bundles], robots, sizes)
        if asked is None and (awards or robots != self._in_service()):
            asked = robots
        auction.excuse(frozenset(self._slow))
        self._closing = self._talker.after(self._bid_timeout, self._close_round)
        if not auction.missing:
            self._close_round()
            return
        given = {bid.robot_id: bid.task_id for bid in awards}
        named = None if asked is None else {robot: given.get(robot, "") for robot in sorted(asked)}
        is_plain = all(size == 1 for size in sizes.values())
        self._offers = Broadcast(
            auction.epoch,
            auction.number,
            tuple((record.task, record.step) for bundle in bundles for record in bundle),
            self._backup.hive,
            round=auction.round,
            asked=named,
            sizes=() if is_plain else tuple(sizes.values()),
        )
        asks = self._offers if self._central is None else self._central.question(self._offers)
        self._talker.publish(TASK_BROADCAST, asks, named)

    def _close_round(self) -> None:
        auction = self._auction
        if auction is None or self._closing is None or not self._backup.may_act():
            return
        self._closing.cancel()
        self._closing = None
        auction.exclude_others(self._in_service())
        self._slow |= auction.missing
        if self._improves:
            self._auction = None
            self._have_handed_over(
                self._reallocation.decide(self._still_offered(auction)), auction
            )
            self.open()
            return
        result = auction.result()
        if self._left_out:
            # Robots that were not asked may be able to take it; they are asked next.
            self._hard |= {task_id for task_id, _ in result.impossible}
            result = replace(result, impossible=())
        for bid in result.awards:
            auction.forget(bid.robot_id)
            self._transfers.leave_out(bid.robot_id)
            self._reallocation.note_change()
        self._settle(result)

    def _still_offered(self, auction: Auction) -> list[tuple[Bundle, list[Bid]]]:
        """Return what has not changed since it was offered, with what was bid on it."""
        offers = [(self._bundles[each.task.id], bids) for each, bids in auction.offers()]
        get = self._backup.get
        return [
            (bundle, bids)
            for bundle, bids in offers
            if all(get(record.task.id) == record for record in bundle)
        ]

    def _have_handed_over(self, exchanges: Sequence[Exchange], auction: Auction) -> None:
        if not exchanges:
            return
        if self._giving_up is not None:
            self._giving_up.cancel()
        self._giving_up = self._talker.after(self._patience, self._give_up)
        self._decided_in = (auction.epoch, auction.number, auction.round)
        self._transfers.begin(exchanges)

    def _give_up(self) -> None:
        self._transfers.give_up()
        self.open()

    def _give_out(self, moves: Sequence[Move]) -> None:
        """Give what has been handed back to those that are to have it."""
        self._begin(improves=False)
        awards = tuple(bid for move in moves for bid in move.awards)
        bids = {record.task.id: move.bids for move in moves for record in move.records}
        self._reallocation.note_change()
        reason = "exchanged: " + ", ".join(map(str, moves))
        self._settle(Result(awards, (), bids, auction=self._decided_in, reason=reason))

    def _settle(self, result: Result) -> None:
        auction = self._auction
        if not self._changed and not (auction is not None and auction.is_outdated):
            self._parked |= {task_id for task_id, _ in result.impossible}
        self._decide(result, lambda: self._begin_round(result.awards))
