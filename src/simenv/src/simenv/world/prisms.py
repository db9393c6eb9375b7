# SPDX-License-Identifier: BSD-3-Clause
"""Areas as solid bodies for 3D views: the area as a lid, and walls below its edges."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
import shapely.geometry
import shapely.ops

from simenv.world.world import outline_of

if TYPE_CHECKING:
    from shapely.geometry.base import BaseGeometry

    from hive_common.geometry import Array


def prism(area: BaseGeometry, height: float) -> Array:
    """Return the triangles of an area that is so high.

    Args:
        area: What it covers, frame map [m].
        height: [m]

    Returns:
        (n, 3, 3) array: n triangles, their corners, x, y, z [m].
    """
    lids = [np.array(part.exterior.coords)[:3] for part in _triangles(area)]
    top = [np.column_stack([lid, np.full(3, height)]) for lid in lids]
    sides = []
    for a, b in outline_of(area):
        low_a, low_b, high_a, high_b = (*a, 0.0), (*b, 0.0), (*a, height), (*b, height)
        sides += [np.array([low_a, low_b, high_b]), np.array([low_a, high_b, high_a])]
    return np.array([*top, *sides])


def _triangles(area: BaseGeometry) -> list[shapely.geometry.Polygon]:
    """Return triangles that cover an area; those of its corners that lie inside."""
    found = shapely.ops.triangulate(area)
    return [triangle for triangle in found if area.contains(triangle.representative_point())]
