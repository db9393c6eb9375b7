# SPDX-License-Identifier: BSD-3-Clause
"""What may be in the robots' way: people who walk, shut doors, things put down.

Walls are found in a table that never changes (`surroundings.Walls`). Obstacles come, move and go;
there are few of them, so every step looks at all.
"""

from __future__ import annotations

import itertools
import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
import shapely.geometry

from hive_common.geometry import NO_SEGMENTS, outline
from simenv.errors import ObstacleError
from simenv.world.shapes import outline_of

if TYPE_CHECKING:
    from collections.abc import Collection

    from shapely.geometry.base import BaseGeometry

    from hive_common.geometry import Array, Footprint, Indices
    from hive_common.pose import Pose
    from simenv.world.world import World
    from simenv.world.world_content import Person

MANNERS = 0.3  # distance at which a person stops in front of a robot [m]
SIDES = 16  # sides of the polygon that stands for a person

CIRCLE = np.stack([f(np.arange(SIDES) * 2 * np.pi / SIDES) for f in (np.cos, np.sin)], axis=1)


@dataclass(frozen=True)
class Obstacle:
    """Something solid that may move or go."""

    name: str  # what people call it
    edges: Array  # (k, 2, 2) outline, frame map [m]
    middle: tuple[float, float]  # of a circle around it, frame map [m]
    radius: float  # of that circle [m]


class Walker:
    """One person on their route."""

    def __init__(self, person: Person) -> None:
        """Begin at the start of the route."""
        self._person = person
        self._corners = [*person.route, person.route[0]]
        lengths = [math.dist(a, b) for a, b in itertools.pairwise(self._corners)]
        self._ends = list(itertools.accumulate(lengths))
        self._gone = 0.0

    @property
    def position(self) -> tuple[float, float]:
        """Position, frame map [m]."""
        return self._at(self._gone)

    @property
    def obstacle(self) -> Obstacle:
        """The person as an obstacle."""
        here, radius = self.position, self._person.radius
        return Obstacle(self._person.name, outline(CIRCLE * radius + here), here, radius)

    def step(self, dt: float, robots: Collection[tuple[Footprint, Pose]]) -> None:
        """Walk for `dt` [s], unless that leads into a robot."""
        ahead = (self._gone + self._person.speed * dt) % self._ends[-1]
        here, there = self.position, self._at(ahead)
        keep = self._person.radius + MANNERS
        for footprint, pose in robots:
            nearer = math.dist(there, pose[:2]) < math.dist(here, pose[:2])
            if nearer and math.dist(there, pose[:2]) < footprint.radius + keep:
                return
        self._gone = ahead

    def _at(self, gone: float) -> tuple[float, float]:
        leg = next(i for i, end in enumerate(self._ends) if gone <= end)
        start = self._ends[leg - 1] if leg else 0.0
        share = (gone - start) / max(self._ends[leg] - start, 1e-9)
        (x0, y0), (x1, y1) = self._corners[leg], self._corners[leg + 1]
        return x0 + share * (x1 - x0), y0 + share * (y1 - y0)


class Obstacles:
    """Everything of a world that may move, come or go.

    Attributes:
        now: The present obstacles.
        edges: (k, 2, 2) all their edges, one obstacle after the other, frame map [m].
        ends: (n + 1,) where the edges of each of them begin.
        circles: (n, 3) x, y and radius of their circles, frame map [m].
        changes: How often something has come, gone, or been reset.
    """

    def __init__(self, world: World) -> None:
        """Begin as the world's file says."""
        self._world = world
        self.changes = 0
        self.reset()

    def refusal(self, footprint: Footprint, pose: Pose) -> str:
        """Say why a base cannot stand at a pose, frame map; empty if it can.

        Only what is solid in the world counts, not other robots.
        """
        if not all(map(math.isfinite, pose)):
            return "x, y and yaw must be numbers"
        reason = self._world.refusal(shapely.geometry.Polygon(footprint.at(pose)))
        there = [each.name for each in self.now if footprint.touches(pose, each.edges)]
        return reason or (f"'{there[0]}' is there; choose a free place" if there else "")

    def reset(self) -> None:
        """Return to the start; what was put down since is gone."""
        self._walkers = [Walker(person) for person in self._world.people]
        self._shut = {door.name for door in self._world.doors if not door.open}
        self._put: dict[str, BaseGeometry] = {}
        self._collect()

    @property
    def people(self) -> dict[str, tuple[float, float]]:
        """Positions of all people by name, frame map [m]."""
        names = (person.name for person in self._world.people)
        return dict(zip(names, (walker.position for walker in self._walkers), strict=True))

    @property
    def shut(self) -> frozenset[str]:
        """The names of shut doors and of things put down."""
        return frozenset(self._shut | set(self._put))

    def step(self, dt: float, robots: Collection[tuple[Footprint, Pose]]) -> None:
        """Let people walk for `dt` [s] among robots, each a footprint and a pose."""
        for walker in self._walkers:
            walker.step(dt, robots)
        self._look()

    def set_door(self, name: str, *, is_open: bool) -> None:
        """Open or shut a door, in which nobody may stand; see `door_area` for errors."""
        self.door_area(name)
        (self._shut.discard if is_open else self._shut.add)(name)
        self._collect()

    def door_area(self, name: str) -> BaseGeometry:
        """Return what a door covers when shut, frame map [m]; raise ObstacleError if unknown."""
        areas = {door.name: door.area for door in self._world.doors}
        if name not in areas:
            known = ", ".join(areas) or "none"
            raise ObstacleError(f"door '{name}': not known; in this world: {known}")
        return areas[name]

    def put(self, name: str, area: BaseGeometry) -> None:
        """Put something down where nobody stands."""
        self._put[name] = area
        self._collect()

    def take(self, name: str) -> None:
        """Remove something that was put down; raise ObstacleError if there is no such thing."""
        if name not in self._put:
            known = ", ".join(self._put) or "nothing"
            raise ObstacleError(f"obstacle '{name}': not there; put down so far: {known}")
        del self._put[name]
        self._collect()

    def _collect(self) -> None:
        self.changes += 1
        areas = {door.name: door.area for door in self._world.doors if door.name in self._shut}
        self._still = [_obstacle(name, area) for name, area in (areas | self._put).items()]
        self._look()

    def _look(self) -> None:
        self.now = [*self._still, *(walker.obstacle for walker in self._walkers)]
        self.edges: Array = np.concatenate([NO_SEGMENTS, *(each.edges for each in self.now)])
        self.ends: Indices = np.cumsum([0, *(len(each.edges) for each in self.now)])
        circles = [(*each.middle, each.radius) for each in self.now]
        self.circles: Array = np.array(circles).reshape(-1, 3)


def _obstacle(name: str, area: BaseGeometry) -> Obstacle:
    x_min, y_min, x_max, y_max = area.bounds
    middle = ((x_min + x_max) / 2, (y_min + y_max) / 2)
    return Obstacle(name, outline_of(area), middle, math.dist(middle, (x_max, y_max)))
