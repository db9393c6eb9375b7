# SPDX-License-Identifier: BSD-3-Clause
"""What a task costs a robot: friction, and the cost models by name.

Follows the report's cost calculation with its units corrected: friction force times distance is an
energy [J]; an energy over 3600 s/h and the voltage is a charge [Ah].
"""

from __future__ import annotations

from dataclasses import dataclass
from operator import attrgetter
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
        """Return a cost of at least 0; `MAX_COST` or more means that the robot cannot."""


class ReportCost:
    """The report's rule: `1000 * Ce * Tp / Xe`, charge taken over charge left, times the place."""

    def cost(self, terms: CostTerms) -> float:
        """Return the final cost; see `CostModel`."""
        return MAX_COST * terms.energy_charge * terms.place / terms.charge_left


class EnergyCost:
    """Least charge for the fleet: `1000 * C / Xe`, C what the whole schedule takes more."""

    def cost(self, terms: CostTerms) -> float:
        """Return the final cost; see `CostModel`."""
        return MAX_COST * terms.added_charge / terms.charge_left


@dataclass(frozen=True)
class DurationCost:
    """Grows with a duration and never reaches `MAX_COST`: `1000 * t / (t + half_scale)`."""

    duration: Callable[[CostTerms], float]  # takes the duration out of the terms [s]
    # The duration that costs half of `MAX_COST`; shorter and longer ones differ well on this scale
    # [s].
    half_scale: float

    def cost(self, terms: CostTerms) -> float:
        """Return the final cost; see `CostModel`."""
        duration = self.duration(terms)
        return MAX_COST * duration / (duration + self.half_scale)


COST_MODELS: Mapping[str, CostModel] = MappingProxyType(
    {
        "report": ReportCost(),
        "energy": EnergyCost(),
        "time": DurationCost(attrgetter("eta"), 600.0),
        # The robot whose schedule ends first takes the task, so that none becomes much longer.
        "makespan": DurationCost(attrgetter("finish"), 3600.0),
        "latency": DurationCost(attrgetter("waiting"), 3600.0),
    }
)
"""The cost models by the names that fleet files use."""


LATEST_COUNT = 12
"""Power of the times at which schedules end; a high one makes the latest outweigh all others."""


def measure_for(cost_model: str) -> str:
    """Return the name in `MEASURE_NAMES` of what a cost model minimizes, or comes closest to."""
    return {"energy": "way", "makespan": "makespan"}.get(cost_model, "waiting")
