# SPDX-License-Identifier: BSD-3-Clause
"""The bids on every task, and in words why a task went to a robot or to none."""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

from blackboard.domain.bid import ranked
from fleet_manager.client import formats

if TYPE_CHECKING:
    from blackboard.auction.decision import Decision
    from blackboard.costing.bid_basis import Bids
    from blackboard.domain.bid import Bid
    from blackboard.domain.record import TaskRecord

HEADS = (
    *("Robot", "Cost (0 to 1000)", "Way", "Place", "Charge", "Charge left", "Done in"),
    *("Task alone", "Predicted by", "Why not"),
)
"""The heads of the columns of `bid_cells`."""


@dataclass
class _Auctions:
    """The auctions of one task: how many were seen, and the newest with its bids."""

    count: int = 0
    newest: tuple[int, int] = (-1, -1)
    bids: dict[str, Bid] = field(default_factory=dict)


class BidBook:
    """Keeps what the robots bid in the newest auction of every task."""

    def __init__(self) -> None:
        self._tasks: dict[str, _Auctions] = {}

    def bids(self, task_id: str) -> tuple[Bid, ...]:
        """Return the bids on a task, the one that goes first at the front."""
        known = self._tasks.get(task_id, _Auctions()).bids.values()
        return tuple(ranked(known))

    def auctions(self, task_id: str) -> int:
        """Return how many auctions of a task were seen."""
        return self._tasks.get(task_id, _Auctions()).count

    def add(self, answer: Bids | Decision) -> list[str]:
        """Take in a robot's bids, or all bids of a recorded decision; return the task ids."""
        auction = (answer.epoch, answer.auction)
        for bid in answer.bids:
            known = self._tasks.setdefault(bid.task_id, _Auctions())
            if auction > known.newest:
                self._tasks[bid.task_id] = known = _Auctions(known.count + 1, auction)
            if auction == known.newest:
                known.bids[bid.robot_id] = bid
        return [bid.task_id for bid in answer.bids]

    def forget(self, task_id: str) -> None:
        """Drop the bids on a task that has left the task list."""
        self._tasks.pop(task_id, None)


def bid_cells(bid: Bid, holder: str) -> tuple[str, ...]:
    """Return the cells of a bid's row; `holder` is the robot that has the task."""
    robot = f"{bid.robot_id} (has it)" if bid.robot_id == holder else bid.robot_id
    terms = bid.terms if bid.is_able else None
    return (
        robot,
        f"{bid.cost:.1f}",
        f"+{formats.length(terms.way)}" if terms else formats.UNKNOWN,
        str(terms.place) if terms else formats.UNKNOWN,
        formats.charge_used(bid.energy_cost) if bid.is_able else formats.UNKNOWN,
        formats.charge_used(terms.charge_left) if terms else formats.UNKNOWN,
        formats.duration(bid.eta) if bid.is_able else formats.UNKNOWN,
        task_alone(bid),
        predicted_by(bid),
        bid.reason,
    )


def task_alone(bid: Bid) -> str:
    """Return how long the task itself takes the robot, by its prediction."""
    return formats.duration(bid.duration) if _is_stated(bid) else formats.UNKNOWN


def predicted_by(bid: Bid) -> str:
    """Return what time and charge of the task itself were predicted by, in words.

    Where they were learned, that says what the formula would have predicted.
    """
    if not _is_stated(bid):
        return formats.UNKNOWN
    if not bid.learned_from:
        return "formula"
    drives = formats.counted(bid.learned_from, "drive")
    if not bid.formula_duration:
        return drives
    time, charge = bid.formula_duration, bid.formula_energy_cost
    return f"{drives}; formula: {formats.duration(time)}, {formats.charge_used(charge)}"


def _is_stated(bid: Bid) -> bool:
    """Return whether a bid says what the task itself takes; older ones and refusals do not."""
    return bid.is_able and bid.duration > 0.0


def story(record: TaskRecord, auctions: int) -> str:
    """Return how often a task was offered and tried; `auctions` is how many of it were seen.

    What would help a task that no robot can take is in its reason: only the leader knows of robots
    that have not bid.
    """
    lines = []
    if auctions:
        times = record.times_assigned
        lines.append(f"Auctions it was seen in: {auctions}. Times assigned: {times}.")
    if record.tried:
        tries = Counter(record.tried).items()
        names = (f"{robot} ({count}x)" if count > 1 else robot for robot, count in tries)
        lines.append(f"Tried without success by {', '.join(names)}.")
    return "\n".join(lines)
