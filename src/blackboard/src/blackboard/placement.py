# SPDX-License-Identifier: BSD-3-Clause
"""A place in a robot's list for one more task, and which of them is the best."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from operator import attrgetter
from types import MappingProxyType
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from blackboard.itinerary import Effort


@dataclass(frozen=True, slots=True)
class Placement:
    """A place for one more task.

    Attributes:
        index: In the list, 0 is first.
        effort: What the task itself takes there.
        added_way: How much further the robot drives because of it [m].
        before: What the robot does before its turn comes.
        finish: Time from now until the whole list is done with it [s].
        added_waiting: How much longer all tasks of the list wait until they are done, the wait
            of the task itself included, summed [s].
    """

    index: int
    effort: Effort
    added_way: float
    before: Effort
    finish: float
    added_waiting: float


PlaceRule = Callable[[Placement], float]
"""What is to be least at the best place."""

_LEAST_WAY: PlaceRule = attrgetter("added_way")

_PLACE_RULES: Mapping[str, PlaceRule] = MappingProxyType(
    {"makespan": attrgetter("finish"), "latency": attrgetter("added_waiting")}
)


def place_rule(cost_model: str) -> PlaceRule:
    """Return what is to be least at the best place under a cost model, by its name."""
    return _PLACE_RULES.get(cost_model, _LEAST_WAY)
