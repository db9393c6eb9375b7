# SPDX-License-Identifier: BSD-3-Clause
"""What is near a place besides robots: walls, which never change, and obstacles, which may."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from simenv.geometry import NO_SEGMENTS, Nearby
from simenv.obstacles import Obstacles

if TYPE_CHECKING:
    from simenv.geometry import Array, Indices
    from simenv.world import World


class Surroundings:
    """Everything solid in a world that is no robot.

    Attributes:
        walls: What never changes.
        obstacles: People, doors, and what was put in the way.
    """

    def __init__(self, world: World) -> None:
        """Begin as the world's file says."""
        self.walls = Nearby(world.segments)
        self.obstacles = Obstacles(world)

    def near_all(self, places: Array, reaches: Array) -> tuple[Array, Indices]:
        """Return what is near each of m places.

        Args:
            places: (m, 2) or more columns, x and y first, frame map [m].
            reaches: (m,) how far off it may be [m].

        Returns:
            Segments (k, 2, 2) within reach of a place, and some more, frame map [m]; and (k,) the
            index of that place. One that is near several places is there several times.
        """
        found: list[Array] = [NO_SEGMENTS]
        counts = []
        numbers = zip(places[:, 0].tolist(), places[:, 1].tolist(), reaches.tolist(), strict=True)
        for x, y, reach in numbers:
            walls = self.walls.at(x, y, reach)
            others = [obstacle.edges for obstacle in self.obstacles.near(x, y, reach)]
            found += [walls, *others]
            counts.append(len(walls) + sum(map(len, others)))
        return np.concatenate(found), np.arange(len(counts)).repeat(counts)
