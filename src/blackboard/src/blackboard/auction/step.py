# SPDX-License-Identifier: BSD-3-Clause
"""The one function by which the auctioneer moves on: from state, event and view of the hive.

While something waits it holds auctions, one after the other, or has plans made; a leader that
plans also improves the lists while nothing waits. Nothing here knows of time, messages or disks.
`CarryOut` is always the last effect of a step, because the commit it asks for may bring the next
event at once.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from enum import Enum, auto
from typing import TYPE_CHECKING

from blackboard.auction.auction import Auction, Result
from blackboard.auction.carrying_out import steps_to
from blackboard.auction.transfers import Transfers
from blackboard.domain.record import Broadcast
from blackboard.domain.task import MAX_PRIORITY, TaskState, TaskType

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping, Sequence

    from blackboard.auction.candidate_selection import CandidateSelection
    from blackboard.auction.search.planned import Planned
    from blackboard.auction.transfers import Moves
    from blackboard.costing.bid_basis import BidBasis, Bids
    from blackboard.domain.bid import Bid
    from blackboard.domain.characteristics import RobotStatus
    from blackboard.domain.record import TaskRecord


@dataclass(frozen=True, slots=True)
class View:
    """The hive at the moment of an event."""

    hive: str  # its id
    epoch: int  # of this blackboard
    records: Mapping[str, TaskRecord]  # the task list, by task id
    in_service: frozenset[str]  # the robots that take tasks
    # Gives the last status of a robot; None if it was never heard.
    last: Callable[[str], RobotStatus | None]


@dataclass(frozen=True, slots=True)
class AuctionState:
    """The state of the auctioneer; `step` moves it on."""

    bid_timeout: float  # longest time that a round stays open [s]
    transfer_timeout: float  # tasks that are not handed back within this time are auctioned [s]
    selection: CandidateSelection  # limits what one call for bids offers, and to whom
    # Tasks that change hands because a plan is better so.
    transfers: Transfers = field(default_factory=Transfers)
    # The one under way; between its rounds, the awards of the last are being committed.
    auction: Auction | None = None
    auctions: int = 0
    # Whether several tasks are planned together rather than auctioned one after the other.
    plans: bool = False
    quiet_plans: int = 0  # plans in a row that have gained nothing
    # Tasks that are auctioned all the same: a plan has found no robot for them.
    unplanned: frozenset[str] = frozenset()
    # Tasks that were given out alone a moment ago, and those that were when the plan was begun: a
    # burst that begins with one plans it, too.
    fresh: frozenset[str] = frozenset()
    just_begun: frozenset[str] = frozenset()
    call: Broadcast = field(default_factory=lambda: Broadcast(0, 0, ()))  # the last call for bids
    has_bidder: bool = False  # whether a robot is to be asked again, for bids this time
    # Robots that did not answer in time and have not answered since.
    slow: frozenset[str] = frozenset()
    # Tasks that nobody can take; they are offered again when something changes.
    parked: frozenset[str] = frozenset()
    # Tasks that the robots asked first cannot take; they are offered to all robots next.
    hard: frozenset[str] = frozenset()
    is_stale: bool = False  # whether the auction under way may find impossible what no longer is

    @property
    def is_planning(self) -> bool:
        """Whether a plan is being made."""
        auction = self.auction
        return auction is not None and auction.is_for_plan and not auction.is_open

    def expects(self, bids: Bids) -> bool:
        """Return whether an auction is under way and the bids do not answer an earlier one."""
        auction = self.auction
        if auction is None:
            return False
        return bids.epoch != auction.epoch or bids.auction >= auction.number


class Signal(Enum):
    """An event that says no more than its name."""

    TASK_CAME = auto()  # a task may wait: it was posted or handed back
    FLEET_CHANGED = auto()  # some robot may now take what nobody could
    ROUND_TIMEOUT = auto()  # the wait for bids is over
    TRANSFER_TIMEOUT = auto()  # the wait for tasks that are to be handed back is over
    BIDDER_FOUND = auto()  # a robot bids itself that was not asked for bids
    STEPPED_DOWN = auto()  # this blackboard no longer leads
    PLAN_AGAIN = auto()  # tasks have come while a plan was made
    MOMENT_OVER = auto()  # what was given out alone belongs to no burst


@dataclass(frozen=True, slots=True)
class BidsHeard:
    """A robot answers a call; `flaw` says why no bids could be worked out from its answer."""

    bids: Bids
    flaw: str = ""


@dataclass(frozen=True, slots=True)
class AwardsCommitted:
    """The awards of a round are on the task list for good, and the winners have their orders."""

    awards: tuple[Bid, ...]


@dataclass(frozen=True, slots=True)
class RobotImproved:
    """A robot may bid better now than it has bid."""

    robot_id: str


@dataclass(frozen=True, slots=True)
class ScheduleChanged:
    """A robot's schedule is not the one it bid for."""

    robot_id: str


@dataclass(frozen=True, slots=True)
class Withdrawn:
    """Tasks do not wait any more."""

    task_ids: frozenset[str]


@dataclass(frozen=True, slots=True)
class PlanMade:
    """The plan that was asked for is made."""

    planned: Planned


@dataclass(frozen=True, slots=True)
class ImprovementDue:
    """It is time to plan again the tasks that robots hold."""

    held: tuple[TaskRecord, ...]


PLANS = 2
"""After so many plans that gain nothing, the next waits until something changes."""

WORTH = 0.002
"""A plan is followed if the measure falls by more than this share: what it changes is a small part
of what all lists take."""

MOMENT = 0.1
"""A task that comes within this time after another belongs to the same burst [s]."""

Event = (
    Signal
    | BidsHeard
    | AwardsCommitted
    | RobotImproved
    | ScheduleChanged
    | Withdrawn
    | PlanMade
    | ImprovementDue
)


@dataclass(frozen=True, slots=True)
class CarryOut:
    """Commit a result, order its winners, and report `AwardsCommitted` then."""

    result: Result


@dataclass(frozen=True, slots=True)
class Recall:
    """Ask a robot to hand a task back if it has not begun."""

    record: TaskRecord


@dataclass(frozen=True, slots=True)
class Reorder:
    """Tell a robot another place for a task on its list; 1 is first."""

    record: TaskRecord
    place: int


@dataclass(frozen=True, slots=True)
class MakePlan:
    """Make a plan of what robots tell, and report `PlanMade` then.

    Attributes:
        bases: What each robot tells, by its name.
        records: What is to be planned.
        improves: Whether nothing waits for it, so that no start is held.
        number: Of the auction, from which chance is drawn.
    """

    bases: Mapping[str, BidBasis]
    records: tuple[TaskRecord, ...]
    improves: bool
    number: tuple[int, ...]


@dataclass(frozen=True, slots=True)
class SetTimer:
    """Send a signal after a time [s] from now, and no earlier; never if None."""

    signal: Signal
    seconds: float | None = None


@dataclass(frozen=True, slots=True)
class Refuse:
    """Tell the person who runs this member why bids are refused."""

    reason: str


Effect = Broadcast | CarryOut | Recall | Reorder | MakePlan | SetTimer | Refuse
"""What a step asks for; a `Broadcast` is sent to the robots it asks."""

Step = tuple[AuctionState, list[Effect]]


def step(state: AuctionState, event: Event, view: View) -> Step:
    """Return the auctioneer's state after an event, and what it asks for, in order."""
    if isinstance(event, Signal):
        after = _follow(state, event, view)
    elif isinstance(event, BidsHeard):
        after = _hear(state, event, view)
    elif isinstance(event, AwardsCommitted):
        after = _next_round(state, event.awards, view)
    elif isinstance(event, RobotImproved):
        auction = state.auction and state.auction.outdate(event.robot_id)
        after = _open(_unparked(replace(state, auction=auction)), view)
    elif isinstance(event, ScheduleChanged):
        auction = state.auction and state.auction.forget(event.robot_id)
        after = replace(state, auction=auction, quiet_plans=0), []
    elif isinstance(event, Withdrawn):
        after = _withdraw(state, event.task_ids), []
    elif isinstance(event, PlanMade):
        after = _follow_plan(state, event.planned, view)
    else:
        after = _improve(state, event, view)
    return after


def _follow(state: AuctionState, signal: Signal, view: View) -> Step:
    if signal is Signal.ROUND_TIMEOUT:
        return _close_round(state, view)
    if signal is Signal.STEPPED_DOWN:
        transfers = state.transfers.give_up()
        stops: list[Effect] = [SetTimer(Signal.ROUND_TIMEOUT), SetTimer(Signal.TRANSFER_TIMEOUT)]
        return replace(state, auction=None, transfers=transfers), stops
    if signal is Signal.TRANSFER_TIMEOUT:
        state = replace(state, transfers=state.transfers.give_up())
    elif signal is Signal.FLEET_CHANGED:
        state = replace(_unparked(state), is_stale=True)
    elif signal is Signal.BIDDER_FOUND:
        return replace(_unparked(state), has_bidder=True), []
    elif signal is Signal.PLAN_AGAIN and state.is_planning:
        return _next_round(state, (), view)
    elif signal is Signal.MOMENT_OVER:
        return replace(state, fresh=frozenset()), []
    return _open(state, view)


def _unparked(state: AuctionState) -> AuctionState:
    nothing: frozenset[str] = frozenset()
    return replace(state, parked=nothing, unplanned=nothing, quiet_plans=0)


def _open(state: AuctionState, view: View) -> Step:
    """Ask for bids on everything that waits, unless an auction of that is under way."""
    effects: list[Effect] = []
    auction = state.auction
    if auction is not None and auction.improves and _waiting(state, view):
        state, effects = replace(state, auction=None), [SetTimer(Signal.ROUND_TIMEOUT)]
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


def _begin(state: AuctionState, view: View, *, improves: bool = False) -> AuctionState:
    number = state.auctions + 1
    auction = Auction(view.epoch, number, improves)
    return replace(state, auctions=number, auction=auction, just_begun=frozenset())


def _next_round(state: AuctionState, awards: tuple[Bid, ...], view: View) -> Step:
    """Ask the robots whose bids do not hold, or end the auction if nothing is left.

    Tasks that the robots asked first cannot take are offered to all.
    """
    auction, robots = state.auction, view.in_service
    if auction is None:
        return state, []
    waiting = _waiting(state, view)
    if not waiting or not robots or state.is_stale:
        return _open(replace(state, auction=None), view)
    planned = _to_plan(state, waiting, view)
    if planned:
        state = replace(state, just_begun=state.just_begun | state.fresh)
        return _ask(state, auction, planned, robots, awards, view, for_plan=True)
    waiting = _urgent(waiting, state.unplanned) or waiting
    hard = [record for record in waiting if record.task.id in state.hard]
    most = len(robots) if hard else min(len(robots), state.selection.max_asked)
    offers = state.selection.offers(hard or waiting, most, auction.offered)
    asked = robots if hard else state.selection.asked(offers, robots, view.last)
    state = replace(state, hard=state.hard - {record.task.id for record in offers})
    return _ask(state, auction, offers, asked, awards, view)


def _to_plan(
    state: AuctionState, waiting: Sequence[TaskRecord], view: View
) -> Sequence[TaskRecord]:
    """Return which of the waiting tasks are planned together; none if they are auctioned.

    One task alone in an idle fleet is auctioned: its best place is found at once, and no start is
    held for it. So is what may interrupt a robot, and what a plan has found no robot for.
    """
    if not state.plans or not view.in_service or _urgent(waiting, state.unplanned):
        return ()
    return waiting if len(waiting) > 1 or _has_work(view) else ()


def _has_work(view: View) -> bool:
    """Return whether a robot in service has a task."""
    return any(
        record.state in {TaskState.ASSIGNED, TaskState.STARTED} and record.robot in view.in_service
        for record in view.records.values()
    )


def _urgent(waiting: Sequence[TaskRecord], unplanned: frozenset[str]) -> list[TaskRecord]:
    """Return the tasks that are auctioned before anything is planned."""
    return [
        record
        for record in waiting
        if record.task.priority == MAX_PRIORITY or record.task.id in unplanned
    ]


def _ask(
    state: AuctionState,
    auction: Auction,
    offers: Sequence[TaskRecord],
    robots: frozenset[str],
    awards: tuple[Bid, ...],
    view: View,
    *,
    for_plan: bool = False,
) -> Step:
    begin = auction.for_plan if for_plan else auction.next_round
    auction = begin(offers, robots, view.in_service)
    bidders, auction = auction.missing, auction.excuse(state.slow)
    state = replace(state, auction=auction)
    if not bidders:
        return _close_round(state, view)
    asked = None
    if awards or auction.is_selective or not auction.is_new:
        awarded = {bid.robot_id: bid.task_id for bid in awards}
        asked = {robot: awarded.get(robot, "") for robot in sorted(bidders)}
    call = Broadcast(
        auction.epoch,
        auction.number,
        tuple((record.task, record.step) for record in offers),
        view.hive,
        round=auction.round,
        asked=asked,
    )
    state = replace(state, call=call)
    if not auction.missing:
        # Nobody waits for those that were too slow; but only what they are asked can they answer.
        state, effects = _close_round(state, view)
        return state, [call, *effects]
    return state, [SetTimer(Signal.ROUND_TIMEOUT, state.bid_timeout), call]


def _hear(state: AuctionState, event: BidsHeard, view: View) -> Step:
    """Take in a robot's bids; the last one expected closes the round."""
    bids = event.bids
    if bids.robot_id in state.slow:
        state = replace(state, slow=state.slow - {bids.robot_id})
    if state.auction is None or not state.expects(bids):
        return state, []
    if event.flaw:
        return state, [Refuse(event.flaw)]
    if state.auction.is_for_plan:
        auction, refusal = state.auction.hear_basis(bids, view.in_service)
    else:
        auction, refusal = state.auction.hear(bids, view.in_service)
    state = replace(state, auction=auction)
    if refusal:
        return state, [Refuse(refusal)]
    return (state, []) if auction.missing else _close_round(state, view)


def _close_round(state: AuctionState, view: View) -> Step:
    if state.auction is None or not state.auction.is_open:
        return state, []
    auction = state.auction.close(view.in_service)
    state = replace(state, auction=auction, slow=state.slow | auction.missing)
    stop = SetTimer(Signal.ROUND_TIMEOUT)
    if state.has_bidder:
        state, effects = _open(replace(state, auction=None, has_bidder=False), view)
        return state, [stop, *effects]
    if auction.is_for_plan:
        state, effects = _make_plan(state, auction, view)
        return state, [stop, *effects]
    if len(_waiting(state, view)) > 1 and _to_plan(state, _waiting(state, view), view):
        # While the robots answered, more has come: one plan for all is better.
        state, effects = _next_round(state, (), view)
        return state, [stop, *effects]
    result = auction.result()
    if auction.is_selective:
        # Robots that were not asked may be able to take it; they are asked next.
        hard = state.hard.union(task_id for task_id, _ in result.impossible)
        state, result = replace(state, hard=hard), replace(result, impossible=())
    transfers = state.transfers
    for bid in result.awards:
        auction = auction.forget(bid.robot_id)
        transfers = transfers.without_taker(bid.robot_id)
    quiet = 0 if result.awards else state.quiet_plans
    state = replace(state, auction=auction, transfers=transfers, quiet_plans=quiet)
    state, effects = _settle(state, result)
    if state.plans and result.awards:
        state = replace(state, fresh=frozenset(bid.task_id for bid in result.awards))
        effects = [SetTimer(Signal.MOMENT_OVER, MOMENT), *effects]
    return state, [stop, *effects]


def _settle(state: AuctionState, result: Result) -> Step:
    """Have a result carried out; what is impossible waits until something changes."""
    is_outdated = state.auction is not None and bool(state.auction.outdated)
    if not state.is_stale and not is_outdated:
        parked = state.parked.union(task_id for task_id, _ in result.impossible)
        state = replace(state, parked=parked)
    return state, [CarryOut(result)]


def _improve(state: AuctionState, event: ImprovementDue, view: View) -> Step:
    """Ask for what a better plan is made of, unless the last ones have gained nothing."""
    if not state.plans or state.auction is not None or state.transfers.moves:
        return state, []
    unbegun = [record for record in event.held if record.state is TaskState.ASSIGNED]
    may_gain = len(unbegun) > 1 or (unbegun and len(view.in_service) > 1)
    if not may_gain or state.quiet_plans >= PLANS or _waiting(state, view):
        return state, []
    state = _begin(state, view, improves=True)
    state = replace(state, quiet_plans=state.quiet_plans + 1)
    assert state.auction is not None  # noqa: S101  (it has just begun)
    return _ask(state, state.auction, unbegun, view.in_service, (), view, for_plan=True)


def _make_plan(state: AuctionState, auction: Auction, view: View) -> Step:
    """Have a plan made of everything that waits or has not begun."""
    left_out = state.parked | state.transfers.task_ids | state.unplanned
    bases = {robot: each for robot, each in auction.bases.items() if robot in view.in_service}
    records = tuple(
        record
        for record in view.records.values()
        if _is_planned(state, record, bases) and record.task.id not in left_out
    )
    number = (auction.epoch, auction.number, auction.round)
    return state, [MakePlan(bases, records, auction.improves, number)]


def _is_planned(state: AuctionState, record: TaskRecord, bases: Mapping[str, BidBasis]) -> bool:
    """Return whether a plan may say where a task goes; what others do is not known to it."""
    if record.state is TaskState.WAITING:
        return not record.parts and record.task.priority < MAX_PRIORITY
    is_loose = record.state is TaskState.ASSIGNED or _may_move(state, record)
    return is_loose and record.robot in bases


def _may_move(state: AuctionState, record: TaskRecord) -> bool:
    """Return whether a task that a robot has just begun may still go to another place.

    A robot with an arm may soon have its load on board, and nothing comes before what is urgent.
    """
    task, is_new = record.task, record.task.id in state.just_begun and record.step == 0
    is_bound = TaskType(task.type).picks or task.priority == MAX_PRIORITY
    return is_new and record.state is TaskState.STARTED and not is_bound


def _follow_plan(state: AuctionState, planned: Planned, view: View) -> Step:
    """Carry a plan out, if it is still wanted; what it has no robot for is auctioned next."""
    auction = state.auction
    if auction is None or not state.is_planning:
        return state, []
    is_kept = auction.improves and planned.gain <= WORTH
    steps = steps_to(planned, view.records, view.in_service, auction.bids, keeps_lists=is_kept)
    if is_kept and not steps.moves:
        return _open(replace(state, auction=None), view)
    left = {each.task.id for each in planned.left if each.state is TaskState.WAITING}
    changes = bool(steps.awards or steps.moves or steps.reorders)
    quiet = 0 if changes else state.quiet_plans
    state = replace(state, unplanned=state.unplanned | left, quiet_plans=quiet)
    effects: list[Effect] = [Reorder(*each) for each in steps.reorders]
    number = (auction.epoch, auction.number, auction.round)
    if steps.moves:
        transfers = state.transfers.begin(steps.moves, view.records.get, number)
        state = replace(state, transfers=transfers)
        timer = SetTimer(Signal.TRANSFER_TIMEOUT, state.transfer_timeout)
        effects += [timer, *(Recall(move.record) for move in steps.moves)]
    if auction.improves:
        state, more = _open(replace(state, auction=None), view)
        return state, effects + more
    missing, reason = auction.missing, planned.reason
    result = Result(steps.awards, (), steps.bids, missing, number, reason, steps.places)
    return state, [*effects, CarryOut(result)]


def _award_moves(state: AuctionState, moves: Moves, view: View) -> Step:
    """Award what has been handed back to the robots that were to get it."""
    state = _begin(state, view)
    awards = tuple(move.taker for move in moves)
    bids = {move.record.task.id: move.bids for move in moves}
    reason = "exchanged: " + ", ".join(map(str, moves))
    places = {move.record.task.id: move.place for move in moves}
    decided_in = state.transfers.decided_in
    result = Result(awards, (), bids, auction=decided_in, reason=reason, places=places)
    return _settle(state, result)


def _withdraw(state: AuctionState, task_ids: frozenset[str]) -> AuctionState:
    auction = state.auction and state.auction.withdraw(task_ids)
    hard, parked = state.hard - task_ids, state.parked - task_ids
    unplanned = state.unplanned - task_ids
    return replace(state, auction=auction, hard=hard, parked=parked, unplanned=unplanned)
