# SPDX-License-Identifier: BSD-3-Clause
"""When a task of the highest priority may interrupt what a robot is doing, and what that costs.

The auction decides who gets an urgent task. The robot that gets it decides to put off what it is
doing, because only the robot knows for certain whether a load is on board by then.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from blackboard.domain.bid import MAX_COST, CostTerms
from blackboard.domain.task import MAX_PRIORITY, TaskType, load_during, step_to_resume

if TYPE_CHECKING:
    from collections.abc import Iterable

    from blackboard.costing.effort import Predictor
    from blackboard.costing.schedule import Entry
    from blackboard.domain.battery import Battery
    from blackboard.domain.bid import Bid
    from blackboard.domain.record import TaskRecord
    from blackboard.domain.task import Task
    from hive_common.pose import Pose


def may_put_off(current: Entry, urgent: Task) -> bool:
    """Return whether a robot may interrupt what it is doing for another task.

    Only a task of the highest priority interrupts, and only one of a lower priority; never with a
    load on board, nor when the arm is about to take one.
    """
    arrived = TaskType(current.task.type).picks and current.step > 0
    return (
        urgent.priority == MAX_PRIORITY > current.task.priority
        and not load_during(current.task, current.step)
        and not arrived
    )


def interruption(
    urgent: Task, step: int, current: Entry, here: Pose, predictor: Predictor, battery: Battery
) -> CostTerms:
    """Return what it takes to do an urgent task at once and resume the current one after it.

    That is the urgent task from here, and how much longer the rest of the other one becomes by
    beginning where the urgent one ends.
    """
    own = predictor.effort(urgent, step, here)
    resumed = step_to_resume(current.task, current.step)
    later = predictor.effort(current.task, resumed, own.end)
    now = predictor.effort(current.task, current.step, here)
    charge = battery.charge_for(max(0.0, own.energy + later.energy - now.energy))
    longer = max(0.0, own.duration + later.duration - now.duration)
    return CostTerms(
        energy_charge=charge,
        charge_left=battery.charge_left,
        place=1,
        way=max(0.0, own.distance + later.distance - now.distance),
        eta=longer,
        finish=longer,
        waiting=longer,
        added_charge=charge,
    )


def best_bid(record: TaskRecord, able: Iterable[Bid]) -> Bid | None:
    """Return the bid that wins a task; None if there is none.

    Robots that have tried it in vain come last; otherwise the cheapest bid wins. A task of the
    highest priority goes to a robot that can begin at once. If none can, it goes to the one that
    costs least to interrupt; if none may be interrupted, to the cheapest.
    """

    def rank(bid: Bid) -> tuple[int, float, float, str]:
        return record.tried.count(bid.robot_id), *bid.rank

    bids = list(able)
    if record.task.priority == MAX_PRIORITY and bids:
        least = min(rank(bid)[0] for bid in bids)
        fresh = [bid for bid in bids if rank(bid)[0] == least]
        free = [bid for bid in fresh if not bid.under_way]
        interruptible = [bid for bid in fresh if bid.interrupt_cost < MAX_COST]
        if interruptible and not free:
            return min(interruptible, key=lambda bid: (bid.interrupt_cost, *rank(bid)))
        bids = free or fresh
    return min(bids, key=rank, default=None)
