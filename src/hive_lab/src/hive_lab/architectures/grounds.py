# SPDX-License-Identifier: BSD-3-Clause
"""The hall in which the fleets work: its places, and the paths between them as each node pays."""

from __future__ import annotations

import itertools
import time
from functools import cache
from typing import TYPE_CHECKING

import numpy as np

from blackboard.costing.grid_path_lengths import GridPathLengths
from fleet_manager.config.load import random_tasks
from hive_lab.fleets.sites import hall

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Sequence

    from blackboard.domain.path_lengths import Floats, Wanted
    from hive_common.grid_map import GridMap
    from hive_common.pose import Pose

PLACES = 40  # where tasks begin and end

_SEED = 7  # of the places, the same in all runs


@cache
def grid() -> GridMap:
    """Return the map of the hall."""
    return hall().grid


@cache
def poses(number: int) -> tuple[Pose, ...]:
    """Return so many random poses on the free floor; more begin with the same ones."""
    tasks = random_tasks(grid(), np.random.default_rng(_SEED))
    goals = (goal for task in tasks for goal in task.goals)
    return tuple(itertools.islice(goals, number))


class _Surveyed:
    """The paths of robots of one size to all places, and what each place has cost.

    Attributes:
        lengths: They know the way to every place.
        costs: Processor time of the distance field of each place [s].
    """

    def __init__(self, radius: float) -> None:
        self.lengths = GridPathLengths(grid(), radius)
        self.costs: dict[Pose, float] = {}
        first, *others = poses(PLACES)
        self._survey(first)
        for place in others:
            begun = time.thread_time()
            self._survey(place)
            self.costs[place] = time.thread_time() - begun
        # The first came with the preparation of the map; it takes as long as any other.
        self.costs[first] = float(np.median([*self.costs.values()]))

    def _survey(self, place: Pose) -> None:
        """Compute the distance field of a place."""
        list(self.lengths.columns([place], [place]))


_surveyed = cache(_Surveyed)


def free_lengths(radius: float) -> GridPathLengths:
    """Return the path lengths for a radius [m], for which nobody is charged."""
    return _surveyed(radius).lengths


class NodePathLengths:
    """The path lengths of one node, which it has to work out itself; see `PathLengths`.

    All nodes of a simulation share the distance fields. A node is charged what a field took to
    compute when it first needs it, as if each had its own.

    Args:
        radius: Of the robot [m].
        charge: Charges the node with processor time [s].
    """

    def __init__(self, radius: float, charge: Callable[[float], None]) -> None:
        self._surveyed = _surveyed(radius)
        self._charge = charge
        self._paid: set[Pose] = set()

    def length(self, start: Pose, goal: Pose) -> float:
        """Return the length of the path [m]."""
        return self.length_and_delay(start, goal)[0]

    def length_and_delay(self, start: Pose, goal: Pose) -> tuple[float, float]:
        """Return the length of the path [m], and no delay."""
        if start not in self._paid:  # without traffic, the field of either end answers
            self._pay(goal)
        return self._surveyed.lengths.length_and_delay(start, goal)

    def columns(
        self, starts: Sequence[Pose], goals: Sequence[Pose]
    ) -> Iterator[tuple[Floats, Floats, float]]:
        """Yield the paths from all starts to each goal; see `PathLengths`."""
        for goal in goals:
            self._pay(goal)
        return self._surveyed.lengths.columns(starts, goals)

    def wanted(self, ways: Sequence[Sequence[Pose]]) -> Wanted | None:
        """Return None: what is missing is paid for when it is needed."""

    def refusal(self, pose: Pose) -> str:
        """Say why no robot can stand at a pose; empty if one can."""
        return self._surveyed.lengths.refusal(pose)

    def _pay(self, goal: Pose) -> None:
        if goal not in self._paid:
            self._paid.add(goal)
            self._charge(self._surveyed.costs.get(goal, 0.0))
