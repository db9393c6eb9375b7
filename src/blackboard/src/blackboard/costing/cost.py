# SPDX-License-Identifier: BSD-3-Clause
"""What a task costs a robot: the physics, the bids, and the cost models by name.

Follows the report's cost calculation with the units put right: friction force times way is an
energy [J], an energy over 3600 s/h and the voltage is a charge [Ah].
"""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum
from types import MappingProxyType
from typing import TYPE_CHECKING, Protocol

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping

    from blackboard.costing.bid_basis import BidBasis

MAX_COST = 1000.0
"""The robot cannot or should not do the task."""

STANDARD_GRAVITY = 9.80665
"""[m/s²], ISO 80000-3."""


def friction_force(friction_coefficient: float, mass: float) -> float:
    """Return the force [N] that moves a mass [kg] at constant speed: `Fr = Cf * m * g`."""
    return friction_coefficient * mass * STANDARD_GRAVITY


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


class CostModel(Protocol):
    """Turns the terms of one task for one robot into one number that the auction compares."""

    def cost(self, terms: CostTerms) -> float:
        """Return a cost of at least 0; what reaches `MAX_COST` counts as cannot."""


class ReportCost:
    """The report's rule: `1000 * Ce * Tp / Xe`, charge taken over charge left, times the place."""

    def cost(self, terms: CostTerms) -> float:
        """Return the final cost; see `CostModel`."""
        return MAX_COST * terms.energy_charge * terms.place / terms.charge_left


class EnergyCost:
    """Least charge for the fleet: `1000 * C / Xe`, C what the robot's whole list takes more."""

    def cost(self, terms: CostTerms) -> float:
        """Return the final cost; see `CostModel`."""
        return MAX_COST * terms.added_charge / terms.charge_left


class TimeCost:
    """Soonest done: grows with the time until then and never reaches `MAX_COST`.

    `1000 * t / (t + 600 s)`: half of the scale at ten minutes, so that minutes and hours differ
    alike.
    """

    HALF_SCALE = 600.0

    def cost(self, terms: CostTerms) -> float:
        """Return the final cost; see `CostModel`."""
        return MAX_COST * terms.eta / (terms.eta + self.HALF_SCALE)


class MakespanCost:
    """All done soonest: `1000 * t / (t + 3600 s)`, t until the robot has done its whole list.

    The robot whose list ends first takes the task, so that no list becomes much longer than the
    others.
    """

    HALF_SCALE = 3600.0

    def cost(self, terms: CostTerms) -> float:
        """Return the final cost; see `CostModel`."""
        return MAX_COST * terms.finish / (terms.finish + self.HALF_SCALE)


class LatencyCost:
    """Shortest mean time to done: `1000 * w / (w + 3600 s)`, w what all wait longer in all."""

    HALF_SCALE = 3600.0

    def cost(self, terms: CostTerms) -> float:
        """Return the final cost; see `CostModel`."""
        return MAX_COST * terms.waiting / (terms.waiting + self.HALF_SCALE)


COST_MODELS: Mapping[str, CostModel] = MappingProxyType(
    {
        "report": ReportCost(),
        "energy": EnergyCost(),
        "time": TimeCost(),
        "makespan": MakespanCost(),
        "latency": LatencyCost(),
    }
)
"""The cost models by the names that fleet files use."""


LATEST_COUNT = 12
"""Power of the times at which lists end: a high one makes the latest outweigh all others."""

MEASURES: Mapping[str, Callable[[CostTerms], float]] = MappingProxyType(
    {
        "way": lambda terms: terms.way,
        "makespan": lambda terms: (terms.finish / 100.0) ** LATEST_COUNT,
        "waiting": lambda terms: terms.waiting,
    }
)
"""What a whole fleet may make small by exchanging tasks, by the names that parameter files use:
how much of it one task adds to the list of a robot."""


def measure_for(cost_model: str) -> str:
    """Return the name in `MEASURES` of what a cost model makes small, or comes closest to."""
    return {"energy": "way", "makespan": "makespan"}.get(cost_model, "waiting")


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
