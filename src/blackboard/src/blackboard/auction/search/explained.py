# SPDX-License-Identifier: BSD-3-Clause
"""What planned tasks would cost each robot, as bids: the answer to "why?"."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from blackboard.costing.bidding import exclusion_of, no_path, refused
from blackboard.costing.cost import COST_MODELS
from blackboard.domain.battery import Battery
from blackboard.domain.bid import MAX_COST, Bid, CostTerms, Exclusion

if TYPE_CHECKING:
    from collections.abc import Mapping

    from blackboard.auction.search.offers import Offers
    from blackboard.auction.search.searcher import Found
    from blackboard.auction.search.survey import Surveyed

_LEAST_CHARGE = 1e-9  # cost models divide by what is left [Ah]


def explained(surveyed: Surveyed, found: Found) -> Mapping[str, tuple[Bid, ...]]:
    """Return a bid of each robot on each task that another robot gets, by the id of the task.

    Costs are those of the robots' own cost models, for the places that the plan leaves them.
    """
    batteries = [
        Battery(basis.body.battery, basis.charge)
        for basis in (surveyed.bases[name] for name in surveyed.robots)
    ]
    taker = {
        task: name for name, row in zip(surveyed.robots, found.plan, strict=True) for task in row
    }
    bids = {}
    for index, record in enumerate(surveyed.records):
        if record.robot == taker.get(index, record.robot):
            continue
        told = [
            _bid(surveyed, found.offers, index, column, batteries)
            for column in range(found.offers.robot.shape[1])
        ]
        told += [
            refused(name, basis.body, record.task, basis.refusal, Exclusion.SERVICE)
            for name, basis in surveyed.left_out.items()
        ]
        bids[record.task.id] = tuple(sorted(told, key=lambda bid: bid.robot_id))
    return bids


def _bid(
    surveyed: Surveyed, offers: Offers, index: int, column: int, batteries: list[Battery]
) -> Bid:
    robot, place, before, after = (int(table[index, column]) for table in offers[:4])
    if place < 0:
        return _refusal(surveyed, index, robot)
    values = (float(table[index, column]) for table in offers[4:])
    eta, finish, waiting, drawn, draw, added_draw = values
    lengths, nothing = surveyed.lengths[robot], surveyed.problem.nothing
    start = before if before < nothing else before - 1
    way = lengths[start, index] + surveyed.own_lengths[robot][index]
    if after != nothing:
        way += lengths[index, after] - lengths[start, after]
    battery, ready = batteries[robot], surveyed.ready[robot]
    left = battery.charge_left - battery.charge_for(ready.energy + drawn)
    terms = CostTerms(
        energy_charge=battery.charge_for(draw),
        charge_left=max(left, _LEAST_CHARGE),
        place=surveyed.fixed[robot] + place + 1,
        way=float(way),
        eta=eta,
        finish=finish,
        waiting=waiting,
        added_charge=battery.charge_for(max(added_draw, 0.0)),
    )
    name = surveyed.robots[robot]
    cost = COST_MODELS[surveyed.bases[name].cost_model].cost(terms)
    task_id = surveyed.records[index].task.id
    # A robot that takes the task by the plan has said nothing against it.
    cost = min(cost, math.nextafter(MAX_COST, 0.0))
    return Bid(name, task_id, cost, terms.energy_charge, eta, terms=terms)


def _refusal(surveyed: Surveyed, index: int, robot: int) -> Bid:
    """Return the bid of a robot on whose list a task cannot go."""
    name, record = surveyed.robots[robot], surveyed.records[index]
    body, tables = surveyed.bases[name].body, surveyed.problem
    start = surveyed.lengths[robot][tables.nothing + robot, index]
    if reason := body.excludes(record.task):
        exclusion = exclusion_of(body, record.task)
    elif not math.isfinite(start + surveyed.own_lengths[robot][index]):
        reason, exclusion = no_path(body, surveyed.ready[robot].end), Exclusion.WAY
    elif not tables.able[robot, index]:
        reason, exclusion = "has tried it in vain", Exclusion.COST
    else:
        reason, exclusion = "has too little charge for it", Exclusion.CHARGE
    return refused(name, body, record.task, reason, exclusion)
