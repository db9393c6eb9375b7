# SPDX-License-Identifier: BSD-3-Clause
"""What planned tasks would cost each robot, as bids: the answer to "why?"."""

from __future__ import annotations

import math
from itertools import islice
from typing import TYPE_CHECKING

from blackboard.auction.search.offers import MOST
from blackboard.costing.bidding import no_path, refused
from blackboard.costing.cost import COST_MODELS
from blackboard.costing.effort import by_the_formula
from blackboard.costing.experience import Experience
from blackboard.domain.battery import Battery
from blackboard.domain.bid import MAX_COST, Bid, CostTerms, Exclusion
from blackboard.domain.task import step_to_go_on

if TYPE_CHECKING:
    from collections.abc import Mapping

    from blackboard.auction.search.searcher import Found
    from blackboard.auction.search.survey import Surveyed
    from blackboard.costing.bid_basis import BidBasis
    from blackboard.domain.task import Task

_LEAST_CHARGE = 1e-9  # cost models divide by what is left [Ah]
_MOST = math.nextafter(MAX_COST, 0.0)


class Explainer:
    """Tells what each task costs each robot, for the places that a plan leaves them.

    Costs are those of the robots' own cost models.
    """

    def __init__(self, surveyed: Surveyed, found: Found) -> None:
        self._surveyed = surveyed
        self._offers = found.offers
        # So many robots that take tasks are told for each task, and so many in all.
        self._told = found.offers.robot.shape[1]
        self._most = MOST // max(1, len(surveyed.records))
        bases = [surveyed.bases[name] for name in surveyed.robots]
        self._bodies = [basis.body for basis in bases]
        self._models = [COST_MODELS[basis.cost_model] for basis in bases]
        self._drives = [int(Experience(basis.body, basis.pace).learned.drives) for basis in bases]
        self._batteries = [Battery(basis.body.battery, basis.charge) for basis in bases]
        names = zip(surveyed.robots, found.plan, strict=True)
        self._takers = {task: name for name, row in names for task in row}

    def bids(self) -> Mapping[str, tuple[Bid, ...]]:
        """Return a bid of each robot on each task that another robot gets, by its id."""
        bids = {}
        for index, record in enumerate(self._surveyed.records):
            if record.robot == self._takers.get(index, record.robot):
                continue
            told = [self._bid(index, column) for column in range(self._told)]
            rest = max(0, self._most - len(told))
            told += [
                self._refusal_of_left_out(name, basis, record.task)
                for name, basis in islice(self._surveyed.left_out.items(), rest)
            ]
            bids[record.task.id] = tuple(sorted(told, key=lambda bid: bid.robot_id))
        return bids

    def _refusal_of_left_out(self, name: str, basis: BidBasis, task: Task) -> Bid:
        if basis.refusal:
            return refused(name, basis.body, task, basis.refusal, Exclusion.SERVICE)
        reason = "finds no path to what is on its list"
        return refused(name, basis.body, task, reason, Exclusion.WAY)

    def bid_of_taker(self, index: int) -> Bid:
        """Return the bid of the robot that gets a task, at the place that it gets."""
        return self._bid(index, 0)

    def _bid(self, index: int, column: int) -> Bid:
        surveyed, offers = self._surveyed, self._offers
        robot, place, before, after = (int(table[index, column]) for table in offers[:4])
        if place < 0:
            return self._refusal(index, robot)
        values = (float(table[index, column]) for table in offers[4:])
        eta, finish, waiting, drawn, draw, added_draw = values
        lengths, nothing = surveyed.lengths[robot], surveyed.problem.nothing
        start = before if before < nothing else before - 1
        way = float(lengths[start, index] + surveyed.own_lengths[robot][index])
        if after != nothing and math.isfinite(lengths[start, after]):
            way += float(lengths[index, after] - lengths[start, after])
        battery = self._batteries[robot]
        left = battery.charge_left - battery.charge_for(surveyed.ready[robot].energy + drawn)
        terms = CostTerms(
            energy_charge=battery.charge_for(draw),
            charge_left=max(left, _LEAST_CHARGE),
            place=surveyed.fixed[robot] + place + 1,
            way=way,
            eta=eta,
            finish=finish,
            waiting=waiting,
            added_charge=battery.charge_for(max(added_draw, 0.0)),
        )
        # What a plan gives to a robot is never too much for it, whatever its cost model says.
        cost = min(self._models[robot].cost(terms), _MOST)
        record, kind = surveyed.records[index], surveyed.problem.kind[robot]
        duration = surveyed.problem.leg[kind, before, index] + surveyed.problem.own[kind, index]
        formula, energy = by_the_formula(
            self._bodies[robot],
            record.task,
            step_to_go_on(record.task, record.step),
            float(lengths[start, index]),
            float(surveyed.own_lengths[robot][index]),
        )
        return Bid(
            surveyed.robots[robot],
            record.task.id,
            cost,
            terms.energy_charge,
            eta,
            terms=terms,
            learned_from=self._drives[robot],
            duration=float(duration),
            formula_duration=formula,
            formula_energy_cost=battery.charge_for(energy),
        )

    def _refusal(self, index: int, robot: int) -> Bid:
        """Return the bid of a robot on whose list a task cannot go."""
        surveyed, body = self._surveyed, self._bodies[robot]
        record, problem = surveyed.records[index], surveyed.problem
        start = surveyed.lengths[robot][problem.nothing + robot, index]
        if not math.isfinite(start + surveyed.own_lengths[robot][index]):
            reason, exclusion = no_path(body, surveyed.ready[robot].end), Exclusion.WAY
        elif not problem.able[robot, index]:
            reason, exclusion = "has tried it in vain", Exclusion.COST
        else:
            reason, exclusion = "has too little charge for it", Exclusion.CHARGE
        return refused(surveyed.robots[robot], body, record.task, reason, exclusion)
