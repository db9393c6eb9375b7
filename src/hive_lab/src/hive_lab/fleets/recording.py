# SPDX-License-Identifier: BSD-3-Clause
"""Drives that are recorded once and looked at many times: what a robot senses, and the truth."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from hive_lab.fleets.traffic import Traffic
from simenv.simulation import Simulation

if TYPE_CHECKING:
    from collections.abc import Sequence

    from hive_common.geometry import Array
    from hive_common.map_file import GridMap
    from hive_common.pose import Pose
    from robot_description.models import RobotModel
    from simenv.world.world import World

STEPS_PER_LOOK = 4
"""The robot looks about at 10 Hz."""

PATIENCE = 120.0
"""Longest time for one goal [s]."""


@dataclass(frozen=True)
class Look:
    """What a robot sensed at one moment.

    Attributes:
        time: [s]
        truth: Where it really was, frame map.
        odometry: Where its wheels said it was, frame odom.
        ranges: (beams,) what its laser measured [m].
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
    """Drive a robot through a world and record what it senses.

    It is steered by its true pose, so that the record is the same whatever reads it later.

    Args:
        world: The world.
        grid: Its map.
        model: What the robot is.
        stops: Where it starts, and its goals in order, frame map [m, m, rad].
        seed: Of the noise of its senses.

    Returns:
        A look every 0.1 s.
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
