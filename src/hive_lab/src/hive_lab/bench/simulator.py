# SPDX-License-Identifier: BSD-3-Clause
"""Measures how fast simulated time can pass in this process; `live.simulator` does so on ROS."""

from __future__ import annotations

import itertools
import time
from typing import TYPE_CHECKING

import numpy as np

from hive_common.pose import Pose
from robot_description.models import load_model
from simenv.errors import SpawnError
from simenv.simulation import STEP, Simulation
from simenv.world.world_file import load_world

if TYPE_CHECKING:
    from hive_common.geometry import Array

NUMBERS = (1, 4, 20, 100)  # numbers of robots
MODELS = ("mir100", "ld60", "youbot", "fetch")

SCANS = 10.0  # scans of each robot [Hz, simulated]
WALL_TIME = 3.0  # duration of each case [s, wall clock]

_WALL = "wall seconds per simulated second, {} robots"

AIMS = {_WALL.format(4): 0.01, _WALL.format(100): 0.25}
"""100 and 4 times real time, on one core, with lasers and with robots in contact."""


def spawn_robots(number: int) -> Simulation:
    """Spawn robots of alternating models in the warehouse, row by row wherever there is room."""
    simulation = Simulation(load_world("warehouse"), seed=1)
    width, depth = simulation.world.size
    places = itertools.product(np.arange(1.0, depth, 1.5), np.arange(1.0, width, 1.5))
    for y, x in places:
        index = len(simulation.names)
        if index == number:
            break
        model = load_model(MODELS[index % len(MODELS)])
        try:
            simulation.add_robot(f"robot{index + 1}", model, Pose(float(x), float(y), 0.0))
        except SpawnError:
            continue
    return simulation


def drive(simulation: Simulation, seconds: float, *, lasers: bool) -> float:
    """Let all robots drive for a time [s, wall clock]; return the simulated time passed [s]."""
    names = simulation.names
    turns: Array = np.linspace(-0.8, 0.8, len(names))
    between = round(1.0 / (SCANS * STEP))
    began, start = time.perf_counter(), simulation.time
    for step in itertools.count():
        if time.perf_counter() - began >= seconds:
            break
        if step % between == 0:
            for index, name in enumerate(names):
                stuck = bool(simulation.bumper(name))
                simulation.set_command(name, vx=-0.3 if stuck else 0.5, wz=float(turns[index]))
        if lasers and (due := names[-step % between :: between]):
            simulation.scans(due)
        simulation.step()
    return (simulation.time - start) / (time.perf_counter() - began) * seconds


def measure_in_process(wall_time: float = WALL_TIME) -> dict[str, float]:
    """Measure each case for a time [s, wall clock].

    All robots drive all the time. The simulation moves them in steps of `STEP`, stops them at
    walls and at each other, and measures their odometry with noise. With lasers, each takes 10
    scans a simulated second, of 720 beams with noise each, a quarter of the robots in each step.
    Commands and bumpers are asked for at 10 Hz, as a control loop does.

    Returns:
        For each number of robots: `wall seconds per simulated second, N robots` with lasers, and
        `..., N robots without lasers`; `speed_lasers_N` and `speed_bare_N`, the inverse; the same
        with `cpu_`, simulated seconds in one of processor time, which depends less on other work
        of the machine; and `contacts_N`, how many contacts began in the run with lasers.
    """
    figures: dict[str, float] = {}
    for number, lasers in itertools.product(NUMBERS, (True, False)):
        name = f"{'lasers' if lasers else 'bare'}_{number}"
        simulation = spawn_robots(number)
        cpu = time.process_time()
        passed = drive(simulation, wall_time, lasers=lasers)
        cpu = time.process_time() - cpu
        figures[_WALL.format(number) + ("" if lasers else " without lasers")] = wall_time / passed
        figures[f"speed_{name}"] = passed / wall_time
        figures[f"cpu_{name}"] = passed / cpu
        if lasers:
            figures[f"contacts_{number}"] = simulation.collisions
    return figures
