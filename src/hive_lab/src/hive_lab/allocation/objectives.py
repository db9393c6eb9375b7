# SPDX-License-Identifier: BSD-3-Clause
"""What is to be made small, by name.

An objective turns what one list takes in all into a number; the sum over all lists is what counts.
A bid is how much that number grows when a task is put at its best place in the robot's list.
"""

from __future__ import annotations

from types import MappingProxyType
from typing import TYPE_CHECKING, Protocol

if TYPE_CHECKING:
    from collections.abc import Mapping

    from hive_lab.allocation.timetable import Floats, Totals


class Objective(Protocol):
    """Says how bad a list is."""

    def score(self, totals: Totals) -> Floats:
        """Return a number for each list, smaller where it is better."""


class Report:
    """The report's rule: place in the list times way, so that short lists fill first.

    At the end of a list its bid is the one of the report: place times way.
    """

    def score(self, totals: Totals) -> Floats:
        """Return a number for each list; see `Objective`."""
        return totals.toil


class Energy:
    """Least energy for driving: the way of each robot times what it draws per metre."""

    def score(self, totals: Totals) -> Floats:
        """Return a number for each list; see `Objective`."""
        return totals.energy


class Makespan:
    """All done soonest.

    The latest of all robots is what counts, but a sum over lists is what is compared. A high power
    makes the latest ones outweigh the others, and still rewards the others for being early.
    """

    POWER = 12
    SCALE = 100.0

    def score(self, totals: Totals) -> Floats:
        """Return a number for each list; see `Objective`."""
        return (totals.finish / self.SCALE) ** self.POWER


class Latency:
    """Shortest mean time to done, each task by its weight."""

    def score(self, totals: Totals) -> Floats:
        """Return a number for each list; see `Objective`."""
        return totals.waiting


OBJECTIVES: Mapping[str, Objective] = MappingProxyType(
    {"report": Report(), "energy": Energy(), "makespan": Makespan(), "latency": Latency()}
)
"""The objectives by the names that fleet files use."""
