# SPDX-License-Identifier: BSD-3-Clause
"""Named solid shapes of a world, and the areas, outlines and triangles they make."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
import shapely.geometry
import shapely.ops

from hive_common.geometry import NO_SEGMENTS, outline
from hive_common.structuring import NotAllowedError

if TYPE_CHECKING:
    from shapely.geometry.base import BaseGeometry

    from hive_common.geometry import Array
    from simenv.world.world_content import ShapeEntry

SIDES_OF_A_QUARTER = 8
"""A circle becomes a polygon of four times as many sides, at most 0.5 % of its radius inside."""

HEIGHTS = {"walls": 1.5, "benches": 0.8, "racks": 2.0, "doors": 1.4}
"""The lists of a world file that hold shapes, and how high these are drawn by default [m]."""


@dataclass(frozen=True)
class Shape:
    """Something solid."""

    name: str  # what people call it
    area: BaseGeometry  # what it covers, frame map [m]
    kind: str = "walls"  # its list in the world file
    height: float = HEIGHTS["walls"]  # how high it is drawn [m]; the simulation is flat


@dataclass(frozen=True)
class Door(Shape):
    """A way through that can be shut."""

    open: bool = True  # whether it is open at the start


def area_of(entry: ShapeEntry) -> BaseGeometry:
    """Return what a shape of a world file covers, frame map [m].

    Raise NotAllowedError if its edges cross.
    """
    if entry.box:
        return shapely.geometry.box(*entry.box)
    if entry.circle:
        centre = shapely.geometry.Point(entry.circle.centre)
        return centre.buffer(entry.circle.radius, SIDES_OF_A_QUARTER)
    if entry.segment:
        line = shapely.geometry.LineString([entry.segment.from_, entry.segment.to])
        flat = shapely.geometry.CAP_STYLE.flat
        return line.buffer(entry.segment.thickness / 2, cap_style=flat)
    area = shapely.geometry.Polygon(entry.polygon)
    if not area.is_valid or area.area == 0:
        raise NotAllowedError(["polygon"], "its edges cross; give the corners in order")
    return area


def rings(area: BaseGeometry) -> list[shapely.geometry.LinearRing]:
    """Return every ring that bounds an area, with the area on its left."""
    polygons = [part for part in getattr(area, "geoms", [area]) if not part.is_empty]
    turned = [shapely.geometry.polygon.orient(part) for part in polygons]
    return [ring for part in turned for ring in (part.exterior, *part.interiors)]


def outline_of(area: BaseGeometry) -> Array:
    """Return the outline (k, 2, 2) of an area, with the area on the left of every edge [m]."""
    edges = [outline(np.array(ring.coords)[:-1]) for ring in rings(area)]
    return np.concatenate([NO_SEGMENTS, *edges])


def prism(area: BaseGeometry, height: float) -> Array:
    """Return triangles (n, 3, 3) for 3D views: an area as a lid, and walls `height` [m] below."""
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
