# SPDX-License-Identifier: BSD-3-Clause
"""Why a task went to a robot, or to none, in words for a person."""

from __future__ import annotations

from collections import Counter
from typing import TYPE_CHECKING

from blackboard.auction.decision import what_would_help
from fleet_manager.desk import formats
from fleet_manager.desk.words import text

if TYPE_CHECKING:
    from collections.abc import Sequence

    from blackboard.domain.bid import Bid
    from blackboard.domain.record import TaskRecord

HEADS = (
    "bid.robot",
    "bid.cost",
    "bid.way",
    "bid.place",
    "bid.energy",
    "bid.left",
    "bid.eta",
    "bid.reason",
)
"""Of the columns of `bid_cells`."""


def bid_cells(bid: Bid, holder: str) -> tuple[str, ...]:
    """Return the cells of a bid's row; `holder` is the robot that has the task."""
    robot = text("bid.won", robot=bid.robot_id) if bid.robot_id == holder else bid.robot_id
    unknown = text("value.unknown")
    terms, able = bid.terms, bid.is_able
    return (
        robot,
        f"{bid.cost:.1f}",
        f"+{formats.length(terms.way)}" if terms and able else unknown,
        str(terms.place) if terms and able else unknown,
        formats.charge_used(bid.energy_cost) if able else unknown,
        formats.charge_used(terms.charge_left) if terms and able else unknown,
        formats.duration(bid.eta) if able else unknown,
        bid.reason,
    )


def story(record: TaskRecord, bids: Sequence[Bid], auctions: int) -> str:
    """Return what would help where nobody can take a task, and how often it was given out.

    Args:
        record: The task.
        bids: Of its last auction.
        auctions: In how many it has been seen.
    """
    lines = []
    able = any(bid.is_able for bid in bids)
    if bids and not able and (helps := what_would_help(record.task, bids)):
        lines.append(text("details.helps", what=helps))
    if auctions:
        lines.append(text("details.offered", auctions=auctions, times=record.times_assigned))
    if record.tried:
        tries = Counter(record.tried).items()
        names = ", ".join(f"{robot} ({count}x)" if count > 1 else robot for robot, count in tries)
        lines.append(text("details.tried", robots=names))
    return "\n".join(lines)
