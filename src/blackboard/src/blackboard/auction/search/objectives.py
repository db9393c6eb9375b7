# SPDX-License-Identifier: BSD-3-Clause
"""What to minimise, by the names of the measures that parameter files use.

An objective turns the totals of each list into a number; the sum over all lists counts. A bid is
how much that number grows when a task is inserted at its best place in the robot's list.
"""

from __future__ import annotations

from collections.abc import Callable
from types import MappingProxyType
from typing import TYPE_CHECKING

from blackboard.costing.cost import LATEST_COUNT

if TYPE_CHECKING:
    from collections.abc import Mapping

    from blackboard.auction.search.problem import Floats
    from blackboard.auction.search.timetable import Totals

Objective = Callable[["Totals"], "Floats"]
"""Returns a number for each list, smaller where it is better."""

_SCALE = 100.0


def _makespan(totals: Totals) -> Floats:
    """Return a number that makes the latest robots outweigh the others.

    Only the latest of all robots counts, but a sum over lists is compared. A high power
    approximates that, and still rewards the other robots for being early.
    """
    return (totals.finish / _SCALE) ** LATEST_COUNT


OBJECTIVES: Mapping[str, Objective] = MappingProxyType(
    {
        "way": lambda totals: totals.energy,
        "makespan": _makespan,
        "waiting": lambda totals: totals.waiting,
    }
)
"""The objectives by the names of `costing.cost.MEASURES`; all that a way takes is energy."""
