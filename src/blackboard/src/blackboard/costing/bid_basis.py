# SPDX-License-Identifier: BSD-3-Clause
"""What a robot's bids are computed from, and the bids themselves.

A robot computes its bids from what it is and has. In a fleet that decides centrally it sends that
instead, and the blackboard computes the same bids.
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
        pose: Where it is [map frame].
        charge: From 0 to 1.
        at_work: Whether the first task on its schedule is under way.
        refusal: Why it takes nothing now; empty if it is in service.
        tasks: Its schedule, each task by its id with the first step that is still to be done.
        chargers: Where it can charge [map frame].
        pace: What it has learned of its drives, see `Pace.times`; may be empty.
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
    """One robot's bids on everything in one broadcast (message TaskCostArray).

    Attributes:
        robot_id: Who bids.
        epoch: Of the broadcast that is answered.
        auction: Of the broadcast that is answered.
        bids: One for each bundle.
        round: Of the broadcast that is answered.
        basis: What the blackboard is to compute the bids from; None if `bids` holds them.
    """

    robot_id: str
    epoch: int
    auction: int
    bids: tuple[Bid, ...]
    round: int = 1
    basis: BidBasis | None = None
