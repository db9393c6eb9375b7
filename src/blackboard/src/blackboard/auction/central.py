# SPDX-License-Identifier: BSD-3-Clause
"""Works out the robots' bids at the blackboard, for fleets that decide centrally."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

from blackboard.auction.search.survey import Situation
from blackboard.costing.bidding import bids_from
from blackboard.costing.cost import COST_MODELS
from blackboard.costing.experience import Experience
from blackboard.domain.battery import Battery
from blackboard.domain.task import split_task
from blackboard.domain.validation import flaw_of
from blackboard.errors import BidRefusedError, CharacteristicsError

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping, Sequence

    from blackboard.costing.bid_basis import BidBasis, Bids
    from blackboard.domain.path_lengths import PathLengths
    from blackboard.domain.record import Broadcast, TaskRecord
    from blackboard.domain.task import Task


class Central:
    """Asks robots for the basis of their bids, and works the bids out.

    Args:
        path_lengths_for: Gives the path lengths for a robot of a radius [m].
        now: Gives the time on the clock of `Task.posted` [s].
        most_bids: Number of bids that robots that bid themselves are asked for at once.
    """

    def __init__(
        self,
        get: Callable[[str], TaskRecord | None],
        path_lengths_for: Callable[[float], PathLengths],
        now: Callable[[], float],
        most_bids: int,
    ) -> None:
        self._get = get
        self._path_lengths_for = path_lengths_for
        self._now = now
        self._most_bids = most_bids
        self._bidders: frozenset[str] = frozenset()  # robots that bid themselves

    def questions(
        self, broadcast: Broadcast, in_service: frozenset[str], known: frozenset[str]
    ) -> list[Broadcast]:
        """Return what robots are asked instead of for bids; they need not see the tasks.

        Those that have been found to bid themselves are asked for bids, until they are out of
        service. `known` are all robots.
        """
        self._bidders &= in_service
        question = replace(broadcast, tasks=(), basis=True)
        if not self._bidders:
            return [question]
        asked = broadcast.asked
        named = dict.fromkeys(sorted(known), "") if asked is None else asked
        bidders = {robot: given for robot, given in named.items() if robot in self._bidders}
        others = {robot: given for robot, given in named.items() if robot not in self._bidders}
        most = max(1, self._most_bids // max(1, len(bidders)))
        by_urgency = sorted(broadcast.tasks, key=lambda offer: -offer[0].priority)
        offer = replace(broadcast, tasks=tuple(by_urgency[:most]), asked=bidders)
        return [call for call in (offer, replace(question, asked=others)) if call.asked]

    def has_found_bidder(self, answer: Bids) -> bool:
        """Return whether an answer shows only now that its robot bids itself.

        It was asked for the basis of its bids and has told none, or one with a cost model that is
        not known here.
        """
        robot, basis = answer.robot_id, answer.basis
        bids_itself = basis is None or basis.cost_model not in COST_MODELS
        is_new = bids_itself and robot not in self._bidders
        if is_new:
            self._bidders |= {robot}
        return is_new

    def bids(self, answer: Bids, broadcast: Broadcast) -> Bids:
        """Return the bids of a robot; those of a robot that bids itself stay as they are.

        Raises:
            BidRefusedError: No bids can be worked out from the basis.
        """
        basis, robot = answer.basis, answer.robot_id
        if basis is None:
            return answer
        tasks = self.check(robot, basis)
        path_lengths = self._path_lengths_for(basis.body.radius)
        found = bids_from(basis, robot, tasks, broadcast, path_lengths, self._now())
        return replace(found, epoch=answer.epoch, auction=answer.auction, round=answer.round)

    def check(self, robot: str, basis: BidBasis) -> list[Task]:
        """Return the tasks of a robot's schedule.

        Raises:
            BidRefusedError: Nothing can be worked out from the basis.
        """
        if robot in self._bidders:
            raise BidRefusedError(f"{robot} tells a basis of bids; it was asked for bids")
        if flaw := _flaw(basis):
            raise BidRefusedError(f"{robot} cannot be bid for: {flaw}")
        return [self._listed(robot, task_id, step) for task_id, step in basis.tasks]

    def situation(self, bases: Mapping[str, BidBasis], records: Sequence[TaskRecord]) -> Situation:
        """Return what a plan is made of."""
        return Situation(bases, records, self._get, self._path_lengths_for, self._now())

    def _listed(self, robot: str, task_id: str, step: int) -> Task:
        record = self._get(task_id)
        if record is None:
            raise BidRefusedError(f"{robot} has {task_id[:64]!r} on its list: not a task")
        if step > len(split_task(record.task)):
            raise BidRefusedError(f"{robot} is at step {step} of {task_id}, which has fewer")
        return record.task


def _flaw(basis: BidBasis) -> str:
    if basis.cost_model not in COST_MODELS:
        return f"cost_model {basis.cost_model[:64]!r}; allowed: {', '.join(COST_MODELS)}"
    if not basis.aging > 0.0:
        return f"aging {basis.aging:g}; allowed: above 0 s"
    listed = [task_id for task_id, _ in basis.tasks]
    if len(set(listed)) < len(listed):
        return "a task is on its list twice; allowed: once"
    if flaw := flaw_of(basis, "BidBasis"):
        return flaw
    try:
        Battery(basis.body.battery, basis.charge)
        Experience(basis.body, basis.pace)
    except CharacteristicsError as error:
        return str(error)
    return ""
