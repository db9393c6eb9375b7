# SPDX-License-Identifier: BSD-3-Clause
"""Tells which places of a map a robot cannot reach on its roadmap.

A station that a robot is too wide for, or that zones cut off, is a mistake in a world or a fleet
file; it is found at the start, not when the first task fails there.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from scipy import sparse
from scipy.sparse import csgraph

from hive_navigation.mapf.ends import joined_ends
from hive_navigation.mapf.roadmap import need

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from hive_navigation.mapf.roadmap import Roadmap
    from hive_navigation.planning.clearance import ClearanceField
    from hive_navigation.planning.path import Point


def unreached(
    roadmap: Roadmap,
    field: ClearanceField,
    radius: float,
    start: Point,
    goals: Mapping[str, Sequence[float]],
) -> list[str]:
    """Return the names of the places that a robot cannot reach from where it is.

    Args:
        roadmap: One without ends; its closed zones keep the robot out.
        field: The clearances of the map.
        radius: Of the robot [m].
        start: Where it is, frame map [m].
        goals: The places by name, each beginning with x and y, frame map [m].
    """
    points = np.array([start[:2], *(goal[:2] for goal in goals.values())], dtype=float)
    ends = joined_ends(roadmap, field, points, np.full(len(points), radius))
    lanes = np.vstack([roadmap.lanes, ends.legs])
    fits = np.concatenate([roadmap.widths, ends.widths]) >= need(radius)
    count = len(roadmap.places) + len(ends.points)
    ways = sparse.csr_matrix((np.ones(int(fits.sum())), lanes[fits].T), (count, count))
    found = csgraph.breadth_first_order(ways, ends.index[0], return_predecessors=False)
    reached = np.zeros(count, dtype=np.bool_)
    reached[found] = True
    return [name for name, place in zip(goals, ends.index[1:], strict=True) if not reached[place]]
