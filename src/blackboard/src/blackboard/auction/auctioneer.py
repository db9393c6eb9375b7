# SPDX-License-Identifier: BSD-3-Clause
"""Feeds the auctioneer's state with events, and carries out the effects."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

from blackboard.auction.candidate_selection import CandidateSelection
from blackboard.auction.plan_maker import PlanMaker
from blackboard.auction.step import (
    AuctionState,
    AwardsCommitted,
    BidsHeard,
    CarryOut,
    MakePlan,
    PlanMade,
    Recall,
    Reorder,
    ScheduleChanged,
    SetTimer,
    Signal,
    View,
    Withdrawn,
    step,
)
from blackboard.domain.record import Broadcast
from blackboard.domain.talker import TASK_BROADCAST, TASK_COST
from blackboard.errors import BidRefusedError

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping

    from blackboard.auction.auction import Result
    from blackboard.auction.central import Central
    from blackboard.auction.search.searcher import Searcher
    from blackboard.auction.step import Effect, Event
    from blackboard.consensus.node import RaftNode
    from blackboard.costing.bid_basis import Bids
    from blackboard.domain.characteristics import RobotStatus
    from blackboard.domain.record import TaskRecord
    from blackboard.domain.settings import BlackboardSettings
    from blackboard.domain.talker import Talker, Timer


class Auctioneer:
    """Auctions or plans what waits, and improves plans while nothing waits.

    Args:
        in_service: Gives the robots that take tasks.
        known: Gives all robots.
        last: Gives the last status of a robot; None if it was never heard.
        offered: Gives the task list as auctions are to see it.
        recall: Asks a robot to hand a task back if it has not begun.
        reorder: Tells a robot another place for a task on its list.
        carry_out: Called with the result of each round, and with what follows once it is
            committed.
        central: Works bids out for the robots; they bid themselves if None.
        searcher: Searches for plans, if that is how tasks are given out.
    """

    def __init__(
        self,
        talker: Talker,
        node: RaftNode,
        settings: BlackboardSettings,
        *,
        in_service: Callable[[], frozenset[str]],
        known: Callable[[], frozenset[str]],
        last: Callable[[str], RobotStatus | None],
        offered: Callable[[Mapping[str, TaskRecord]], Mapping[str, TaskRecord]],
        recall: Callable[[TaskRecord], None],
        reorder: Callable[[TaskRecord, int], None],
        carry_out: Callable[[Result, Callable[[], None]], None],
        central: Central | None,
        searcher: Searcher | None,
    ) -> None:
        self._talker = talker
        self._node = node
        self._in_service = in_service
        self._known = known
        self._last = last
        self._offered = offered
        self._recall = recall
        self._reorder = reorder
        self._carry_out = carry_out
        self._central = central
        self._timers: dict[Signal, Timer] = {}
        self._state = AuctionState(
            settings.bid_timeout,
            settings.order_timeout,
            CandidateSelection(settings.most_asked, settings.offers_each, settings.most_bids),
            plans=settings.decision == "planned",
        )
        self._plan_maker: PlanMaker | None = None
        if self._state.plans:
            assert central is not None  # noqa: S101  (see `Blackboard`)
            assert searcher is not None  # noqa: S101
            self._plan_maker = PlanMaker(
                talker,
                central,
                settings.improve_by,
                searcher,
                lambda planned: self.handle(PlanMade(planned)),
                lambda: self.handle(Signal.PLAN_AGAIN),
            )

    def lead(self) -> None:
        """Get ready to decide."""
        if self._plan_maker is not None:
            self._plan_maker.lead()

    def retire(self) -> None:
        """Decide no more."""
        self.handle(Signal.STEPPED_DOWN)
        if self._plan_maker is not None:
            self._plan_maker.retire()

    def has_recalled(self, record: TaskRecord) -> bool:
        """Return whether a task is handed back for a transfer rather than tried in vain."""
        return self._state.transfers.has_recalled(record)

    def hear_bids(self, bids: Bids) -> None:
        """Take in a robot's bids, or work them out from what it says of itself."""
        flaw = ""
        if self._central is not None and self._state.expects(bids):
            in_service = bids.robot_id in self._in_service()
            if in_service and self._central.has_found_bidder(bids):
                self.handle(Signal.BIDDER_FOUND)
                bids = replace(bids, bids=(), basis=None)  # it is asked for bids next
            auction = self._state.auction
            try:
                if auction is None or not auction.is_for_plan:
                    bids = self._central.bids(bids, self._state.call)
                elif bids.basis is not None:
                    self._central.check(bids.robot_id, bids.basis)
            except BidRefusedError as error:
                flaw = str(error)
        self.handle(BidsHeard(bids, flaw))

    def handle(self, event: Event) -> None:
        """Move on by an event."""
        is_noted_only = isinstance(event, ScheduleChanged | Withdrawn)
        if not (is_noted_only or event is Signal.STEPPED_DOWN or self._node.may_act()):
            return
        if event is Signal.TASK_CAME and self._plan_maker is not None:
            self._plan_maker.note_task()
        self._state, effects = step(self._state, event, self._view(self._node.records))
        for effect in effects:
            self._do(effect)
        if self._plan_maker is not None and not self._state.is_planning:
            self._plan_maker.drop()

    def rehearse(self, record: TaskRecord) -> None:
        """Take the first step with a new task, and drop its result.

        Raises:
            Exception: What the step raises when the task is on the list.
        """
        records = {**self._node.records, record.task.id: record}
        step(self._state, Signal.TASK_CAME, self._view(records))

    def _view(self, records: Mapping[str, TaskRecord]) -> View:
        node = self._node
        seen = self._offered(records)
        return View(node.hive, node.epoch, seen, self._in_service(), self._last)

    def _do(self, effect: Effect) -> None:
        if isinstance(effect, Broadcast):
            calls = [effect]
            if self._central is not None:
                calls = self._central.questions(effect, self._in_service(), self._known())
            for call in calls:
                self._talker.publish(TASK_BROADCAST, call, call.asked)
        elif isinstance(effect, CarryOut):
            committed = AwardsCommitted(effect.result.awards)
            self._carry_out(effect.result, lambda: self.handle(committed))
        elif isinstance(effect, Recall):
            self._recall(effect.record)
        elif isinstance(effect, Reorder):
            self._reorder(effect.record, effect.place)
        elif isinstance(effect, MakePlan):
            assert self._plan_maker is not None  # noqa: S101  (only who plans is asked for plans)
            self._plan_maker.begin(effect)
        elif isinstance(effect, SetTimer):
            self._set_timer(effect.signal, effect.seconds)
        else:
            self._talker.refuse(TASK_COST, effect.reason)

    def _set_timer(self, signal: Signal, seconds: float | None) -> None:
        if (timer := self._timers.pop(signal, None)) is not None:
            timer.cancel()
        if seconds is not None:
            self._timers[signal] = self._talker.after(seconds, lambda: self.handle(signal))
