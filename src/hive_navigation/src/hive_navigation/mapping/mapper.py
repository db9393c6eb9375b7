# SPDX-License-Identifier: BSD-3-Clause
"""Makes a map from scans and drifting odometry (the report's mapping run, 4.6.3)."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from hive_common.pose import Pose, between, compose, inverse
from hive_navigation.mapping.refinement import Sighting, refined
from hive_navigation.mapping.scan_matcher import ScanMatcher
from hive_navigation.mapping.surfaces import Surfaces

if TYPE_CHECKING:
    from hive_common.geometry import Array
    from hive_navigation.mapping.occupancy import OccupancyGrid
    from hive_navigation.mapping.surfaces import Surface
    from robot_description.scan import Scan

GROUP = 0.5
"""Scans taken within this distance and angle of each other [m], [rad] keep their relative poses
when the map is refined."""

MAX_BEAMS = 720  # number of evenly spread beams that are matched; all are drawn


@dataclass(frozen=True)
class MappedScan:
    """A scan on the map."""

    odometry: Pose  # the robot's base by odometry, frame odom
    pose: Pose  # the robot's base, frame map
    scan: Scan  # what the laser measured


class Mapper:
    """Estimates where a robot is on the map that it makes."""

    def __init__(
        self,
        mount: Pose,
        start: Pose,
        grid: OccupancyGrid,
        min_distance: float = 0.1,
        min_turn: float = 0.1,
    ) -> None:
        """Start at a pose, which fixes the frame map, with a map that may be empty.

        The laser is at `mount` in the robot's base frame. A scan is used once the robot has moved
        `min_distance` [m] or turned `min_turn` [rad].
        """
        self.grid = grid  # the map so far
        self.pose = start  # the robot's base, frame map
        self._log: list[MappedScan] = []
        self._mount = mount
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

    def see(self, odometry: Pose, scan: Scan) -> bool:
        """Take in a scan at a pose by odometry, frame odom; return whether it was used."""
        if self._odometry is not None:
            self.pose = compose(self.pose, between(self._odometry, odometry))
        self._odometry = odometry
        if self._used is not None:
            move, (min_distance, min_turn) = between(self._used, odometry), self._min_move
            if math.hypot(move.x, move.y) < min_distance and abs(move.yaw) < min_turn:
                return False
        self._used = odometry
        self.pose = self._matched(scan)
        self._log.append(MappedScan(odometry, self.pose, scan))
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
            for mapped in group:
                self._log.append(replace(mapped, pose=compose(shift, mapped.pose)))
                self._draw(self._log[-1])
        self.pose = compose(shift, self.pose)

    def _groups(self) -> list[list[MappedScan]]:
        """Return the scans in groups of successive ones that were taken near each other."""
        groups: list[list[MappedScan]] = []
        for mapped in self._log:
            if groups:
                move = between(groups[-1][0].pose, mapped.pose)
                if math.hypot(move.x, move.y) < GROUP and abs(move.yaw) < GROUP:
                    groups[-1].append(mapped)
                    continue
            groups.append([mapped])
        return groups

    def _surface(self, group: list[MappedScan]) -> Surface | None:
        """Return what a group of scans shows, relative to the pose of its first scan."""
        surfaces = Surfaces(self.grid.resolution)
        for mapped in group:
            laser = compose(between(group[0].pose, mapped.pose), self._mount)
            surfaces.add(_from(laser, _points(mapped.scan)), laser[:2])
        return surfaces.around(0.0, 0.0, math.inf)

    def _matched(self, scan: Scan) -> Pose:
        """Return where the robot is if its scan matches the map."""
        points = _points(scan)
        every = max(1, math.ceil(len(points) / MAX_BEAMS))
        found = self._matcher.fit(compose(self.pose, self._mount), points[::every], scan.range_max)
        return compose(found, inverse(self._mount))

    def _draw(self, mapped: MappedScan) -> None:
        """Draw a scan on the map."""
        scan, laser = mapped.scan, compose(mapped.pose, self._mount)
        self.grid.add(laser, scan.angles, scan.ranges, scan.range_max)
        self._surfaces.add(_from(laser, _points(scan)), laser[:2])


def _points(scan: Scan) -> Array:
    """Return the ends of the beams (k, 2), relative to the laser [m]."""
    hit = np.isfinite(scan.ranges)
    reach, angles = scan.ranges[hit], scan.angles[hit]
    points: Array = np.stack([reach * np.cos(angles), reach * np.sin(angles)], axis=1)
    return points


def _from(frame: Pose, points: Array) -> Array:
    """Return points (k, 2) of a frame in the frame that its pose is given in."""
    cos, sin = math.cos(frame.yaw), math.sin(frame.yaw)
    turned: Array = points @ np.array([[cos, sin], [-sin, cos]]) + frame[:2]
    return turned
