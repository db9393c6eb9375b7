# SPDX-License-Identifier: BSD-3-Clause
"""Many robots that drive in one hall, for tests and benchmarks of navigation.

Every robot gets a random goal and the next one as soon as it has ended. All have lasers, and
everything runs in this process: the simulator, the planner, the follower and the right of way.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np
import shapely.geometry

from hive_lab.fleets.traffic import STEP, Traffic
from robot_description.models import load_model
from robot_navigation.planning.clearance import ClearanceField
from simenv.errors import SpawnError
from simenv.simulation import Simulation
from simenv.world.draw_map import draw_map
from simenv.world.shapes import Shape
from simenv.world.world import World

if TYPE_CHECKING:
    from hive_common.geometry import Array
    from hive_common.grid_map import GridMap

SIZE = (42.0, 25.0)  # of the hall [m]
WALL = 0.2  # thickness of its walls [m]
RACKS = [(x, y, x + 6.0, y + 1.0) for y in (8.0, 16.0) for x in (4.0, 13.0, 23.0, 32.0)]
MODELS = ("mir100", "ld60", "youbot", "fetch")
ROOM = 0.8  # distance of a goal from walls and racks [m]
APART = 1.6  # distance of two starts [m]


def world() -> World:
    """Return a hall with eight racks."""
    width, depth = SIZE
    room = shapely.geometry.box(WALL, WALL, width - WALL, depth - WALL)
    walls = shapely.geometry.box(0.0, 0.0, width, depth).difference(room)
    racks = [
        Shape(f"rack {number}", shapely.geometry.box(*corners), "racks")
        for number, corners in enumerate(RACKS, start=1)
    ]
    return World("hall", SIZE, (Shape("walls", walls), *racks))


class Crowd:
    """Robots of all models in the hall, each with a goal.

    Attributes:
        simulation: The world and the robots' bodies.
        traffic: The robots' navigation.
    """

    def __init__(self, robots: int, seed: int = 1) -> None:
        hall = world()
        self.simulation = Simulation(hall, seed=seed)
        # Nothing is unknown: no named place says from where the hall can be seen.
        grid = draw_map(hall)
        grid.cells[grid.cells < 0] = 0
        self.traffic = Traffic(self.simulation, grid)
        self._random = np.random.default_rng(seed)
        self._places = _free_places(grid)
        while len(self.simulation.names) < robots:
            number = len(self.simulation.names)
            pose = self._pose()
            near = min(
                (math.dist(pose[:2], other[:2]) for other in self.simulation.poses.values()),
                default=math.inf,
            )
            if near < APART:
                continue
            try:
                self.traffic.add(f"robot{number + 1}", load_model(MODELS[number % 4]), pose)
            except SpawnError:
                continue

    def run(self, seconds: float) -> None:
        """Let a simulated time [s] pass."""
        for _ in range(round(seconds / STEP)):
            for name, navigator in self.traffic.navigators.items():
                if navigator.goal is None:
                    self.traffic.send(name, self._pose())
            self.traffic.step()

    def _pose(self) -> tuple[float, float, float]:
        """Return a random pose at which every model can stand."""
        x, y = self._random.choice(self._places)
        return float(x), float(y), float(self._random.uniform(-math.pi, math.pi))


def _free_places(grid: GridMap) -> Array:
    """Return places where every model can stand (n, 2), frame map [m]."""
    rows, columns = np.nonzero(ClearanceField.of(grid).clearance >= ROOM)
    places: Array = (np.column_stack([columns, rows]) + 0.5) * grid.resolution
    return places
