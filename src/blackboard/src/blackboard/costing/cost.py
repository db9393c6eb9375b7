# SPDX-License-Identifier: BSD-3-Clause
"""What a task costs a robot: the physics, the bids, and the cost models by name.

Follows the report's cost calculation with the units put right: friction force times way is an
energy [J], an energy over 3600 s/h and the voltage is a charge [Ah].
"""

from __future__ import annotations

from types import MappingProxyType
from typing import TYPE_CHECKING, Protocol

from blackboard.domain.bid import MAX_COST, CostTerms

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping


STANDARD_GRAVITY = 9.80665
"""[m/s²], ISO 80000-3."""


def friction_force(friction_coefficient: float, mass: float) -> float:
    """Return the force [N] that moves a mass [kg] at constant speed: `Fr = Cf * m * g`."""
    return friction_coefficient * mass * STANDARD_GRAVITY


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
