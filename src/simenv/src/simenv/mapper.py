# SPDX-License-Identifier: BSD-3-Clause
"""Makes a map from scans and from odometry that drifts (the report's mapping run, 4.6.3)."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from robot_description.follower import Pose
from robot_description.poses import between, compose, inverse
from simenv.scan_matcher import ScanMatcher
from simenv.surfaces import Surfaces

if TYPE_CHECKING:
    from robot_description.models import Laser
    from simenv.geometry import Array
    from simenv.occupancy import OccupancyGrid

FAR_ENOUGH = 0.1
"""A scan is taken in once the robot has moved so far since the last one [m] ..."""

TURNED_ENOUGH = 0.1
"""... or has turned so far [rad]."""

BEAMS = 720
"""So many beams, spread evenly, are fitted at most; all are drawn."""


@dataclass(frozen=True)
class Beams:
    """Where a laser looks.

    Attributes:
        angles: (n,) directions of the beams from the laser's own heading [rad].
        range_max: What is farther away is not seen [m].
        mount: Where the laser is on the robot, from its base.
    """

    angles: Array
    range_max: float
    mount: Pose

    @classmethod
    def of(cls, laser: Laser) -> Beams:
        """Return those of a robot model's laser."""
        angles = (np.arange(laser.beams) / laser.beams - 0.5) * laser.field_of_view
        return cls(angles, laser.range_max, Pose(*laser.pose))


class Mapper:
    """Knows where a robot is on the map that it makes.

    Attributes:
        grid: What is known by now.
        pose: Of the robot's base, frame map.
        scans: How many scans have been taken in.
    """

    def __init__(
        self,
        beams: Beams,
        start: Pose,
        grid: OccupancyGrid,
        far_enough: float = FAR_ENOUGH,
        turned_enough: float = TURNED_ENOUGH,
    ) -> None:
        """Begin with what is known of the plane, which may be nothing.

        Args:
            beams: Of the robot's scanner.
            start: Where the robot stands; this fixes the frame map.
            grid: Where the map is drawn; it grows.
            far_enough: See `FAR_ENOUGH` [m].
            turned_enough: See `TURNED_ENOUGH` [rad].
        """
        self.grid = grid
        self.pose = start
        self.scans = 0
        self._beams = beams
        self._enough = far_enough, turned_enough
        self._surfaces = Surfaces(grid.resolution)
        self._matcher = ScanMatcher(self._surfaces)
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
            ranges: (n,) what its laser measures [m], see `OccupancyGrid.add`.

        Returns:
            Whether the scan was taken into the map.
        """
        if self._odometry is not None:
            self.pose = compose(self.pose, between(self._odometry, odometry))
        self._odometry = odometry
        if self._taken is not None:
            move, (far, turned) = between(self._taken, odometry), self._enough
            if math.hypot(move.x, move.y) < far and abs(move.yaw) < turned:
                return False
        self._taken = odometry
        self._fit(ranges)
        beams = self._beams
        laser = compose(self.pose, beams.mount)
        self.grid.add(laser, beams.angles, ranges, beams.range_max)
        self.scans += 1
        return True

    def _fit(self, ranges: Array) -> None:
        """Put the robot where its scan fits what is known, and keep what it shows."""
        beams = self._beams
        hit = (ranges > 0) & (ranges < beams.range_max)
        reach, angles = ranges[hit], beams.angles[hit]
        points = np.stack([reach * np.cos(angles), reach * np.sin(angles)], axis=1)
        every = max(1, math.ceil(len(points) / BEAMS))
        found = self._matcher.fit(
            compose(self.pose, beams.mount), points[::every], beams.range_max
        )
        cos, sin = math.cos(found.yaw), math.sin(found.yaw)
        self._surfaces.add(points @ np.array([[cos, sin], [-sin, cos]]) + found[:2], found[:2])
        self.pose = compose(found, inverse(beams.mount))
