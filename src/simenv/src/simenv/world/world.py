# SPDX-License-Identifier: BSD-3-Clause
"""A world: what is really there, read from `worlds/<name>.yaml`.

Robots sense a world and bump into it. What they know of it is a map (`map_file`), which may
differ. Both share one frame: the lower left corner of the building is (0, 0).
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING

import shapely.geometry
import shapely.ops

from simenv.world.shapes import Door, Shape, outline_of

if TYPE_CHECKING:
    from collections.abc import Iterator

    from shapely.geometry.base import BaseGeometry

    from hive_common.geometry import Array
    from simenv.world.world_content import Person, Place, Station


@dataclass(frozen=True)
class Mistake:
    """What is wrong with something in a world."""

    name: str
    """Of the thing."""
    text: str
    """What is wrong, what is allowed, and what to do."""


@dataclass(frozen=True)
class World:
    """What is really there."""

    name: str  # what people call it
    size: tuple[float, float]  # width and depth of the building, from (0, 0) on [m]
    shapes: tuple[Shape, ...]  # everything solid that stays in place
    stations: tuple[Station, ...] = ()  # where something can be picked or placed
    chargers: tuple[Place, ...] = ()  # where robots charge
    starts: tuple[Place, ...] = ()  # where robots can start
    parking: tuple[Place, ...] = ()  # where robots can wait out of the way
    doors: tuple[Door, ...] = ()  # what opens and shuts
    people: tuple[Person, ...] = ()  # who walks about

    @property
    def places(self) -> tuple[Place, ...]:
        """All named places."""
        return (*self.stations, *self.chargers, *self.parking, *self.starts)

    def mistakes(self) -> Iterator[Mistake]:
        """Yield duplicate names, what is outside, and places where nobody can stand."""
        shapes: tuple[Shape, ...] = (*self.shapes, *self.doors)
        seen: set[str] = set()
        names = [shape.name for shape in shapes] + [place.name for place in self.places]
        for name in (*names, *(person.name for person in self.people)):
            if name in seen:
                text = f"the name '{name}' is used twice; give each thing its own name"
                yield Mistake(name, text)
            seen.add(name)
        for shape in shapes:
            yield from self._outside(shape.name, shape.area)
        for place in self.places:
            point = shapely.geometry.Point(place.pose.x, place.pose.y)
            yield from self._outside(place.name, point)
            solid = self.solid_at(point)
            if solid is not None:
                yield Mistake(
                    place.name,
                    f"'{place.name}' at {place.pose} is inside '{solid}'; "
                    "move it to where a robot can stand",
                )
        for person in self.people:
            yield from self._blocked(person)

    def _outside(self, name: str, area: BaseGeometry) -> Iterator[Mistake]:
        x_min, y_min, x_max, y_max = area.bounds
        width, depth = self.size
        tolerance = 1e-9
        if min(x_min, y_min) < -tolerance or max(x_max - width, y_max - depth) > tolerance:
            yield Mistake(
                name,
                f"'{name}' reaches from ({x_min:g}, {y_min:g}) to ({x_max:g}, {y_max:g}), outside "
                f"the building from (0, 0) to ({width:g}, {depth:g}) m; change it or `size`",
            )

    def _blocked(self, person: Person) -> Iterator[Mistake]:
        way = shapely.geometry.LinearRing([*person.route, *person.route[:1], *person.route[:1]])
        if way.length == 0:
            yield Mistake(
                person.name, f"the route of '{person.name}' has no length; give other points"
            )
            return
        trodden = way.buffer(person.radius)
        yield from self._outside(person.name, trodden)
        solid = self.solid_at(trodden)
        if solid is not None:
            yield Mistake(
                person.name,
                f"the route of '{person.name}', closed from its last point to its first, runs "
                f"into '{solid}'; keep {person.radius:g} m away from what is solid",
            )

    @cached_property
    def solid(self) -> BaseGeometry:
        """Everything solid that stays in place, as one area, frame map [m]."""
        return shapely.ops.unary_union([shape.area for shape in self.shapes])

    @cached_property
    def segments(self) -> Array:
        """The outline of everything solid (k, 2, 2), frame map [m]."""
        return outline_of(self.solid)

    def refusal(self, area: BaseGeometry) -> str:
        """Say why nobody can stand on an area, frame map [m]; empty if nothing is in the way."""
        width, depth = self.size
        if not area.within(shapely.geometry.box(0.0, 0.0, width, depth)):
            return (
                f"that is outside the world '{self.name}', which reaches from (0, 0) to "
                f"({width:g}, {depth:g}) m; choose a free place"
            )
        solid = self.solid_at(area)
        return "" if solid is None else f"'{solid}' is there; choose a free place"

    def refusal_at(self, x: float, y: float) -> str:
        """Say why nobody can stand at a point, frame map [m]; empty if nothing is in the way."""
        return self.refusal(shapely.geometry.Point(x, y))

    def solid_at(self, area: BaseGeometry) -> str | None:
        """Return the name of a shape that an area overlaps, or None."""
        return next((shape.name for shape in self.shapes if shape.area.intersects(area)), None)
