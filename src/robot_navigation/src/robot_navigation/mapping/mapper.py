# SPDX-License-Identifier: BSD-3-Clause
"""Makes a map from scans and drifting odometry (the report's mapping run, 4.6.3)."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from hive_common.pose import Pose, between, compose, inverse
from robot_navigation.mapping.refinement import Sighting, refined
from robot_navigation.mapping.scan_matcher import ScanMatcher
from robot_navigation.mapping.surfaces import Surfaces

if TYPE_CHECKING:
    from hive_common.geometry import Array
    from robot_description.models import Laser
    from robot_navigation.mapping.occupancy import OccupancyGrid
    from robot_navigation.mapping.surfaces import Surface

GROUP = 0.5
"""Scans taken within this distance and angle of each other [m], [rad] keep their relative poses
when the map is refined."""

MAX_BEAMS = 720  # number of evenly spread beams that are matched; all are drawn


@dataclass(frozen=True)
class Beams:
    """The geometry of a laser."""

    angles: Array  # (n,) directions of the beams relative to the laser [rad]
    range_max: float  # how far the laser sees [m]
    mount: Pose  # pose of the laser in the robot's base frame

    @classmethod
    def of(cls, laser: Laser) -> Beams:
        """Return the geometry of a robot model's laser."""
        angles = (np.arange(laser.beams) / laser.beams - 0.5) * laser.field_of_view
        return cls(angles, laser.range_max, Pose(*laser.pose))


@dataclass(frozen=True)
class MappedScan:
    """A scan on the map."""

    odometry: Pose  # the robot's base by odometry, frame odom
    pose: Pose  # the robot's base, frame map
    ranges: Array  # (n,) what the laser measured [m]


class Mapper:
    """Estimates where a robot is on the map that it makes."""

    def __init__(
        self,
        beams: Beams,
        start: Pose,
        grid: OccupancyGrid,
        min_distance: float = 0.1,
        min_turn: float = 0.1,
    ) -> None:
        """Start at a pose, which fixes the frame map, with a map that may be empty.

        A scan is used once the robot has moved `min_distance` [m] or turned `min_turn` [rad].
        """
        self.grid = grid  # the map so far
        self.pose = start  # the robot's base, frame map
        self._log: list[MappedScan] = []
        self._beams = beams
        self._min_move = min_distance, min_turn
        self._surfaces = Surfaces(grid.resolution)
        self._matcher = ScanMatcher(self._surfaces)
        self._odometry: Pose | None = None
        self._used: Pose | None = None

    @property
    def scans(self) -> int:
        """Number of scans on the map."""
        return len(self._log)

    @property
    def correction(self) -> Pose:
        """The transform map -> odom."""
        here = self._odometry
        return compose(self.pose, inverse(here)) if here is not None else self.pose

    def see(self, odometry: Pose, ranges: Array) -> bool:
        """Take in a scan at a pose by odometry, frame odom; return whether it was used.

        `ranges` (n,) are what the laser measured [m], see `OccupancyGrid.add`.
        """
        if self._odometry is not None:
            self.pose = compose(self.pose, between(self._odometry, odometry))
        self._odometry = odometry
        if self._used is not None:
            move, (min_distance, min_turn) = between(self._used, odometry), self._min_move
            if math.hypot(move.x, move.y) < min_distance and abs(move.yaw) < min_turn:
                return False
        self._used = odometry
        self.pose = self._matched(ranges)
        self._log.append(MappedScan(odometry, self.pose, ranges))
        self._draw(self._log[-1])
        return True

    def refine(self) -> None:
        """Match all scans to each other and redraw the map; this may take a minute."""
        groups = self._groups()
        if not groups:
            return
        sightings = [Sighting(g[0].odometry, g[0].pose, self._surface(g)) for g in groups]
        self._log.clear()
        self._surfaces.clear()
        self.grid.clear()
        for group, pose in zip(groups, refined(sightings), strict=True):
            shift = compose(pose, inverse(group[0].pose))
            for scan in group:
                self._log.append(replace(scan, pose=compose(shift, scan.pose)))
                self._draw(self._log[-1])
        self.pose = compose(shift, self.pose)

    def _groups(self) -> list[list[MappedScan]]:
        """Return the scans in groups of successive ones that were taken near each other."""
        groups: list[list[MappedScan]] = []
        for scan in self._log:
            if groups:
                move = between(groups[-1][0].pose, scan.pose)
                if math.hypot(move.x, move.y) < GROUP and abs(move.yaw) < GROUP:
                    groups[-1].append(scan)
                    continue
            groups.append([scan])
        return groups

    def _surface(self, group: list[MappedScan]) -> Surface | None:
        """Return what a group of scans shows, relative to the pose of its first scan."""
        surfaces = Surfaces(self.grid.resolution)
        for scan in group:
            laser = compose(between(group[0].pose, scan.pose), self._beams.mount)
            surfaces.add(_from(laser, self._points(scan.ranges)), laser[:2])
        return surfaces.around(0.0, 0.0, math.inf)

    def _matched(self, ranges: Array) -> Pose:
        """Return where the robot is if its scan matches the map."""
        beams, points = self._beams, self._points(ranges)
        every = max(1, math.ceil(len(points) / MAX_BEAMS))
        found = self._matcher.fit(
            compose(self.pose, beams.mount), points[::every], beams.range_max
        )
        return compose(found, inverse(beams.mount))

    def _draw(self, scan: MappedScan) -> None:
        """Draw a scan on the map."""
        beams, ranges = self._beams, scan.ranges
        laser = compose(scan.pose, beams.mount)
        self.grid.add(laser, beams.angles, ranges, beams.range_max)
        self._surfaces.add(_from(laser, self._points(ranges)), laser[:2])

    def _points(self, ranges: Array) -> Array:
        """Return the ends of the beams (k, 2), relative to the laser [m]."""
        hit = (ranges > 0) & (ranges < self._beams.range_max)
        reach, angles = ranges[hit], self._beams.angles[hit]
        points: Array = np.stack([reach * np.cos(angles), reach * np.sin(angles)], axis=1)
        return points


def _from(frame: Pose, points: Array) -> Array:
    """Return points (k, 2) of a frame in the frame that its pose is given in."""
    cos, sin = math.cos(frame.yaw), math.sin(frame.yaw)
    turned: Array = points @ np.array([[cos, sin], [-sin, cos]]) + frame[:2]
    return turned
