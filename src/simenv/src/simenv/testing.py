# SPDX-License-Identifier: BSD-3-Clause
"""A small world for tests: a square hall with four walls."""

from __future__ import annotations

from typing import TYPE_CHECKING

import shapely.geometry

from simenv.world.shapes import Shape
from simenv.world.world import World

if TYPE_CHECKING:
    from simenv.world.world_content import Station

SIDE = 10.0  # width and depth of the hall; robots find free ground from 0.5 m to 9.5 m [m]
WALL = 0.5  # thickness of its walls [m]


def hall(*shapes: Shape, stations: tuple[Station, ...] = ()) -> World:
    """Return a hall with four walls and whatever else is put into it."""
    box = shapely.geometry.box
    walls = (
        Shape("south wall", box(0.0, 0.0, SIDE, WALL)),
        Shape("north wall", box(0.0, SIDE - WALL, SIDE, SIDE)),
        Shape("west wall", box(0.0, 0.0, WALL, SIDE)),
        Shape("east wall", box(SIDE - WALL, 0.0, SIDE, SIDE)),
    )
    return World("hall", (SIDE, SIDE), (*walls, *shapes), stations)
