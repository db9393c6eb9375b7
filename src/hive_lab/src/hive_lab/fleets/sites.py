# SPDX-License-Identifier: BSD-3-Clause
"""Places where simulated fleets drive: a world, and the map that its robots have.

People may walk in them, and each has a lane that can be closed.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np
import shapely.geometry

from hive_common.map_file import load_map
from hive_common.zone import SLOW, Zone
from hive_navigation.planning.clearance import ClearanceField
from simenv.world.draw_map import draw_map
from simenv.world.shapes import Shape
from simenv.world.world import World
from simenv.world.world_content import Person
from simenv.world.world_file import load_world

if TYPE_CHECKING:
    from collections.abc import Sequence

    from hive_common.grid_map import GridMap

WALL = 0.2  # thickness of the outer walls [m]

HALL_SIZE = (42.0, 25.0)  # of the hall, with its walls [m]
RACKS = [(x, y, x + 6.0, y + 1.0) for y in (8.0, 16.0) for x in (4.0, 13.0, 23.0, 32.0)]

Box = tuple[float, float, float, float]  # x_min, y_min, x_max, y_max, frame map [m]

BETWEEN_RACKS = (19.0, 7.0, 23.0, 10.0)  # a way between two racks of the hall
LOWER_DOOR = (9.4, 2.4, 10.6, 4.0)  # of the lab

LANE = "lane"  # the name of the zone around the lane that closes
FASTEST = 5.0  # in that zone while it is open: as fast as any robot [m/s]

WALK = 4.0  # least length of the way that a person walks back and forth [m]
PERSON = 0.25  # radius of a person [m]
WALKING = 0.8  # how fast people walk [m/s]

CELL = 1.2  # side of a cell of the warehouse [m]
CELLS = (35, 21)  # of the warehouse, columns and rows
SHELF_CELLS = 10  # length of a shelf, one cell deep
SHELVES_BEGIN = (7, 18)  # the first column of the shelves of a row
SHELF_ROWS = range(2, 19, 4)  # three rows of cells are free between two shelves


@dataclass(frozen=True)
class Site:
    """Where a fleet drives.

    Attributes:
        world: What is really there.
        grid: What the robots know of it.
        room: Least clearance of a robot's start or goal [m].
        lane: The lane that can be closed; there is another way around it.
    """

    world: World
    grid: GridMap
    room: float
    lane: Box | None = None

    @property
    def zones(self) -> tuple[Zone, ...]:
        """The zone around the lane, which is open and limits nobody."""
        if self.lane is None:
            return ()
        left, low, right, high = self.lane
        corners = ((left, low), (right, low), (right, high), (left, high))
        return (Zone(name=LANE, kind=SLOW, speed=FASTEST, corners=corners),)


def with_people(site: Site, people: int, seed: int) -> Site:
    """Return a site in which people walk back and forth between random places.

    The robots' map does not show them.
    """
    random = np.random.default_rng((seed, people))
    field = ClearanceField.of(site.grid)
    rows, columns = np.nonzero(field.clearance > 2 * PERSON)
    places = (np.column_stack([columns, rows]) + 0.5) * site.grid.resolution
    places += np.array(site.grid.origin[:2])
    walkers: list[Person] = []
    while len(walkers) < people:
        (ax, ay), (bx, by) = random.choice(places, 2).tolist()
        far = np.hypot(bx - ax, by - ay) >= WALK
        if far and field.line_is_clear((ax, ay), (bx, by), 2 * PERSON):
            name = f"person {len(walkers) + 1}"
            route = ((ax, ay), (bx, by))
            walkers.append(Person(name, route, speed=WALKING, radius=PERSON))
    return replace(site, world=replace(site.world, people=tuple(walkers)))


def drawn_site(
    name: str,
    size: tuple[float, float],
    racks: Sequence[Box],
    *,
    room: float,
    lane: Box | None = None,
) -> Site:
    """Return a walled rectangle with racks.

    Args:
        name: What people call it.
        size: Width and depth with the walls, from (0, 0) on [m].
        racks: x_min, y_min, x_max, y_max of each [m].
        room: See `Site`.
        lane: See `Site`.
    """
    width, depth = size
    inside = shapely.geometry.box(WALL, WALL, width - WALL, depth - WALL)
    walls = shapely.geometry.box(0.0, 0.0, width, depth).difference(inside)
    shapes = [
        Shape(f"rack {number}", shapely.geometry.box(*corners), "racks")
        for number, corners in enumerate(racks, start=1)
    ]
    world = World(name, size, (Shape("walls", walls), *shapes))
    # Nothing is unknown: no named place says from where the inside can be seen.
    grid = draw_map(world)
    grid.cells[grid.cells < 0] = 0
    return Site(world, grid, room, lane)


def hall() -> Site:
    """Return a hall with eight racks."""
    return drawn_site("hall", HALL_SIZE, RACKS, room=0.8, lane=BETWEEN_RACKS)


def warehouse() -> Site:
    """Return a warehouse of 35 x 21 cells with ten shelves in two columns.

    It is laid out as the warehouse in which Ma et al. measured multi-agent pickup and delivery
    (Lifelong Multi-Agent Path Finding for Online Pickup and Delivery Tasks, AAMAS 2017): a shelf
    is ten cells long, one cell apart from the next in its row, three from that in the next row.
    """
    size = (CELLS[0] * CELL + 2 * WALL, CELLS[1] * CELL + 2 * WALL)
    shelves = [
        (
            WALL + CELL * column,
            WALL + CELL * row,
            WALL + CELL * (column + SHELF_CELLS),
            WALL + CELL * (row + 1),
        )
        for row in SHELF_ROWS
        for column in SHELVES_BEGIN
    ]
    room, begin = CELL / 2 - 0.05, SHELVES_BEGIN[0]
    above, below = SHELF_ROWS[2], SHELF_ROWS[1] + 1  # the aisle between two shelves
    aisle = np.array([begin, below, begin + SHELF_CELLS, above]) * CELL + WALL
    left, low, right, high = aisle.tolist()
    lane = (left, low, right, high)
    return drawn_site("warehouse of cells", size, shelves, room=room, lane=lane)


def lab() -> Site:
    """Return the lab: rooms, doors and a corridor."""
    return Site(load_world("lab"), load_map("lab"), room=0.6, lane=LOWER_DOOR)


SITES = {"hall": hall, "warehouse": warehouse, "lab": lab}
