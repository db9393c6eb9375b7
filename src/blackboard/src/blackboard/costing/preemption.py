# SPDX-License-Identifier: BSD-3-Clause
"""When a task of the highest priority may push aside what a robot is doing, and what that costs.

The auction decides whom an urgent task goes to, and the robot that gets it puts off what it is
doing: only the robot knows for certain whether something is on board by then.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from blackboard.domain.bid import MAX_COST, CostTerms
from blackboard.domain.task import MAX_PRIORITY, TaskType, load_during, step_to_resume

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable

    from blackboard.costing.effort import Effort
    from blackboard.costing.schedule import Entry
    from blackboard.domain.battery import Battery
    from blackboard.domain.bid import Bid
    from blackboard.domain.record import TaskRecord
    from blackboard.domain.task import Task
    from hive_common.pose import Pose


def may_put_off(current: Entry, urgent: Task) -> bool:
    """Return whether a robot may leave what it is doing for another task.

    Only for one of the highest priority, never one of that priority itself, and not with a load on
    board, nor when its arm is about to take one.
    """
    arrived = TaskType(current.task.type).picks and current.step > 0
    return (
        urgent.priority == MAX_PRIORITY > current.task.priority
        and not load_during(current.task, current.step)
        and not arrived
    )


def interruption(
    urgent: Task,
    step: int,
    current: Entry,
    here: Pose,
    predict: Callable[[Task, int, Pose], Effort],
    battery: Battery,
) -> CostTerms:
    """Return what it takes to do an urgent task at once and what is under way after it.

    That is the urgent task from here, and how much longer the rest of the other one becomes by
    beginning where the urgent one ends.

    Args:
        urgent: A task that `analyze_task` has passed.
        step: Its first step that is still to be done.
        current: What is under way.
        here: Where the robot stands.
        predict: What the rest of a task takes the robot, from its next step and a place on.
        battery: Turns energy into charge.
    """
    own = predict(urgent, step, here)
    later = predict(current.task, step_to_resume(current.task, current.step), own.end)
    now = predict(current.task, current.step, here)
    charge = battery.charge_for(max(0.0, own.energy + later.energy - now.energy))
    longer = max(0.0, own.duration + later.duration - now.duration)
    return CostTerms(
        energy_charge=charge,
        charge_left=battery.charge_left,
        place=1,
        way=max(0.0, own.way + later.way - now.way),
        eta=longer,
        finish=longer,
        waiting=longer,
        added_charge=charge,
    )


def best_bid(record: TaskRecord, able: Iterable[Bid]) -> Bid | None:
    """Return the bid that wins a task.

    Robots that have tried it in vain come last; otherwise the cheapest one wins. A task of the
    highest priority goes to a robot that can begin at once; where none can, to the one that costs
    least to interrupt; where none may be interrupted either, to whoever takes it next at least
    cost.

    Args:
        record: The task.
        able: The bids of robots that would take it.
    """
    bids = list(able)
    if record.task.priority == MAX_PRIORITY and bids:
        least = min(record.tried.count(bid.robot_id) for bid in bids)
        fresh = [bid for bid in bids if record.tried.count(bid.robot_id) == least]
        free = [bid for bid in fresh if not bid.under_way]
        interruptible = [bid for bid in fresh if bid.interrupt_cost < MAX_COST]
        if interruptible and not free:
            return min(interruptible, key=lambda bid: (bid.interrupt_cost, *_rank(bid)))
        bids = free or fresh
    return min(
        bids,
        key=lambda bid: (record.tried.count(bid.robot_id), *_rank(bid)),
        default=None,
    )


def _rank(bid: Bid) -> tuple[float, float, str]:
    return bid.cost, bid.eta, bid.robot_id
