# SPDX-License-Identifier: BSD-3-Clause
"""Drives recorded once for many uses: what a robot senses, and the truth."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from hive_lab.fleets.traffic import Traffic
from simenv.simulation import Simulation

if TYPE_CHECKING:
    from collections.abc import Sequence

    from hive_common.geometry import Array
    from hive_common.grid_map import GridMap
    from hive_common.pose import Pose
    from robot_description.models import RobotModel
    from simenv.world.world import World

STEPS_PER_LOOK = 4  # the robot senses at 10 Hz
PATIENCE = 120.0  # time limit for one goal [s]


@dataclass(frozen=True)
class Look:
    """What a robot sensed at a time [s].

    Attributes:
        truth: Its true pose, frame map.
        odometry: Its pose by its wheels, frame odom.
        ranges: (beams,) measured by its laser [m].
    """

    time: float
    truth: Pose
    odometry: Pose
    ranges: Array


def record_drive(
    world: World,
    grid: GridMap,
    model: RobotModel,
    stops: Sequence[tuple[float, float, float]],
    seed: int,
) -> list[Look]:
    """Drive a robot through a world from the first stop to the others; return a look every 0.1 s.

    The true pose steers the robot, so the record does not depend on its later use. Stops are in
    frame map [m, m, rad].
    """
    simulation = Simulation(world, seed=seed)
    traffic = Traffic(simulation, grid)
    traffic.add("robot1", model, stops[0])
    looks: list[Look] = []
    for goal in stops[1:]:
        traffic.send("robot1", goal)
        end = simulation.time + PATIENCE
        while traffic.navigators["robot1"].goal is not None and simulation.time < end:
            for _ in range(STEPS_PER_LOOK):
                traffic.step()
            looks.append(
                Look(
                    simulation.time,
                    simulation.poses["robot1"],
                    simulation.odometry("robot1"),
                    simulation.scan("robot1"),
                )
            )
    return looks
