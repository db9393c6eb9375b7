# SPDX-License-Identifier: BSD-3-Clause
"""Shapes with names: what is solid in a world, and how a world file says it."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import shapely.geometry

from hive_common.structuring import NotAllowedError

if TYPE_CHECKING:
    from shapely.geometry.base import BaseGeometry

    from simenv.world.world_content import ShapeEntry

SIDES_OF_A_QUARTER = 8
"""A circle becomes a polygon with four times as many sides: at most 0.5 % of its radius inside."""

HEIGHTS = {"walls": 1.5, "benches": 0.8, "racks": 2.0, "doors": 1.4}
"""The lists of a world file that hold shapes, and how high these are drawn by default [m]."""


@dataclass(frozen=True)
class Shape:
    """Something solid.

    Attributes:
        name: What people call it.
        area: What it covers, frame map [m].
        kind: The list of the world file that it stands in.
        height: How high it is drawn [m]; the simulation is flat.
    """

    name: str
    area: BaseGeometry
    kind: str = "walls"
    height: float = HEIGHTS["walls"]


@dataclass(frozen=True)
class Door(Shape):
    """A way through that can be shut.

    Attributes:
        open: Whether it is open at the start.
    """

    open: bool = True


def area_of(entry: ShapeEntry) -> BaseGeometry:
    """Return what a shape of a world file covers, frame map [m].

    Raises:
        NotAllowedError: Its edges cross.
    """
    if entry.box:
        return shapely.geometry.box(*entry.box)
    if entry.circle:
        centre = shapely.geometry.Point(entry.circle.centre)
        return centre.buffer(entry.circle.radius, resolution=SIDES_OF_A_QUARTER)
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
