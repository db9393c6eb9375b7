# SPDX-License-Identifier: BSD-3-Clause
"""How fast simulated time passes in this process, with few robots and with many.

All robots drive all the time, each along a curve of its own through a hall; a robot that runs into
something turns away. With lasers each takes a scan ten times a simulated second.
"""

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

NUMBERS = (1, 4, 20, 100)
"""How many robots are tried."""

MODELS = ("mir100", "ld60", "youbot", "fetch")

SCANS = 10.0
"""Scans of each robot in a simulated second [Hz]."""

WALL_TIME = 3.0
"""How long each case is measured [s, wall clock]."""

AIMS = {"lasers_4": 0.01, "lasers_100": 0.25}
"""Wall time for a simulated second, at most [s]: 100 and 4 times real time."""


def crowd(number: int) -> Simulation:
    """Put some robots into the warehouse, row by row wherever there is room.

    Args:
        number: Of robots; the models take turns.
    """
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
    """Let all robots drive for a time on the wall; return how much simulated time passed [s].

    Args:
        simulation: The robots.
        seconds: How long [s, wall clock].
        lasers: Whether they take scans.
    """
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


def run(wall_time: float = WALL_TIME) -> dict[str, dict[str, float]]:
    """Measure.

    Args:
        wall_time: How long each case is measured [s, wall clock].

    Returns:
        `{"figures": {...}, "aims": {...}}`: for each number of robots `lasers_N` and `bare_N`,
        wall time for a simulated second with lasers and without [s], and `speed_...`, the same the
        other way round: simulated seconds in one on the wall; and `cpu_...`, simulated
        seconds in one of processor time, which other work on the machine changes less.
    """
    figures: dict[str, float] = {}
    for number, lasers in itertools.product(NUMBERS, (True, False)):
        name = f"{'lasers' if lasers else 'bare'}_{number}"
        simulation, cpu = crowd(number), time.process_time()
        passed = drive(simulation, wall_time, lasers=lasers)
        cpu = time.process_time() - cpu
        speed = passed / wall_time
        figures[name] = 1.0 / speed
        figures[f"speed_{name}"] = speed
        figures[f"cpu_{name}"] = passed / cpu
    return {"figures": figures, "aims": AIMS}
