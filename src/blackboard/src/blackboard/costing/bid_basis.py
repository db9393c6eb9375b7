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
    """What a robot is and has at one moment (message BidBasis)."""

    body: RobotCharacteristics
    cost_model: str  # a name of `COST_MODELS`
    aging: float  # see `RobotSettings` [s]
    pose: Pose  # where it is [map frame]
    charge: float  # from 0 to 1
    at_work: bool = False  # whether the first task on its schedule is under way
    refusal: str = ""  # why it takes nothing now; empty if it is in service
    # Its schedule, each task by its id with the first step that is still to be done.
    tasks: tuple[tuple[str, int], ...] = ()
    chargers: tuple[Pose, ...] = ()  # where it can charge [map frame]
    # What it has learned, see `costing.experience.Learned`; may be empty.
    pace: tuple[float, ...] = ()


@dataclass(frozen=True, slots=True)
class Bids:
    """One robot's bids on everything in one broadcast (message TaskCostArray)."""

    robot_id: str
    epoch: int  # of the broadcast that is answered
    auction: int  # of the broadcast that is answered
    bids: tuple[Bid, ...]  # one for each task offered
    round: int = 1  # of the broadcast that is answered
    # What the blackboard is to compute the bids from; None if `bids` holds them.
    basis: BidBasis | None = None
