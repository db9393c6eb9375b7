# SPDX-License-Identifier: BSD-3-Clause
"""One auction of all that waits: who was asked for what, who answered, and who gets which task.

A sequential single-item auction with bids for the best place in the robot's list. It goes in
rounds. In each, the best pairs of robot and task are given out, one to each robot; then only those
who have won bid again, because the lists of all others, and so their bids, are as they were. A
task whose best robot has just won another waits for that robot's next bid. Tasks that few robots
can do are given out before those that many can, so that strong robots are left for heavy tasks.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from operator import attrgetter
from typing import TYPE_CHECKING

from blackboard.costing.preemption import best_bid
from blackboard.domain.bid import MAX_COST
from blackboard.errors import BidRefusedError

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping

    from blackboard.costing.bid_basis import Bids
    from blackboard.domain.bid import Bid
    from blackboard.domain.record import TaskRecord


@dataclass(frozen=True, slots=True)
class Result:
    """What a round has decided.

    Attributes:
        awards: The winning bids, no two of one robot.
        impossible: Tasks that nobody can take, each with the reason.
        bids: What was bid on all of these, by their ids.
        silent: The robots that were waited for in vain.
        auction: Epoch, number of the auction, and round; zeros where none was held.
        reason: Why robots get what they get, where it is not the lowest bid.
    """

    awards: tuple[Bid, ...]
    impossible: tuple[tuple[str, str], ...]
    bids: Mapping[str, tuple[Bid, ...]] = field(default_factory=dict)
    silent: frozenset[str] = frozenset()
    auction: tuple[int, int, int] = (0, 0, 0)
    reason: str = ""


class Auction:
    """One auction, from its first broadcast until nothing more can be given out.

    Args:
        epoch: Of the blackboard that asks.
        number: Of the auction within the epoch.

    Attributes:
        offered: Ids of what is offered in this round.
    """

    def __init__(self, epoch: int, number: int) -> None:
        self.epoch = epoch
        self.number = number
        self.round = 0
        self._records: dict[str, TaskRecord] = {}
        self._sizes: Mapping[str, int] = {}
        self.offered: frozenset[str] = frozenset()
        self._missing: set[str] = set()
        self._bids: dict[str, dict[str, Bid]] = {}
        self._answered: set[str] = set()
        self._asked_in: dict[str, int] = {}
        self._all_asked_in = 0
        self._outdated: set[str] = set()

    @property
    def missing(self) -> frozenset[str]:
        """The robots that have not answered yet."""
        return frozenset(self._missing)

    @property
    def is_outdated(self) -> bool:
        """Whether a robot might bid better by now than it has bid."""
        return bool(self._outdated)

    def ask(
        self,
        records: Iterable[TaskRecord],
        robots: frozenset[str],
        sizes: Mapping[str, int] | None = None,
    ) -> frozenset[str] | None:
        """Begin the next round.

        Args:
            records: The tasks that are offered.
            robots: Those whose bids count; what others have bid is forgotten.
            sizes: How many tasks are offered as one, by the first of them; one, where it is left
                out.

        Returns:
            Who has to bid; None where everybody has to, because of a task that is new.
        """
        self._records = {record.task.id: record for record in records}
        self._sizes = sizes or {}
        is_new = not self._records.keys() <= self.offered
        self.offered = frozenset(self._records)
        self.round += 1
        hold = robots - self._outdated
        self._bids = {robot: bids for robot, bids in self._bids.items() if robot in hold}
        self._outdated.clear()
        if is_new:
            self._bids.clear()
            self._asked_in.clear()
            self._all_asked_in = self.round
        asked = robots - self._bids.keys()
        self._asked_in |= dict.fromkeys(asked, self.round)
        self._answered -= asked
        self._missing = set(asked)
        return None if is_new else asked

    def excuse(self, robots: frozenset[str]) -> None:
        """Wait for these no longer, unless nobody else bids."""
        if self._missing - robots or self._bids:
            self._missing -= robots

    def exclude_others(self, robots: frozenset[str]) -> None:
        """Let no others win: they are not in service any more. What they refused still counts."""
        for robot in self._bids.keys() - robots:
            bids = self._bids[robot].items()
            self._bids[robot] = {task: bid for task, bid in bids if not bid.is_able}
        self._missing &= robots

    def take(self, answer: Bids, in_service: frozenset[str] | None = None) -> None:
        """Take in a robot's bids; the same answer again changes nothing.

        A robot whose answer is refused is not waited for any longer: it would send the same again.

        Args:
            answer: What it bids.
            in_service: The robots that may take a task; all, where it is left out.

        Raises:
            BidRefusedError: It answers another auction or an earlier round, it has answered, it is
                not in service, or one of its bids is no cost.
        """
        robot = answer.robot_id
        asked = (self.epoch, self.number, self._asked_in.get(robot, self._all_asked_in))
        if (answer.epoch, answer.auction, answer.round) != asked:
            raise BidRefusedError(
                f"{robot} answers auction {answer.epoch}/{answer.auction}/{answer.round}, "
                f"it was asked in {'/'.join(map(str, asked))}"
            )
        if not robot:
            raise BidRefusedError("bids without a robot's name; robot_id says who bids")
        bids = {bid.task_id: bid for bid in answer.bids}
        offers = any(bid.is_able for bid in answer.bids)
        if offers and in_service is not None and robot not in in_service:
            raise BidRefusedError(f"{robot[:64]!r} bids and is not in service")
        if self._bids.get(robot, bids) != bids:
            raise BidRefusedError(f"{robot} answers twice; allowed: one answer in a round")
        self._missing.discard(robot)
        self._answered.add(robot)
        if len(bids) < len(answer.bids):
            raise BidRefusedError(f"{robot} bids twice on one task; allowed: one bid on each")
        for bid in answer.bids:
            self._check(bid)
        self._bids[robot] = bids

    def _check(self, bid: Bid) -> None:
        if bid.task_id not in self.offered:
            raise BidRefusedError(f"{bid.robot_id} bids on {bid.task_id[:64]!r}: not offered")
        if bid.size != self._sizes.get(bid.task_id, 1):
            raise BidRefusedError(
                f"{bid.robot_id} bids on {bid.size} tasks from {bid.task_id} on; "
                f"offered as one are {self._sizes.get(bid.task_id, 1)}"
            )
        if not 0.0 <= bid.cost <= MAX_COST:
            raise BidRefusedError(
                f"{bid.robot_id} bids {bid.cost:g} on {bid.task_id}; "
                f"allowed: from 0 to {MAX_COST:.0f}"
            )
        if bid.is_able and not 0.0 <= bid.eta < math.inf:
            raise BidRefusedError(
                f"{bid.robot_id} would have {bid.task_id} done in {bid.eta:g} s; "
                "allowed: at least 0 s"
            )

    def withdraw(self, task_id: str) -> None:
        """Offer a task no more; bids on it are still heard, and change nothing."""
        self._records.pop(task_id, None)

    def forget(self, robot_id: str) -> None:
        """Have a robot bid again in the next round: its list has changed."""
        if self._bids.pop(robot_id, None) is not None:
            self._asked_in[robot_id] = self.round + 1

    def outdate(self, robot_id: str) -> None:
        """Have a robot bid again in the next round; what it bids in this one holds until then."""
        self._outdated.add(robot_id)

    def offers(self) -> list[tuple[TaskRecord, list[Bid]]]:
        """Return what is still offered, with what was bid on it."""
        return [(record, self._of(task_id)) for task_id, record in self._records.items()]

    def result(self) -> Result:
        """Decide on what has been bid so far."""
        best = {}
        impossible = []
        for record in self._records.values():
            bid = best_bid(record, filter(attrgetter("is_able"), self._of(record.task.id)))
            if bid is None:
                impossible.append((record.task.id, self._refusals(record.task.id)))
            else:
                best[record.task.id] = bid
        awards: dict[str, Bid] = {}
        for bid in sorted(best.values(), key=self._rank):
            awards.setdefault(bid.robot_id, bid)
        decided = [bid.task_id for bid in awards.values()] + [task_id for task_id, _ in impossible]
        bids = {task_id: tuple(self._of(task_id)) for task_id in decided}
        number = (self.epoch, self.number, self.round)
        return Result(tuple(awards.values()), tuple(impossible), bids, self.missing, number)

    def _rank(self, bid: Bid) -> tuple[int, int, float]:
        """Return what comes first: what is urgent, what few can do, and then the best pair."""
        able = sum(other.is_able for other in self._of(bid.task_id))
        return -self._records[bid.task_id].task.priority, able, bid.cost

    def _refusals(self, task_id: str) -> str:
        given = {bid.robot_id: bid.reason for bid in self._of(task_id)}
        reasons = [
            f"{robot}: {given.get(robot) or 'has made no valid bid'}"
            for robot in sorted(self._answered)
        ]
        reasons += [f"{robot}: has not answered" for robot in sorted(self._missing)]
        return "nobody can take it now: " + "; ".join(reasons)

    def _of(self, task_id: str) -> list[Bid]:
        return [bids[task_id] for robot, bids in sorted(self._bids.items()) if task_id in bids]
