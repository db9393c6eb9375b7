# SPDX-License-Identifier: BSD-3-Clause
"""A world: what is really there, read from `worlds/<name>.yaml`.

A world is what robots sense and bump into. What they know of it is a map (`map_file`), which may
differ. World and map share one frame: the lower left corner of the building is (0, 0).
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np
import shapely.geometry
import shapely.ops

from robot_description.checked_yaml import read_checked
from robot_description.follower import Pose
from simenv.errors import WorldError
from simenv.folders import file_names, named_file
from simenv.geometry import NO_SEGMENTS, Array, outline
from simenv.world_schema import SCHEMA, SOLID_KINDS

if TYPE_CHECKING:
    from shapely.geometry.base import BaseGeometry

SIDES_OF_A_QUARTER = 8
"""A circle becomes a polygon with four times as many sides: at most 0.5 % of its radius inside."""


@dataclass(frozen=True)
class Shape:
    """Something solid.

    Attributes:
        name: What people call it.
        area: What it covers, frame map [m].
    """

    name: str
    area: BaseGeometry


@dataclass(frozen=True)
class Place:
    """A place with a name: a charger, or a place where a robot can start.

    Attributes:
        name: What people call it.
        pose: Where a robot stands there, frame map [m, m, rad].
    """

    name: str
    pose: Pose


@dataclass(frozen=True)
class Station(Place):
    """A place where something can be picked or put down.

    Attributes:
        item: What lies there, in words; empty where nothing is said.
        stock: How many picks there are at the start; None for no end of them.
        duration: Time that a pick takes there [s]; None for what the robot's arm needs.
    """

    item: str = ""
    stock: int | None = None
    duration: float | None = None


@dataclass(frozen=True)
class World:
    """What is really there.

    Attributes:
        name: What people call it.
        size: Width and depth of the building, from (0, 0) on [m].
        shapes: Everything solid.
        stations: Where something can be picked or put down.
        chargers: Where robots charge.
        starts: Where robots can be put at the start.
    """

    name: str
    size: tuple[float, float]
    shapes: tuple[Shape, ...]
    stations: tuple[Station, ...] = ()
    chargers: tuple[Place, ...] = ()
    starts: tuple[Place, ...] = ()

    def __post_init__(self) -> None:
        """Refuse names that are used twice, and places that nobody can stand at."""
        places: tuple[Place, ...] = (*self.stations, *self.chargers, *self.starts)
        names = [shape.name for shape in self.shapes] + [place.name for place in places]
        twice = next((name for name in names if names.count(name) > 1), None)
        if twice is not None:
            raise WorldError(f"the name '{twice}' is used twice; give each thing its own name")
        for shape in self.shapes:
            self._check_inside(shape.name, shape.area)
        for place in places:
            point = shapely.geometry.Point(place.pose.x, place.pose.y)
            self._check_inside(place.name, point)
            shape_name = self.solid_at(point)
            if shape_name is not None:
                raise WorldError(
                    f"'{place.name}' at {place.pose} is inside '{shape_name}'; "
                    "move it to where a robot can stand"
                )

    def _check_inside(self, name: str, area: BaseGeometry) -> None:
        x_min, y_min, x_max, y_max = area.bounds
        width, depth = self.size
        tolerance = 1e-9
        if min(x_min, y_min) < -tolerance or max(x_max - width, y_max - depth) > tolerance:
            raise WorldError(
                f"'{name}' reaches from ({x_min:g}, {y_min:g}) to ({x_max:g}, {y_max:g}), outside "
                f"the building from (0, 0) to ({width:g}, {depth:g}) m; change it or `size`"
            )

    @cached_property
    def solid(self) -> BaseGeometry:
        """Everything solid as one area, frame map [m]."""
        return shapely.ops.unary_union([shape.area for shape in self.shapes])

    @cached_property
    def segments(self) -> Array:
        """The outline of everything solid (k, 2, 2), frame map [m]."""
        edges = [outline(np.array(ring.coords)[:-1]) for ring in rings(self.solid)]
        return np.concatenate([NO_SEGMENTS, *edges])

    def solid_at(self, area: BaseGeometry) -> str | None:
        """Return the name of something solid that an area overlaps, or None."""
        return next((shape.name for shape in self.shapes if shape.area.intersects(area)), None)


def load_world(name_or_path: str) -> World:
    """Read and check a world.

    Args:
        name_or_path: The name of a world of this package (`lab`), or the path of a YAML file.

    Raises:
        FileError: The file cannot be read, or holds something that is not allowed.
        WorldError: There is no such world, or its parts contradict each other.
    """
    path = named_file("worlds", name_or_path)
    if path is None:
        raise WorldError(
            f"world '{name_or_path}': not known; allowed: {', '.join(file_names('worlds'))}, "
            "or the path of a .yaml file"
        )
    content = read_checked(path, SCHEMA)
    try:
        return _world(content)
    except WorldError as error:
        raise WorldError(f"{path}: {error}") from None


def _world(content: dict[str, Any]) -> World:
    """Build a world from what its file holds."""
    shapes = [item for kind in SOLID_KINDS for item in content.get(kind, [])]
    return World(
        name=content["name"],
        size=(content["size"][0], content["size"][1]),
        shapes=tuple(Shape(item["name"], _area(item)) for item in shapes),
        stations=tuple(_station(item) for item in content.get("stations", [])),
        chargers=tuple(Place(item["name"], _pose(item)) for item in content.get("chargers", [])),
        starts=tuple(Place(item["name"], _pose(item)) for item in content.get("starts", [])),
    )


def _station(item: dict[str, Any]) -> Station:
    return Station(**(item | {"pose": _pose(item)}))


def _pose(item: dict[str, Any]) -> Pose:
    return Pose(*map(float, item["pose"]))


def _area(item: dict[str, Any]) -> BaseGeometry:
    """Return the area of one shape of a world file [m]."""
    name = item["name"]
    form = next(key for key in item if key != "name")
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
