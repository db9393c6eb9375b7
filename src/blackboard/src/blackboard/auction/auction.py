# SPDX-License-Identifier: BSD-3-Clause
"""One auction of all waiting tasks: who was asked, who answered, and who wins which task.

This is a sequential single-item auction in rounds. Robots bid for the best place in their own
schedule. Each round awards the best pairs of robot and task, at most one task to each robot; then
only the winners bid again, because the schedules of all others, and so their bids, are unchanged.
A task whose best robot has just won another one waits for that robot's next bid. Tasks that few
robots can do are awarded before tasks that many can do, so that strong robots stay free for heavy
tasks.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field, replace
from operator import attrgetter
from typing import TYPE_CHECKING

from blackboard.costing.preemption import best_bid
from blackboard.domain.bid import MAX_COST
from blackboard.domain.validation import flaw_of

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping

    from blackboard.costing.bid_basis import BidBasis, Bids
    from blackboard.domain.bid import Bid
    from blackboard.domain.record import TaskRecord


@dataclass(frozen=True, slots=True)
class Result:
    """What a round decides."""

    # The winning bids, at most one of each robot unless tasks are transferred.
    awards: tuple[Bid, ...]
    impossible: tuple[tuple[str, str], ...]  # tasks that no robot can take, each with the reason
    # All bids on these tasks, by task id.
    bids: Mapping[str, tuple[Bid, ...]] = field(default_factory=dict)
    silent: frozenset[str] = frozenset()  # robots that did not answer in time
    # Epoch, number of the auction, and round; zeros if none was held.
    auction: tuple[int, int, int] = (0, 0, 0)
    reason: str = ""  # why robots get their tasks, if not for the lowest bid
    # Where tasks go in their robots' lists, by task id; 1 is first. The robot decides for others.
    places: Mapping[str, int] = field(default_factory=dict)


@dataclass(frozen=True, slots=True)
class Auction:
    """One auction, from its first call for bids until nothing more can be awarded."""

    epoch: int  # of the blackboard that asks
    number: int  # of the auction within the epoch
    improves: bool = False  # whether it is about tasks that robots already have
    round: int = 0  # from 1 on; 0 before the first
    is_open: bool = False  # whether the round still waits for bids
    # Everything offered in this round, by the id of the task.
    offered: Mapping[str, TaskRecord] = field(default_factory=dict)
    # Tasks that were offered in this round and cannot be won any more.
    withdrawn: frozenset[str] = frozenset()
    is_selective: bool = False  # whether some robots in service were not asked in this round
    missing: frozenset[str] = frozenset()  # robots that have not answered yet
    # Robots that have answered, even if the answer was refused.
    answered: frozenset[str] = frozenset()
    # Valid bids by robot and task id.
    bids: Mapping[str, Mapping[str, Bid]] = field(default_factory=dict)
    # The round in which a robot was last asked by name.
    asked_in: Mapping[str, int] = field(default_factory=dict)
    all_asked_in: int = 0  # the round in which all robots were last asked
    outdated: frozenset[str] = frozenset()  # robots whose situation has improved since they bid
    # Whether robots were asked what they bid from, because a plan is to be made of it.
    is_for_plan: bool = False
    # What they told, by robot.
    bases: Mapping[str, BidBasis] = field(default_factory=dict)

    def next_round(
        self, offers: Iterable[TaskRecord], asked: frozenset[str], in_service: frozenset[str]
    ) -> Auction:
        """Return the auction at the beginning of its next round.

        Bids of the last round hold, unless the robot's schedule or situation has changed or a
        task is new; `missing` tells who has to bid. Bids of robots that are not `asked` are
        forgotten.
        """
        offered = {record.task.id: record for record in offers}
        is_new = not offered.keys() <= self.offered.keys()
        number = self.round + 1
        hold = frozenset() if is_new else asked - self.outdated
        bids = {robot: each for robot, each in self.bids.items() if robot in hold}
        missing = asked - bids.keys()
        return replace(
            self,
            round=number,
            is_open=True,
            offered=offered,
            withdrawn=frozenset(),
            is_selective=asked != in_service,
            missing=missing,
            answered=self.answered - missing,
            bids=bids,
            asked_in=({} if is_new else dict(self.asked_in)) | dict.fromkeys(missing, number),
            all_asked_in=number if is_new else self.all_asked_in,
            outdated=frozenset(),
            is_for_plan=False,
        )

    @property
    def is_new(self) -> bool:
        """Whether everybody has to bid in this round, because a task is new."""
        return self.round == self.all_asked_in

    def excuse(self, robots: frozenset[str]) -> Auction:
        """Stop waiting for some robots, unless nobody else bids."""
        rest = self.missing - robots
        return replace(self, missing=rest) if rest or self.bids else self

    def close(self, in_service: frozenset[str]) -> Auction:
        """End the round: robots out of service win nothing, but their refusals still count."""
        bids = {
            robot: each
            if robot in in_service
            else {task: bid for task, bid in each.items() if not bid.is_able}
            for robot, each in self.bids.items()
        }
        # Of a robot out of service that says nothing of a task there is nothing to tell.
        counted = in_service.union(robot for robot, each in bids.items() if each)
        return replace(
            self,
            is_open=False,
            bids=bids,
            missing=self.missing & in_service,
            answered=self.answered & counted,
        )

    def hear(self, answer: Bids, in_service: frozenset[str] | None = None) -> tuple[Auction, str]:
        """Take in a robot's bids; repeating the same answer changes nothing.

        A robot whose bids are invalid is not waited for any longer: it would repeat them. Returns
        the auction, and why the answer is refused; empty if it is not. All robots may take a task
        if `in_service` is None.
        """
        robot = answer.robot_id
        bids = {bid.task_id: bid for bid in answer.bids}
        if refusal := self._why_unexpected(answer, bids, in_service):
            return self, refusal
        missing, answered = self.missing - {robot}, self.answered | {robot}
        flaw = next(filter(None, map(self._flaw, answer.bids)), "")
        if len(bids) < len(answer.bids):
            flaw = f"{robot} bids twice on one task; allowed: one bid on each"
        valid = self.bids if flaw else {**self.bids, robot: bids}
        return replace(self, missing=missing, answered=answered, bids=valid), flaw

    def for_plan(
        self, offers: Iterable[TaskRecord], asked: frozenset[str], in_service: frozenset[str]
    ) -> Auction:
        """Return the auction at the beginning of a round in which everybody tells their basis."""
        begun = replace(self, bids={}, offered={}).next_round(offers, asked, in_service)
        return replace(begun, is_for_plan=True, bases={}, all_asked_in=begun.round)

    def hear_basis(
        self, answer: Bids, in_service: frozenset[str] | None = None
    ) -> tuple[Auction, str]:
        """Take in what a robot tells, or the bids of one that bids itself; see `hear`."""
        robot = answer.robot_id
        if answer.basis is None:
            return self.hear(answer, in_service)
        if refusal := self._why_unexpected(answer, {}, None):
            return self, refusal
        missing, answered = self.missing - {robot}, self.answered | {robot}
        bases = {**self.bases, robot: answer.basis}
        return replace(self, missing=missing, answered=answered, bases=bases), ""

    def _why_unexpected(
        self, answer: Bids, bids: Mapping[str, Bid], in_service: frozenset[str] | None
    ) -> str:
        robot = answer.robot_id
        asked = (self.epoch, self.number, self.asked_in.get(robot, self.all_asked_in))
        if (answer.epoch, answer.auction, answer.round) != asked:
            return (
                f"{robot} answers auction {answer.epoch}/{answer.auction}/{answer.round}, "
                f"it was asked in {'/'.join(map(str, asked))}"
            )
        if not robot:
            return "bids without a robot's name; robot_id says who bids"
        offers = any(bid.is_able for bid in answer.bids)
        if offers and in_service is not None and robot not in in_service:
            return f"{robot[:64]!r} bids and is not in service"
        if self.bids.get(robot, bids) != bids:
            return f"{robot} answers twice; allowed: one answer in a round"
        return ""

    def _flaw(self, bid: Bid) -> str:
        if bid.task_id not in self.offered:
            return f"{bid.robot_id} bids on {bid.task_id[:64]!r}: not offered"
        if not 0.0 <= bid.cost <= MAX_COST:
            return (
                f"{bid.robot_id} bids {bid.cost:g} on {bid.task_id}; "
                f"allowed: from 0 to {MAX_COST:.0f}"
            )
        if bid.is_able and not 0.0 <= bid.eta < math.inf:
            return (
                f"{bid.robot_id} would have {bid.task_id} done in {bid.eta:g} s; "
                "allowed: at least 0 s"
            )
        flaw = flaw_of(bid, "Bid")
        return f"{bid.robot_id} bids on {bid.task_id}: {flaw}" * bool(flaw)

    def withdraw(self, task_ids: frozenset[str]) -> Auction:
        """Award some tasks no more; bids on them are still valid, and change nothing."""
        return replace(self, withdrawn=self.withdrawn | task_ids)

    def forget(self, robot_id: str) -> Auction:
        """Drop a robot's bids and ask it again in the next round: its schedule has changed."""
        if robot_id not in self.bids:
            return self
        bids = {robot: each for robot, each in self.bids.items() if robot != robot_id}
        return replace(self, bids=bids, asked_in={**self.asked_in, robot_id: self.round + 1})

    def outdate(self, robot_id: str) -> Auction:
        """Ask a robot again in the next round; its bids in this one hold until then."""
        return replace(self, outdated=self.outdated | {robot_id})

    def offers(self) -> list[tuple[TaskRecord, list[Bid]]]:
        """Return what is still offered, with the bids on it."""
        return [
            (record, self._on(task_id))
            for task_id, record in self.offered.items()
            if task_id not in self.withdrawn
        ]

    def result(self) -> Result:
        """Decide by the bids so far."""
        best = {}
        impossible = []
        for record, bids in self.offers():
            winner = best_bid(record, filter(attrgetter("is_able"), bids))
            if winner is None:
                impossible.append((record.task.id, self._refusals(bids)))
            else:
                best[record.task.id] = winner
        awards: dict[str, Bid] = {}
        for bid in sorted(best.values(), key=self._rank):
            awards.setdefault(bid.robot_id, bid)
        decided = [bid.task_id for bid in awards.values()] + [task_id for task_id, _ in impossible]
        by_task = {task_id: tuple(self._on(task_id)) for task_id in decided}
        number = (self.epoch, self.number, self.round)
        return Result(tuple(awards.values()), tuple(impossible), by_task, self.missing, number)

    def _rank(self, bid: Bid) -> tuple[int, int, float]:
        """Return the order of awards: urgent tasks, then those few robots can do, then by cost."""
        able = sum(other.is_able for other in self._on(bid.task_id))
        return -self.offered[bid.task_id].task.priority, able, bid.cost

    def _refusals(self, bids: Iterable[Bid]) -> str:
        given = {bid.robot_id: bid.reason for bid in bids}
        reasons = [
            f"{robot}: {given.get(robot) or 'has made no valid bid'}"
            for robot in sorted(self.answered)
        ]
        reasons += [f"{robot}: has not answered" for robot in sorted(self.missing)]
        return "nobody can take it now: " + "; ".join(reasons)

    def _on(self, task_id: str) -> list[Bid]:
        return [bids[task_id] for _, bids in sorted(self.bids.items()) if task_id in bids]
