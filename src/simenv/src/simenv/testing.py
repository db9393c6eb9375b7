# SPDX-License-Identifier: BSD-3-Clause
"""A small world for tests: a square hall with four walls, and a crowd of robots in it."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
import shapely.geometry

from robot_description.models import load_model
from simenv.simulation import Simulation
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


def crowd(seed: int) -> bytes:
    """Let robots drive into each other for 2.5 s; return all that they did and measured."""
    simulation = Simulation(hall(), seed=seed)
    for index, name in enumerate(("mir100", "ld60", "youbot", "fetch")):
        simulation.add_robot(f"robot{index}", load_model(name), (2.0 + 1.5 * index, 2.0, 1.5))
    taken = []
    for _ in range(100):
        for index, name in enumerate(simulation.names):
            simulation.set_command(name, 0.9, 0.1 * index, 0.6 - 0.4 * index)
        simulation.step()
        taken += [
            np.array([simulation.poses[n], simulation.odometry(n)]) for n in simulation.names
        ]
    taken += simulation.scans(simulation.names)
    return b"".join(each.tobytes() for each in taken)
