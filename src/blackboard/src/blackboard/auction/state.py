# SPDX-License-Identifier: BSD-3-Clause
"""What the auctioneer knows, the events that reach it, and the effects it asks for."""

from __future__ import annotations

from dataclasses import dataclass, field
from enum import Enum
from typing import TYPE_CHECKING

from blackboard.auction.transfers import Transfers
from blackboard.domain.record import Broadcast

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping

    from blackboard.auction.auction import Auction, Result
    from blackboard.auction.candidate_selection import CandidateSelection
    from blackboard.auction.reallocation import Reallocation
    from blackboard.costing.bid_basis import Bids
    from blackboard.domain.bid import Bid
    from blackboard.domain.characteristics import RobotStatus
    from blackboard.domain.record import TaskRecord


@dataclass(frozen=True, slots=True)
class View:
    """The hive at the moment of an event.

    Attributes:
        hive: Its id.
        epoch: Of this blackboard.
        records: The task list, by task id.
        in_service: The robots that take tasks.
        last: Gives the last status of a robot; None if it was never heard.
    """

    hive: str
    epoch: int
    records: Mapping[str, TaskRecord]
    in_service: frozenset[str]
    last: Callable[[str], RobotStatus | None]


@dataclass(frozen=True, slots=True)
class AuctionState:
    """The state of the auctioneer; `step` moves it on.

    Attributes:
        bid_timeout: Longest time that a round stays open [s].
        transfer_timeout: Tasks that are not handed back within this time are auctioned [s].
        selection: Limits what one call for bids offers, and to whom.
        reallocation: Chooses what is offered while nothing waits.
        transfers: Tasks that change hands because of that.
        auction: The one under way; between its rounds, the awards of the last are being committed.
        auctions: How many there have been.
        call: The last call for bids.
        dropped: Epoch and number of the auction that was dropped last; late bids on it are no
            error.
        slow: Robots that did not answer in time and have not answered since.
        parked: Tasks that nobody can take; they are offered again when something changes.
        hard: Tasks that the robots asked first cannot take; they are offered to all robots next.
        is_stale: Whether the auction under way may find impossible what no longer is.
    """

    bid_timeout: float
    transfer_timeout: float
    selection: CandidateSelection
    reallocation: Reallocation
    transfers: Transfers = field(default_factory=Transfers)
    auction: Auction | None = None
    auctions: int = 0
    call: Broadcast = field(default_factory=lambda: Broadcast(0, 0, ()))
    dropped: tuple[int, int] = (0, 0)
    slow: frozenset[str] = frozenset()
    parked: frozenset[str] = frozenset()
    hard: frozenset[str] = frozenset()
    is_stale: bool = False

    def expects(self, bids: Bids) -> bool:
        """Return whether an auction is under way and the bids do not answer a dropped one."""
        return self.auction is not None and (bids.epoch, bids.auction) != self.dropped


class TimerKind(Enum):
    """What a timer ends."""

    ROUND = "round"
    """The wait for bids."""
    TRANSFERS = "transfers"
    """The wait for tasks that are to be handed back."""


@dataclass(frozen=True, slots=True)
class TaskCame:
    """A task may wait: it was posted or handed back."""


@dataclass(frozen=True, slots=True)
class BidsHeard:
    """A robot answers a call; `flaw` says why no bids could be worked out from its answer."""

    bids: Bids
    flaw: str = ""


@dataclass(frozen=True, slots=True)
class TimerDue:
    """A timer has run out."""

    timer: TimerKind


@dataclass(frozen=True, slots=True)
class AwardsCommitted:
    """The result of a round is on the task list for good, and its winners have their orders."""

    awards: tuple[Bid, ...]


@dataclass(frozen=True, slots=True)
class FleetChanged:
    """Some robot may now take what nobody could."""


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
class ReallocationDue:
    """It is time to improve the allocation of the tasks that robots hold."""

    held: tuple[TaskRecord, ...]


@dataclass(frozen=True, slots=True)
class SteppedDown:
    """This blackboard no longer leads."""


Event = (
    TaskCame
    | BidsHeard
    | TimerDue
    | AwardsCommitted
    | FleetChanged
    | RobotImproved
    | ScheduleChanged
    | Withdrawn
    | ReallocationDue
    | SteppedDown
)


@dataclass(frozen=True, slots=True)
class CallForBids:
    """Ask robots for bids; `state.call` says whom."""

    call: Broadcast


@dataclass(frozen=True, slots=True)
class CarryOut:
    """Commit a result, order its winners, and say `AwardsCommitted` then."""

    result: Result


@dataclass(frozen=True, slots=True)
class Recall:
    """Ask a robot to hand a task back if it has not begun."""

    record: TaskRecord


@dataclass(frozen=True, slots=True)
class StartTimer:
    """Say `TimerDue` after a time [s]; a timer of the same kind that runs is replaced."""

    timer: TimerKind
    seconds: float


@dataclass(frozen=True, slots=True)
class StopTimer:
    """Stop a timer, if it runs."""

    timer: TimerKind


@dataclass(frozen=True, slots=True)
class Refuse:
    """Tell the person who runs this member why bids are refused."""

    reason: str


Effect = CallForBids | CarryOut | Recall | StartTimer | StopTimer | Refuse
Step = tuple[AuctionState, list[Effect]]
