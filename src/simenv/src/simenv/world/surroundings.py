# SPDX-License-Identifier: BSD-3-Clause
"""What is near a place besides robots: walls, which never change, and obstacles."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from hive_common.geometry import NO_SEGMENTS, Nearby
from simenv.world.obstacles import Obstacles

if TYPE_CHECKING:
    from hive_common.geometry import Array, Indices
    from simenv.world.world import World

WALLS = 0  # the number of the walls in `Near.things`


class Near(NamedTuple):
    """Segments near some places, repeated for each place they are near."""

    segments: Array  # (k, 2, 2) frame map [m]
    places: Indices  # (k,) index of the place that each is near, in ascending order
    things: Indices  # (k,) what each belongs to: `WALLS`, or 1 + the index of the obstacle


class Surroundings:
    """Everything solid in a world besides robots."""

    def __init__(self, world: World) -> None:
        """Begin as the world's file says."""
        self.walls = Nearby(world.segments)  # what never changes
        self.obstacles = Obstacles(world)  # people, doors, and other things in the way

    def near(self, places: Array, reaches: Array) -> Near:
        """Return all segments within `reaches` (m,) [m] of m places, and some more.

        `places` is (m, 2) or has further columns; x and y come first, frame map [m].
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
