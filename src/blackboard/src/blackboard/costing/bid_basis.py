# SPDX-License-Identifier: BSD-3-Clause
"""All that a robot's bids are worked out from, and the bids that come of it.

A robot that bids works its bids out from what it is and has. Where the fleet decides centrally it
tells that instead, and the blackboard makes the same bidder of it.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from blackboard.costing.aging import Aging
from blackboard.costing.bidding import Bidder
from blackboard.costing.cost import COST_MODELS
from blackboard.costing.effort import charge_to_reach
from blackboard.costing.pace import Pace
from blackboard.costing.schedule import Entry, Schedule
from blackboard.domain.battery import Battery
from blackboard.domain.record import Order

if TYPE_CHECKING:
    from collections.abc import Iterable

    from blackboard.costing.cost import Bids
    from blackboard.costing.path_lengths import PathLengths
    from blackboard.domain.characteristics import RobotCharacteristics
    from blackboard.domain.record import Broadcast
    from blackboard.domain.task import Task
    from hive_common.pose import Pose


@dataclass(frozen=True, slots=True)
class BidBasis:
    """What a robot is and has at one moment (message BidBasis).

    Attributes:
        body: What it is.
        cost_model: A name of `COST_MODELS`.
        aging: See `RobotSettings` [s].
        pose: Where it stands [map frame].
        charge: From 0 to 1.
        at_work: Whether the first task on its list is being done.
        refusal: Why it takes nothing now; empty where it is in service.
        tasks: Its list, each by its id with the first step that is still to be done.
        chargers: Where it can charge [map frame].
        pace: What it has learned of its drives, see `Pace.times`; empty where nothing.
    """

    body: RobotCharacteristics
    cost_model: str
    aging: float
    pose: Pose
    charge: float
    at_work: bool = False
    refusal: str = ""
    tasks: tuple[tuple[str, int], ...] = ()
    chargers: tuple[Pose, ...] = ()
    pace: tuple[float, ...] = ()


def bids_from(
    basis: BidBasis,
    robot_id: str,
    tasks: Iterable[Task],
    broadcast: Broadcast,
    path_lengths: PathLengths,
    now: float,
) -> Bids:
    """Return what a robot would bid.

    Args:
        basis: What it is and has.
        robot_id: Its name.
        tasks: Those of its list, in the same order.
        broadcast: What is offered.
        ways: Knows how far it is for a robot of its radius.
        now: The time on the clock of `Task.posted` [s].

    Raises:
        CharacteristicsError: Its charge or its pace is outside its range.
        KeyError: There is no such cost model.
    """
    battery = Battery(basis.body.battery, basis.charge)
    aging = Aging(lambda: now, basis.aging)
    pace = Pace(basis.body.max_speed, basis.pace)
    schedule = Schedule(basis.body, path_lengths, basis.cost_model, aging, pace)
    schedule.restore(
        Entry(Order(task, robot_id), step)
        for task, (_, step) in zip(tasks, basis.tasks, strict=True)
    )

    def reserve(end: Pose) -> float:
        return charge_to_reach(basis.chargers, end, basis.body, path_lengths, battery)

    model = COST_MODELS[basis.cost_model]
    bidder = Bidder(robot_id, basis.body, battery, schedule, model, reserve)
    return bidder.answer(broadcast, basis.pose, basis.refusal, at_work=basis.at_work)
