# SPDX-License-Identifier: BSD-3-Clause
"""Makes a map from scans and from odometry that drifts (the report's mapping run, 4.6.3)."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from robot_description.poses import between, compose, inverse
from simenv.occupancy import OccupancyGrid
from simenv.scan_matcher import ScanMatcher

if TYPE_CHECKING:
    from robot_description.follower import Pose
    from robot_description.models import Laser
    from simenv.geometry import Array

RESOLUTION = 0.05
"""Side of a cell [m]."""

FAR_ENOUGH = 0.1
"""A scan is taken in once the robot has moved so far since the last one [m] ..."""

TURNED_ENOUGH = 0.1
"""... or has turned so far [rad]."""

MARGIN = 0.5
"""By how much the map that is fitted to is larger than the laser's range [m]."""

BEAMS = 240
"""So many beams, spread evenly, are fitted; all are drawn."""


class Mapper:
    """Knows where a robot is on the map that it makes.

    Attributes:
        grid: What is known by now.
        pose: Of the robot's base, frame map.
        scans: How many scans have been taken in.
    """

    def __init__(
        self,
        laser: Laser,
        start: Pose,
        size: tuple[float, float],
        origin: tuple[float, float] = (0.0, 0.0),
        resolution: float = RESOLUTION,
    ) -> None:
        """Begin with an empty map.

        Args:
            laser: The robot's scanner.
            start: Where the robot stands; this fixes the frame map.
            size: Of the map [m].
            origin: x, y of its lower left corner, frame map [m].
            resolution: Side of a cell [m].
        """
        self.grid = OccupancyGrid(size, origin, resolution)
        self.pose = start
        self.scans = 0
        self._laser = laser
        self._mount = type(start)(*laser.pose)
        self._angles = (np.arange(laser.beams) / laser.beams - 0.5) * laser.field_of_view
        self._matcher = ScanMatcher(self.grid)
        self._odometry: Pose | None = None
        self._taken: Pose | None = None

    @property
    def correction(self) -> Pose:
        """Where the frame odom lies in the frame map."""
        here = self._odometry
        return compose(self.pose, inverse(here)) if here is not None else self.pose

    def see(self, odometry: Pose, ranges: Array) -> bool:
        """Go on with what the robot senses.

        Args:
            odometry: Where its wheels say it is, frame odom.
            ranges: (beams,) what its laser measures [m].

        Returns:
            Whether the scan was taken into the map.
        """
        if self._odometry is not None:
            self.pose = compose(self.pose, between(self._odometry, odometry))
        self._odometry = odometry
        if self._taken is not None:
            move = between(self._taken, odometry)
            if math.hypot(move.x, move.y) < FAR_ENOUGH and abs(move.yaw) < TURNED_ENOUGH:
                return False
        self._taken = odometry
        self._fit(ranges)
        laser = compose(self.pose, self._mount)
        self.grid.add(laser, self._angles, ranges, self._laser.range_max)
        self.scans += 1
        return True

    def _fit(self, ranges: Array) -> None:
        """Put the robot where its scan fits the map."""
        chosen = np.linspace(0, len(ranges), BEAMS, endpoint=False).astype(np.intp)
        reach, angles = ranges[chosen], self._angles[chosen]
        hit = (reach > 0) & (reach < self._laser.range_max)
        # A surface is drawn as the cell behind it, so that is where the beams have to end.
        reach, angles = reach[hit] + self.grid.resolution / 2, angles[hit]
        points = np.stack([reach * np.cos(angles), reach * np.sin(angles)], axis=1)
        self._matcher.look(self.pose, self._laser.range_max + MARGIN)
        found = self._matcher.fit(compose(self.pose, self._mount), points)
        self.pose = compose(found, inverse(self._mount))
