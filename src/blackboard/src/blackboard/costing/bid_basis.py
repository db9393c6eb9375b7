# SPDX-License-Identifier: BSD-3-Clause
"""All that a robot's bids are worked out from, and the bids that come of it.

A robot that bids works its bids out from what it is and has. Where the fleet decides centrally it
tells that instead, and the blackboard makes the same bidder of it.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from blackboard.aging import Aging
from blackboard.battery import Battery
from blackboard.bidding import Bidder
from blackboard.cost import COST_MODELS
from blackboard.effort import charge_to_reach
from blackboard.itinerary import Entry, Itinerary
from blackboard.pace import Pace
from blackboard.record import Order

if TYPE_CHECKING:
    from collections.abc import Iterable

    from blackboard.characteristics import RobotCharacteristics
    from blackboard.cost import Bids
    from blackboard.pose import Pose
    from blackboard.record import Broadcast
    from blackboard.task import Task
    from blackboard.ways import Ways


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
    ways: Ways,
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
    itinerary = Itinerary(basis.body, ways, basis.cost_model, aging, pace)
    itinerary.restore(
        Entry(Order(task, robot_id), step)
        for task, (_, step) in zip(tasks, basis.tasks, strict=True)
    )

    def reserve(end: Pose) -> float:
        return charge_to_reach(basis.chargers, end, basis.body, ways, battery)

    model = COST_MODELS[basis.cost_model]
    bidder = Bidder(robot_id, basis.body, battery, itinerary, model, reserve)
    return bidder.answer(broadcast, basis.pose, basis.refusal, at_work=basis.at_work)
