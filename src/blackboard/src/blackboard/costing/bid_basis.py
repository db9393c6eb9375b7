# SPDX-License-Identifier: BSD-3-Clause
"""All that a robot's bids are worked out from, and the bids that come of it.

A robot that bids works its bids out from what it is and has. Where the fleet decides centrally it
tells that instead, and the blackboard makes the same bidder of it.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from blackboard.domain.bid import Bid
    from blackboard.domain.characteristics import RobotCharacteristics
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


@dataclass(frozen=True, slots=True)
class Bids:
    """One robot's bids on all tasks of one broadcast (message TaskCostArray).

    Attributes:
        robot_id: Who bids.
        epoch: Of the broadcast that is answered.
        auction: Of the broadcast that is answered.
        bids: One for each task.
        round: Of the broadcast that is answered.
        basis: What the bids are to be worked out from, where the blackboard does so; else None.
    """

    robot_id: str
    epoch: int
    auction: int
    bids: tuple[Bid, ...]
    round: int = 1
    basis: BidBasis | None = None
