# SPDX-License-Identifier: BSD-3-Clause
"""Shapes with names: what is solid in a world, and how a world file says it."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import shapely.geometry

from simenv.errors import WorldError

if TYPE_CHECKING:
    from shapely.geometry.base import BaseGeometry

SIDES_OF_A_QUARTER = 8
"""A circle becomes a polygon with four times as many sides: at most 0.5 % of its radius inside."""

HEIGHTS = {"walls": 1.5, "benches": 0.8, "racks": 2.0, "doors": 1.4}
"""How high things are drawn where their file does not say [m]."""

FORMS = ("box", "polygon", "circle", "segment")


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


def shape_from(item: dict[str, Any], kind: str) -> Shape:
    """Build what an item of a world file says.

    Args:
        item: A dict that fits the schema.
        kind: The list it stands in, out of walls, benches, racks, doors.

    Raises:
        WorldError: It covers nothing, or its edges cross.
    """
    name, area, height = item["name"], _area(item), item.get("height", HEIGHTS[kind])
    if kind == "doors":
        return Door(name, area, kind, height, open=item.get("open", True))
    return Shape(name, area, kind, height)


def _area(item: dict[str, Any]) -> BaseGeometry:
    """Return the area of one shape of a world file [m]."""
    name = item["name"]
    form = next(key for key in FORMS if key in item)
    value = item[form]
    if form == "box":
        x_min, y_min, x_max, y_max = value
        if x_min >= x_max or y_min >= y_max:
            raise WorldError(f"'{name}': box {value} is empty; write [x_min, y_min, x_max, y_max]")
        return shapely.geometry.box(x_min, y_min, x_max, y_max)
    if form == "circle":
        centre = shapely.geometry.Point(value["centre"])
        return centre.buffer(value["radius"], resolution=SIDES_OF_A_QUARTER)
    if form == "segment":
        if value["from"] == value["to"]:
            raise WorldError(f"'{name}': the segment starts and ends at {value['to']}; use a box")
        line = shapely.geometry.LineString([value["from"], value["to"]])
        return line.buffer(value["thickness"] / 2, cap_style=shapely.geometry.CAP_STYLE.flat)
    area = shapely.geometry.Polygon(value)
    if not area.is_valid or area.area == 0:
        raise WorldError(f"'{name}': the edges of the polygon cross; give its corners in order")
    return area


def rings(area: BaseGeometry) -> list[shapely.geometry.LinearRing]:
    """Return every ring that bounds an area, with the area on its left."""
    polygons = [part for part in getattr(area, "geoms", [area]) if not part.is_empty]
    turned = [shapely.geometry.polygon.orient(part) for part in polygons]
    return [ring for part in turned for ring in (part.exterior, *part.interiors)]
