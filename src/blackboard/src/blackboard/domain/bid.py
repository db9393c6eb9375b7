# SPDX-License-Identifier: BSD-3-Clause
"""What a robot bids on a task, and what the bid was computed from."""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum

MAX_COST = 1000.0
"""The robot cannot or should not do the task."""


@dataclass(frozen=True, slots=True)
class CostTerms:
    """What a cost model may weigh.

    Attributes:
        energy_charge: Charge that the task takes out of the battery [Ah].
        charge_left: Charge that is left when its turn comes [Ah], above 0.
        place: Its place in the robot's list; 1 is next.
        way: How much further the robot drives because of it [m].
        eta: Time from now until it would be done [s].
        finish: Time from now until the robot would have done its whole list [s].
        waiting: How much longer all tasks of the list wait until they are done, its own wait
            included, summed [s].
        added_charge: How much more charge the whole list takes because of it [Ah].
    """

    energy_charge: float
    charge_left: float
    place: int
    way: float
    eta: float
    finish: float = 0.0
    waiting: float = 0.0
    added_charge: float = 0.0


class Exclusion(str, Enum):
    """Why a robot does not take a task."""

    NONE = ""
    """It takes it, or it does not say."""
    TYPE = "type"
    """It does not do such tasks."""
    PAYLOAD = "payload"
    """It is too heavy for its body or its arm."""
    WAY = "way"
    """There is no way for a robot of its radius."""
    CHARGE = "charge"
    """Too little charge would be left."""
    SERVICE = "service"
    """It is out of service."""
    COST = "cost"
    """Its cost model says that it should not, or it has begun with it already."""


@dataclass(frozen=True, slots=True)
class Bid:
    """What one task would cost one robot (message TaskCost).

    Attributes:
        robot_id: Who bids.
        task_id: On what.
        cost: 0 to `MAX_COST`.
        energy_cost: Predicted charge for the task [Ah].
        eta: Predicted time from now until it would be done [s].
        reason: Why the cost is `MAX_COST`; empty otherwise.
        under_way: Id of the task that the robot is doing now; empty when it could begin at once.
        interrupt_cost: Cost of doing the task at once and what is under way later, 0 to
            `MAX_COST`, which says that what is under way cannot be put off for it.
        most_payload: The most that the robot can carry of such a task [kg]; -1 where it can carry
            nothing of it, 0 where it does not say.
        terms: What the cost was worked out from; None where the robot takes no part.
        exclusion: Why the cost is `MAX_COST`, one of `Exclusion`.
        size: How many tasks of the broadcast it is for, from this one on: those that are offered
            as one.
    """

    robot_id: str
    task_id: str
    cost: float
    energy_cost: float = 0.0
    eta: float = 0.0
    reason: str = ""
    under_way: str = ""
    interrupt_cost: float = MAX_COST
    most_payload: float = 0.0
    terms: CostTerms | None = None
    exclusion: str = ""
    size: int = 1

    @property
    def is_able(self) -> bool:
        """Whether the robot would take the task."""
        return self.cost < MAX_COST
