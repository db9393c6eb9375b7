# SPDX-License-Identifier: BSD-3-Clause
"""Where robots enter the roadmap, and where they leave it for their goals.

Robots and goals lie beside the roadmap's places. A robot is planned from a place that it reaches
straight on, and to one from which it sees its goal.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from robot_navigation.mapf.ends import nearest_places
from robot_navigation.mapf.segments import segments_near
from robot_navigation.traffic.right_of_way import GAP

if TYPE_CHECKING:
    from collections.abc import Sequence

    from hive_common.geometry import Array, Indices
    from robot_navigation.mapf.path_search import Motion
    from robot_navigation.mapf.roadmap import Roadmap
    from robot_navigation.planning.clearance import ClearanceField
    from robot_navigation.planning.path import Point

ENTRIES = 12  # places that are looked at for a robot that is off the roadmap
KEPT = 10_000  # goals whose nearest places are remembered
ROUNDING = 1e-6  # how much nearer than allowed counts as far enough [m]


class Standing(NamedTuple):
    """A robot where it is planned from."""

    at: Point  # frame map [m]
    radius: float  # [m]


class Ends:
    """Entries to a roadmap, and exits from it."""

    def __init__(self, roadmap: Roadmap, field: ClearanceField) -> None:
        self._roadmap = roadmap
        self._field = field
        self._exits: dict[tuple[Point, float], int | None] = {}

    def exit(self, goal: Point, radius: float) -> int | None:
        """Return the place from which a robot goes to its goal; None if there is none."""
        key = (goal, radius)
        if key not in self._exits:
            if len(self._exits) > KEPT:
                self._exits.clear()
            found = self._reached(goal, radius, 1)
            self._exits[key] = int(found[0]) if len(found) else None
        return self._exits[key]

    def entry(
        self,
        here: Point,
        motion: Motion,
        times: Array | None,
        others: Sequence[Standing],
        keep: int | None = None,
    ) -> int | None:
        """Return the place to which a robot goes first; None if others stand before all of them.

        Args:
            here: Where the robot is, frame map [m].
            motion: How it moves.
            times: From each place to its goal [s]; None without a goal.
            others: Where the other robots are.
            keep: The place to which it has been going; it stays if it is free.
        """
        found = self._reached(here, motion.radius, ENTRIES)
        free = [
            int(place)
            for place in found
            if not any(self._meets(here, int(place), motion.radius, other) for other in others)
        ]
        if keep in free or not free:
            return keep if free else None
        legs = np.hypot(*(self._roadmap.places[free] - here).T) / motion.speed
        costs = legs if times is None else legs + times[free]
        return free[int(np.argmin(costs))]

    def _meets(self, here: Point, place: int, radius: float, other: Standing) -> bool:
        """Return whether a robot comes nearer to another one than it may, or than it is."""
        apart = min(radius + other.radius + GAP, math.dist(here, other.at)) - ROUNDING
        way = np.array([here]), self._roadmap.places[place : place + 1]
        return len(segments_near(*way, np.array([other.at]), apart)) > 0

    def _reached(self, point: Point, radius: float, most: int) -> Indices:
        """Return the places nearest to a point to which a robot can go straight."""
        found: Indices = nearest_places(
            self._roadmap, self._field, np.array([point]), np.array([radius]), most
        )[0]
        return found[found >= 0]
