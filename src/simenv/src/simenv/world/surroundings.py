# SPDX-License-Identifier: BSD-3-Clause
"""What is near a place besides robots: walls, which never change, and obstacles, which may."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from hive_common.geometry import NO_SEGMENTS, Nearby
from simenv.world.obstacles import Obstacles

if TYPE_CHECKING:
    from hive_common.geometry import Array, Indices
    from simenv.world.world import World

WALLS = 0
"""What `Near.things` calls the walls."""


class Near(NamedTuple):
    """What is near some places; what is near several of them is there several times.

    Attributes:
        segments: (k, 2, 2) frame map [m].
        places: (k,) the index of the place that each is near to, in ascending order.
        things: (k,) what each is a part of: `WALLS`, or 1 and the index of the obstacle.
    """

    segments: Array
    places: Indices
    things: Indices


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

    def near(self, places: Array, reaches: Array) -> Near:
        """Return what is near each of m places.

        Args:
            places: (m, 2) or more columns, x and y first, frame map [m].
            reaches: (m,) how far off it may be [m].

        Returns:
            All that is within reach of a place, and some more.
        """
        found: list[Array] = [NO_SEGMENTS]
        where, what, counts = [], [], []
        numbers = zip(places[:, 0].tolist(), places[:, 1].tolist(), reaches.tolist(), strict=True)
        for place, (x, y, reach) in enumerate(numbers):
            pieces = [(WALLS, self.walls.at(x, y, reach))]
            if self.obstacles.now:
                pieces += self.obstacles.near(x, y, reach)
            for thing, edges in pieces:
                found.append(edges)
                where.append(place)
                what.append(thing)
                counts.append(len(edges))
        return Near(
            np.concatenate(found),
            np.array(where, dtype=np.intp).repeat(counts),
            np.array(what, dtype=np.intp).repeat(counts),
        )
