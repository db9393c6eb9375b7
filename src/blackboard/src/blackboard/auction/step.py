# SPDX-License-Identifier: BSD-3-Clause
"""The one function by which the auctioneer moves on: from state, event and view of the hive.

While something waits it holds auctions, one after the other; while nothing waits, it offers again
what robots have not begun. Nothing here knows of time, messages or disks. `CarryOut` is always the
last effect of a step, because the commit it asks for may bring the next event at once.
"""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

from blackboard.auction.auction import Auction, Result
from blackboard.auction.state import (
    AwardsCommitted,
    BidsHeard,
    CallForBids,
    CarryOut,
    FleetChanged,
    ReallocationDue,
    Recall,
    Refuse,
    RobotImproved,
    ScheduleChanged,
    StartTimer,
    StopTimer,
    TaskCame,
    TimerDue,
    TimerKind,
    Withdrawn,
)
from blackboard.domain.record import Broadcast
from blackboard.domain.task import TaskState

if TYPE_CHECKING:
    from collections.abc import Sequence

    from blackboard.auction.auction import Bundle
    from blackboard.auction.state import AuctionState, Effect, Event, Step, View
    from blackboard.auction.transfers import Move
    from blackboard.domain.bid import Bid
    from blackboard.domain.record import TaskRecord


def step(state: AuctionState, event: Event, view: View) -> Step:
    """Move the auctioneer on.

    Args:
        state: Its state.
        event: What happened.
        view: The hive now.

    Returns:
        Its state afterwards, and what it asks for, in order.
    """
    if isinstance(event, TaskCame):
        after = _open(state, view)
    elif isinstance(event, BidsHeard):
        after = _hear(state, event, view)
    elif isinstance(event, TimerDue):
        after = _run_out(state, event.timer, view)
    elif isinstance(event, AwardsCommitted):
        after = _next_round(state, event.awards, view)
    elif isinstance(event, FleetChanged | RobotImproved):
        after = _open(_reconsider(state, event), view)
    elif isinstance(event, ReallocationDue):
        after = _reallocate(state, event, view)
    elif isinstance(event, ScheduleChanged):
        auction = state.auction and state.auction.forget(event.robot_id)
        after = replace(state, auction=auction, reallocation=state.reallocation.resume()), []
    elif isinstance(event, Withdrawn):
        after = _withdraw(state, event.task_ids), []
    else:
        after = _stop(state)
    return after


def _open(state: AuctionState, view: View) -> Step:
    """Ask for bids on everything that waits, unless an auction of that is under way."""
    effects: list[Effect] = []
    auction = state.auction
    if auction is not None and auction.reallocates and _waiting(state, view):
        state, effects = _drop(replace(state, dropped=(auction.epoch, auction.number)))
    if state.auction is not None:
        return state, effects
    transfers, moves = state.transfers.ready(view.in_service, view.records.get)
    state = replace(state, is_stale=False, transfers=transfers)
    waiting = _waiting(state, view)
    if moves:
        state, more = _award_moves(state, moves, view)
    elif waiting and not view.in_service:
        reason = "no robot is in service"
        state, more = _settle(state, Result((), tuple((each.task.id, reason) for each in waiting)))
    elif waiting:
        state, more = _next_round(_begin(state, view), (), view)
    else:
        more = []
    return state, effects + more


def _waiting(state: AuctionState, view: View) -> list[TaskRecord]:
    left_out = state.parked | state.transfers.task_ids
    return [
        record
        for record in view.records.values()
        if record.state is TaskState.WAITING
        and not record.parts
        and record.task.id not in left_out
    ]


def _begin(state: AuctionState, view: View, *, reallocates: bool = False) -> AuctionState:
    number = state.auctions + 1
    return replace(state, auctions=number, auction=Auction(view.epoch, number, reallocates))


def _drop(state: AuctionState) -> Step:
    return replace(state, auction=None), [StopTimer(TimerKind.ROUND)]


def _next_round(state: AuctionState, awards: tuple[Bid, ...], view: View) -> Step:
    """Ask the robots whose bids do not hold, or end the auction if nothing is left.

    Tasks that the robots asked first cannot take are offered to all.

    Args:
        state: With the auction between two rounds.
        awards: Of the last round.
        view: The hive now.
    """
    auction, robots = state.auction, view.in_service
    if auction is None:
        return state, []
    waiting = _waiting(state, view)
    if not waiting or not robots or state.is_stale:
        return _open(replace(state, auction=None), view)
    hard = [record for record in waiting if record.task.id in state.hard]
    most = len(robots) if hard else min(len(robots), state.selection.max_asked)
    offers = state.selection.offers(hard or waiting, most, auction.bundles)
    asked = robots if hard else state.selection.asked(offers, robots, view.last)
    state = replace(state, hard=state.hard - {record.task.id for record in offers})
    return _ask(state, auction, [(record,) for record in offers], asked, awards, view)


def _ask(
    state: AuctionState,
    auction: Auction,
    bundles: Sequence[Bundle],
    robots: frozenset[str],
    awards: tuple[Bid, ...],
    view: View,
) -> Step:
    auction = auction.next_round(bundles, robots, view.in_service)
    bidders, auction = auction.missing, auction.excuse(state.slow)
    state = replace(state, auction=auction)
    if not auction.missing:
        return _close_round(state, view)
    asked = None
    if awards or auction.is_selective or not auction.is_new:
        awarded = {bid.robot_id: bid.task_id for bid in awards}
        asked = {robot: awarded.get(robot, "") for robot in sorted(bidders)}
    sizes = tuple(map(len, bundles))
    call = Broadcast(
        auction.epoch,
        auction.number,
        tuple((record.task, record.step) for bundle in bundles for record in bundle),
        view.hive,
        round=auction.round,
        asked=asked,
        sizes=() if set(sizes) == {1} else sizes,
    )
    timer = StartTimer(TimerKind.ROUND, state.bid_timeout)
    return replace(state, call=call), [timer, CallForBids(call)]


def _hear(state: AuctionState, event: BidsHeard, view: View) -> Step:
    """Take in a robot's bids; the last one expected closes the round."""
    bids = event.bids
    state = replace(state, slow=state.slow - {bids.robot_id})
    if state.auction is None or not state.expects(bids):
        return state, []
    if event.flaw:
        return state, [Refuse(event.flaw)]
    auction, refusal = state.auction.hear(bids, view.in_service)
    state = replace(state, auction=auction)
    if refusal:
        return state, [Refuse(refusal)]
    return (state, []) if auction.missing else _close_round(state, view)


def _run_out(state: AuctionState, timer: TimerKind, view: View) -> Step:
    if timer is TimerKind.ROUND:
        return _close_round(state, view)
    return _open(replace(state, transfers=state.transfers.give_up()), view)


def _close_round(state: AuctionState, view: View) -> Step:
    if state.auction is None or not state.auction.is_open:
        return state, []
    auction = state.auction.close(view.in_service)
    state = replace(state, auction=auction, slow=state.slow | auction.missing)
    stop = StopTimer(TimerKind.ROUND)
    if auction.reallocates:
        state, effects = _begin_transfers(state, auction, view)
        state, more = _open(replace(state, auction=None), view)
        return state, [stop, *effects, *more]
    result = auction.result()
    if auction.is_selective:
        # Robots that were not asked may be able to take it; they are asked next.
        hard = state.hard.union(task_id for task_id, _ in result.impossible)
        state, result = replace(state, hard=hard), replace(result, impossible=())
    transfers = state.transfers
    for bid in result.awards:
        auction = auction.forget(bid.robot_id)
        transfers = transfers.without_taker(bid.robot_id)
    reallocation = state.reallocation.resume() if result.awards else state.reallocation
    state = replace(state, auction=auction, transfers=transfers, reallocation=reallocation)
    state, effects = _settle(state, result)
    return state, [stop, *effects]


def _settle(state: AuctionState, result: Result) -> Step:
    """Have a result carried out; what is impossible waits until something changes."""
    is_outdated = state.auction is not None and bool(state.auction.outdated)
    if not state.is_stale and not is_outdated:
        parked = state.parked.union(task_id for task_id, _ in result.impossible)
        state = replace(state, parked=parked)
    return state, [CarryOut(result)]


def _reallocate(state: AuctionState, event: ReallocationDue, view: View) -> Step:
    """Offer some tasks that have not begun again, while there is nothing else to do."""
    if state.auction is not None or state.transfers.exchanges or _waiting(state, view):
        return state, []
    robots = view.in_service
    most = state.selection.max_bundles(len(robots))
    reallocation, bundles = state.reallocation.next_step(event.held, robots, view.last, most)
    state = replace(state, reallocation=reallocation)
    if not bundles:
        return state, []
    state = _begin(state, view, reallocates=True)
    assert state.auction is not None  # noqa: S101  (it has just begun)
    offers = [record for bundle in bundles for record in bundle]
    asked = state.selection.asked(offers, robots, view.last) | {each.robot for each in offers}
    return _ask(state, state.auction, bundles, asked, (), view)


def _begin_transfers(state: AuctionState, auction: Auction, view: View) -> Step:
    """Recall what changes hands, of those offers that are still as they were offered."""
    unchanged = [
        (bundle, bids)
        for bundle, bids in auction.offers()
        if all(view.records.get(record.task.id) == record for record in bundle)
    ]
    reallocation, exchanges = state.reallocation.decide(unchanged)
    state = replace(state, reallocation=reallocation)
    if not exchanges:
        return state, []
    decided_in = (auction.epoch, auction.number, auction.round)
    transfers = state.transfers.begin(exchanges, view.records.get, decided_in)
    timer = StartTimer(TimerKind.TRANSFERS, state.transfer_timeout)
    return replace(state, transfers=transfers), [timer, *map(Recall, transfers.records)]


def _award_moves(state: AuctionState, moves: Sequence[Move], view: View) -> Step:
    """Award what has been handed back to the robots that were to get it."""
    state = _begin(replace(state, reallocation=state.reallocation.resume()), view)
    awards = tuple(bid for move in moves for bid in move.awards)
    bids = {record.task.id: move.bids for move in moves for record in move.records}
    reason = "exchanged: " + ", ".join(map(str, moves))
    decided_in = state.transfers.decided_in
    return _settle(state, Result(awards, (), bids, auction=decided_in, reason=reason))


def _reconsider(state: AuctionState, event: FleetChanged | RobotImproved) -> AuctionState:
    """Offer what nobody could take again.

    What the auction under way finds impossible may be out of date as well.
    """
    state = replace(state, parked=frozenset(), reallocation=state.reallocation.resume())
    if isinstance(event, FleetChanged):
        return replace(state, is_stale=True)
    return replace(state, auction=state.auction and state.auction.outdate(event.robot_id))


def _withdraw(state: AuctionState, task_ids: frozenset[str]) -> AuctionState:
    auction = state.auction and state.auction.withdraw(task_ids)
    hard, parked = state.hard - task_ids, state.parked - task_ids
    return replace(state, auction=auction, hard=hard, parked=parked)


def _stop(state: AuctionState) -> Step:
    """Drop everything under way; the next leader begins anew."""
    state, effects = _drop(replace(state, transfers=state.transfers.give_up()))
    return state, [*effects, StopTimer(TimerKind.TRANSFERS)]
