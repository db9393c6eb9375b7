# SPDX-License-Identifier: BSD-3-Clause
"""Lasers of several makes: a robot sees the same with each, and drives with each."""

from __future__ import annotations

import itertools
import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
import pytest

pytest.importorskip("ompl")

from attrs import evolve

from hive_common.map_file import load_map
from hive_common.pose import Pose
from hive_lab.fleets.traffic import Traffic
from hive_navigation.control.obstacle_check import ObstacleCheck, VisibleObstacles, points_seen
from hive_navigation.localization.likelihood_field import BeamChooser
from hive_navigation.mapping.mapper import Mapper
from hive_navigation.mapping.occupancy import OccupancyGrid
from hive_navigation.planning.path import Path
from robot_description.models import load_model
from robot_description.scan import Scan
from simenv.simulation import Simulation
from simenv.world.world_file import load_world

if TYPE_CHECKING:
    from hive_common.geometry import Array

MODEL = load_model("ld60")


@dataclass(frozen=True)
class Lidar:
    """How a make of laser describes its scans."""

    first: float  # [rad]
    step: float  # [rad]
    beams: tuple[int, ...]  # of each scan in turn

    def measure(self, true: Scan, beams: int) -> Scan:
        """Return what it measures where a scan all around, counter-clockwise, is true."""
        angles = self.first + self.step * np.arange(beams)
        nearest = np.rint((angles - true.angle_min) / true.angle_increment).astype(int)
        return Scan(self.first, self.step, true.ranges[nearest % len(true.ranges)], true.range_max)


TURN = math.tau
LIDARS = {
    "all around from -pi": Lidar(-math.pi, TURN / 720, (720,)),
    "LDS-01 of the TurtleBot3, from 0": Lidar(0.0, TURN / 360, (360,)),
    "LDS-02, which counts other beams each turn": Lidar(0.0, TURN / 240, (240, 237, 239)),
    "RPLIDAR A1, which measures one direction twice": Lidar(-math.pi, TURN / 359, (360,)),
    "YDLIDAR X4, mounted upside down": Lidar(math.pi, -TURN / 500, (500,)),
    "Hokuyo UTM-30LX, 270 degrees": Lidar(-2.3562, 0.0043633, (1081,)),
}
MAKES = pytest.mark.parametrize("lidar", LIDARS.values(), ids=LIDARS)


def a_wall_ahead() -> Scan:
    """Return a scan all around of a wall 2 m ahead, from 0.6 m to the left to 0.6 m to the right.

    The laser looks 0.5 rad to the left of the robot's heading, so the wall is to its right.
    """
    angles = np.arange(7200) / 7200 * TURN - math.pi
    bearing = angles + 0.5
    hit = (np.abs(bearing) < 1.5) & (np.abs(2.0 * np.tan(bearing)) < 0.6)
    return Scan(-math.pi, TURN / 7200, np.where(hit, 2.0 / np.cos(bearing), np.inf), 6.0)


def is_the_wall(points: Array) -> bool:
    """Return whether points (n, 2) lie on the wall ahead and show both of its ends."""
    x, y = points.T
    on_it = np.abs(x - 2.0) < 0.05
    return bool(on_it.all() and y.min() == pytest.approx(-0.6, abs=0.07) and 0.53 < y.max() < 0.65)


@MAKES
def test_localization_mapping_and_the_obstacle_check_see_a_wall_where_it_is(lidar: Lidar) -> None:
    laser = evolve(MODEL.laser, pose=Pose(0.0, 0.0, 0.5))
    grid = OccupancyGrid((8.0, 8.0), (-4.0, -4.0), 0.05)
    for beams in lidar.beams:
        scan = lidar.measure(a_wall_ahead(), beams)
        mapper = Mapper(laser.pose, Pose(0.0, 0.0, 0.0), grid)

        seen = points_seen(laser, scan, Pose(0.0, 0.0, 0.0))
        chosen = BeamChooser(laser, 2000).of(scan)
        assert mapper.see(Pose(0.0, 0.0, 0.0), scan)

        rows, columns = np.nonzero(grid.odds > 0)
        drawn = np.stack([columns, rows], axis=1) * 0.05 + grid.origin
        assert is_the_wall(seen)
        assert is_the_wall(chosen.ends)
        assert is_the_wall(drawn)


class _WithLidars(Traffic):
    """Robots whose lasers are of another make."""

    def __init__(self, simulation: Simulation, lidar: Lidar) -> None:
        super().__init__(simulation, load_map("lab"))
        self._lidar = lidar
        self._counts = itertools.cycle(lidar.beams)

    def scan_of(self, name: str, ranges: Array) -> Scan:
        return self._lidar.measure(super().scan_of(name, ranges), next(self._counts))


@MAKES
def test_a_robot_drives_with_any_make_of_laser(lidar: Lidar) -> None:
    all_around = evolve(MODEL.laser, field_of_view=TURN, beams=1440)
    simulation = Simulation(load_world("lab"), seed=1)
    traffic = _WithLidars(simulation, lidar)
    traffic.add("robot1", evolve(MODEL, laser=all_around), (2.6, 4.0, 0.0))
    traffic.send("robot1", (12.0, 3.0, 0.0))

    assert traffic.run(40.0)
    assert traffic.outcomes["robot1"].reached
    assert simulation.collisions == 0


def test_a_laser_that_sees_less_far_than_its_model_says_makes_the_robot_slower() -> None:
    check, path = ObstacleCheck(MODEL.base, MODEL.laser), Path([(0.0, 0.0), (9.0, 0.0)])
    nothing = np.empty((0, 2))

    rooms = [
        check.room_ahead(path, 0.0, Pose(0.0, 0.0, 0.0), VisibleObstacles(nothing, nothing, far))
        for far in (MODEL.laser.range_max + 1.0, MODEL.laser.range_max, 1.5)
    ]

    assert rooms[0] == rooms[1] == check.most_room
    assert rooms[2] == pytest.approx(check.most_room - (MODEL.laser.range_max - 1.5) / 2)
