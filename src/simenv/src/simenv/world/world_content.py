# SPDX-License-Identifier: BSD-3-Clause
"""What a world file may hold: its keys are the fields of these classes."""

from typing import Annotated

import attrs

from hive_common.pose import Pose
from hive_common.structuring import (
    Allowed,
    Name,
    NotAllowedError,
    between,
    each_within,
    listed,
    positive,
)

LARGEST = 500.0
"""The longest building that is accepted [m]; a longer one is most likely given in mm."""

Point = Annotated[tuple[float, float], each_within(LARGEST, "a point [x, y] [m]")]
PoseInWorld = Annotated[Pose, each_within(LARGEST, "[x, y, yaw] [m, m, rad]")]
Length = Annotated[float, positive("a length [m]", LARGEST)]


@attrs.frozen(kw_only=True)
class Circle:
    """A round shape."""

    centre: Point
    radius: Annotated[float, positive("a radius [m]", LARGEST)]


@attrs.frozen(kw_only=True)
class Segment:
    """A straight wall."""

    from_: Point
    to: Point
    thickness: Annotated[float, positive("a thickness [m]", 10.0)]

    def __attrs_post_init__(self) -> None:
        """Refuse a segment without a length."""
        if self.from_ == self.to:
            raise NotAllowedError((), f"the segment starts and ends at {self.to}; use a box")


@attrs.frozen(kw_only=True)
class ShapeEntry:
    """A wall, bench or rack: a name and exactly one of the forms."""

    name: Name
    box: (
        Annotated[
            tuple[float, float, float, float],
            each_within(LARGEST, "[x_min, y_min, x_max, y_max] [m]"),
        ]
        | None
    ) = None
    polygon: Annotated[tuple[Point, ...], listed("at least 3 corners in order", 3)] | None = None
    circle: Circle | None = None
    segment: Segment | None = None
    height: Annotated[float, positive("how high it is drawn [m]", 50.0)] | None = None

    def __attrs_post_init__(self) -> None:
        """Refuse no form, two forms, or an empty box."""
        if [self.box, self.polygon, self.circle, self.segment].count(None) != 3:  # noqa: PLR2004  (all forms but one)
            raise NotAllowedError(
                (), f"'{self.name}' needs exactly one of box, polygon, circle, segment"
            )
        if self.box and (self.box[0] >= self.box[2] or self.box[1] >= self.box[3]):
            raise NotAllowedError(
                ["box"], f"{list(self.box)} is empty; write [x_min, y_min, x_max, y_max]"
            )


@attrs.frozen(kw_only=True)
class DoorEntry(ShapeEntry):
    """A way through that can be shut."""

    open: bool = True
    """Whether it is open at the start."""


@attrs.frozen
class Place:
    """A named place: a charger, a parking place, or a place where a robot can start."""

    name: Name
    pose: PoseInWorld
    """Where a robot stands there, frame map."""


@attrs.frozen
class Station(Place):
    """A place where something can be picked or put down."""

    item: Name = ""
    """What lies there, in words."""
    stock: Annotated[int, between(0, 1_000_000, "a whole number")] | None = None
    """Picks available at the start; None for no limit."""
    duration: Annotated[float, positive("the time one pick takes [s]", 3600.0)] | None = None
    """None for what the robot's arm needs."""


@attrs.frozen
class Person:
    """Somebody who walks a route, round and round, and waits when a robot is in the way."""

    name: Name
    route: Annotated[tuple[Point, ...], listed("at least 2 points [x, y] [m]", 2)]
    """Closed: the first point follows the last, frame map."""
    speed: Annotated[float, positive("walking speed [m/s]", 5.0)] = 0.8
    radius: Annotated[float, positive("radius of the circle the laser sees [m]", 2.0)] = 0.25


@attrs.frozen(kw_only=True)
class WorldContent:
    """A whole world file."""

    name: Name
    size: Annotated[tuple[Length, Length], Allowed("[width, depth] of the building [m]")]
    walls: tuple[ShapeEntry, ...]
    benches: tuple[ShapeEntry, ...] = ()
    racks: tuple[ShapeEntry, ...] = ()
    doors: tuple[DoorEntry, ...] = ()
    stations: tuple[Station, ...] = ()
    chargers: tuple[Place, ...] = ()
    parking: tuple[Place, ...] = ()
    starts: tuple[Place, ...] = ()
    people: tuple[Person, ...] = ()
