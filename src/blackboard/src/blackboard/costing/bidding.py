# SPDX-License-Identifier: BSD-3-Clause
"""What one robot bids when it is asked what a task would cost it."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from blackboard.costing.bid_basis import BidBasis, Bids
from blackboard.costing.cost import COST_MODELS
from blackboard.costing.effort import charge_to_reach
from blackboard.costing.experience import Experience
from blackboard.costing.insertion import Aging
from blackboard.costing.preemption import interruption, may_put_off
from blackboard.costing.schedule import Entry, Schedule
from blackboard.domain.battery import Battery
from blackboard.domain.bid import MAX_COST, Bid, CostTerms, Exclusion
from blackboard.domain.record import Order
from blackboard.domain.task import Task, TaskType

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable

    from blackboard.costing.cost import CostModel
    from blackboard.costing.insertion import Route
    from blackboard.domain.characteristics import RobotCharacteristics
    from blackboard.domain.path_lengths import PathLengths
    from blackboard.domain.record import Broadcast
    from hive_common.pose import Pose


CHARGE_TOLERANCE = 0.10
"""The share of its charge that a robot keeps (the report's 10 %)."""


class Bidder:
    """Computes a robot's bids; `reserve` is what it takes to reach a charger from a pose [Ah]."""

    def __init__(
        self,
        robot_id: str,
        characteristics: RobotCharacteristics,
        battery: Battery,
        schedule: Schedule,
        model: CostModel,
        reserve: Callable[[Pose], float] = lambda _: 0.0,
    ) -> None:
        self._robot_id = robot_id
        self._characteristics = characteristics
        self._battery = battery
        self._schedule = schedule
        self._model = model
        self._reserve = reserve

    def answer(self, broadcast: Broadcast, here: Pose, refusal: str, *, at_work: bool) -> Bids:
        """Return the bids on everything that was broadcast.

        Tasks on its own schedule are offered to others: it bids for the schedule without them. A
        `refusal` says why it takes nothing now; `at_work`, that its first task is under way.
        """
        offered = {task.id for task, _ in broadcast.tasks}
        first = self._schedule.first() if at_work else None
        kept = {first.task.id} if first is not None else set()
        route = self._schedule.route(here, at_work=at_work, without=offered - kept)
        bids = []
        for task, step in broadcast.tasks:
            if refusal:
                bid = self._refuse(task, refusal, Exclusion.SERVICE)
            elif task.id in kept:
                bid = self._refuse(task, "has begun it already", Exclusion.COST)
            else:
                bid = self._bid(task, step, here, route, at_work=at_work)
            bids.append(bid)
        return Bids(
            self._robot_id, broadcast.epoch, broadcast.auction, tuple(bids), broadcast.round
        )

    def bid(self, task: Task, step: int, here: Pose, *, at_work: bool) -> Bid:
        """Return the bid on a task, from a step on, at its best position in the schedule."""
        route = self._schedule.route(here, at_work=at_work)
        return self._bid(task, step, here, route, at_work=at_work)

    def _refuse(self, task: Task, reason: str = "", exclusion: Exclusion = Exclusion.NONE) -> Bid:
        return refused(self._robot_id, self._characteristics, task, reason, exclusion)

    def _bid(self, task: Task, step: int, here: Pose, route: Route, *, at_work: bool) -> Bid:
        if self._characteristics.excludes(task):
            return self._refuse(task)
        best = route.best_insertion(task, step)
        if not math.isfinite(best.before.distance + best.effort.distance):
            reason = no_path(self._characteristics, best.before.end)
            return self._refuse(task, reason, Exclusion.WAY)
        charge_left = self._battery.charge_left - self._battery.charge_for(best.before.energy)
        charge = self._battery.charge_for(best.effort.energy)
        reserve = self._reserve(best.effort.end)
        all_energy = best.before.energy + best.effort.energy
        most = self._battery.charge_for(self._schedule.experience.most_energy(all_energy))
        share = (self._battery.charge_left - most - reserve) / self._battery.capacity
        if share < CHARGE_TOLERANCE:
            drive = " on the way to a charger" if reserve else ""
            reason = (
                f"its charge could fall to {share:.0%}{drive}; it keeps {CHARGE_TOLERANCE:.0%}"
            )
            return self._refuse(task, reason, Exclusion.CHARGE)
        terms = CostTerms(
            energy_charge=charge,
            charge_left=charge_left,
            place=best.position + 1,
            way=best.added_distance,
            eta=best.before.duration + best.effort.duration,
            finish=best.finish,
            waiting=best.added_waiting,
            added_charge=self._battery.charge_for(best.added_energy),
        )
        cost = self._model.cost(terms)
        if cost >= MAX_COST:
            reason = f"its cost of {cost:.0f} is not below {MAX_COST:.0f}"
            return self._refuse(task, reason, Exclusion.COST)
        under_way = self._schedule.first() if at_work else None
        formula = self._schedule.formula.effort(task, step, best.before.end)
        return Bid(
            self._robot_id,
            task.id,
            cost,
            charge,
            terms.eta,
            under_way=under_way.task.id if under_way else "",
            interrupt_cost=self._interrupt_cost(task, step, here, under_way),
            most_payload=self._characteristics.most_payload(TaskType(task.type)),
            terms=terms,
            learned_from=int(self._schedule.experience.learned.drives),
            duration=best.effort.duration,
            formula_duration=formula.duration,
            formula_energy_cost=self._battery.charge_for(formula.energy),
        )

    def _interrupt_cost(self, task: Task, step: int, here: Pose, under_way: Entry | None) -> float:
        if under_way is None or not may_put_off(under_way, task):
            return MAX_COST
        predictor = self._schedule.predictor
        terms = interruption(task, step, under_way, here, predictor, self._battery)
        most = self._schedule.experience.most_energy(terms.energy_charge)
        share = (terms.charge_left - most) / self._battery.capacity
        return min(self._model.cost(terms), MAX_COST) if share >= CHARGE_TOLERANCE else MAX_COST


def refused(
    robot_id: str,
    body: RobotCharacteristics,
    task: Task,
    reason: str = "",
    exclusion: Exclusion = Exclusion.NONE,
) -> Bid:
    """Return the bid of a robot that does not take a task.

    Whatever else keeps it from the task now, one that can never do it says so: to put it back in
    service would not help.
    """
    most = body.most_payload(TaskType(task.type))
    if never := body.excludes(task):
        can_do = TaskType(task.type) in body.capabilities
        reason, exclusion = never, Exclusion.PAYLOAD if can_do else Exclusion.TYPE
    return Bid(
        robot_id,
        task.id,
        MAX_COST,
        reason=reason,
        most_payload=most,
        exclusion=exclusion.value,
    )


def no_path(body: RobotCharacteristics, start: Pose) -> str:
    """Return in words that a robot of this model finds no path from a pose."""
    return f"finds no path there from {start} for its radius of {body.radius:.2f} m"


def bids_from(
    basis: BidBasis,
    robot_id: str,
    tasks: Iterable[Task],
    broadcast: Broadcast,
    path_lengths: PathLengths,
    now: float,
) -> Bids:
    """Return what a robot would bid.

    `tasks` are those of its schedule, in the order of the basis; `path_lengths` are for a robot of
    its radius; `now` is the time on the clock of `Task.posted` [s].

    Raises:
        CharacteristicsError: Its charge or its pace is outside its range.
        KeyError: There is no such cost model.
    """
    battery = Battery(basis.body.battery, basis.charge)
    aging = Aging(lambda: now, basis.aging)
    experience = Experience(basis.body, basis.pace)
    schedule = Schedule(basis.body, path_lengths, basis.cost_model, aging, experience)
    schedule.restore(
        Entry(Order(task, robot_id), step)
        for task, (_, step) in zip(tasks, basis.tasks, strict=True)
    )

    def reserve(end: Pose) -> float:
        return charge_to_reach(basis.chargers, end, basis.body, path_lengths, battery, experience)

    model = COST_MODELS[basis.cost_model]
    bidder = Bidder(robot_id, basis.body, battery, schedule, model, reserve)
    return bidder.answer(broadcast, basis.pose, basis.refusal, at_work=basis.at_work)
