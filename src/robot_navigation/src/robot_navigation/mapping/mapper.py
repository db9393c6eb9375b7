# SPDX-License-Identifier: BSD-3-Clause
"""Makes a map from scans and from odometry that drifts (the report's mapping run, 4.6.3)."""

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

FAR_ENOUGH = 0.1
"""A scan is taken in once the robot has moved so far since the last one [m] ..."""

TURNED_ENOUGH = 0.1
"""... or has turned so far [rad]."""

GROUP = 0.5
"""Scans that were taken within so much of each other [m, rad] stay as they are to each other when
all are fitted to each other."""

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


@dataclass(frozen=True)
class Taken:
    """A scan that is on the map.

    Attributes:
        odometry: Where the wheels had the robot's base, frame odom.
        pose: Where it was put down, frame map.
        ranges: (n,) what the laser measured [m].
    """

    odometry: Pose
    pose: Pose
    ranges: Array


class Mapper:
    """Knows where a robot is on the map that it makes.

    Attributes:
        grid: What is known by now.
        pose: Of the robot's base, frame map.
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
        self._log: list[Taken] = []
        self._beams = beams
        self._enough = far_enough, turned_enough
        self._surfaces = Surfaces(grid.resolution)
        self._matcher = ScanMatcher(self._surfaces)
        self._odometry: Pose | None = None
        self._taken: Pose | None = None

    @property
    def scans(self) -> int:
        """How many scans have been taken in."""
        return len(self._log)

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
        self.pose = self._fitted(ranges)
        self._log.append(Taken(odometry, self.pose, ranges))
        self._draw(self._log[-1])
        return True

    def refine(self) -> None:
        """Fit all that was seen to each other, and draw the map anew; it may take a minute.

        What the robot does next is drawn into the new map.
        """
        groups = self._groups()
        if not groups:
            return
        sightings = [Sighting(g[0].odometry, g[0].pose, self._seen(g)) for g in groups]
        self._log.clear()
        self._surfaces.clear()
        self.grid.clear()
        for group, pose in zip(groups, refined(sightings), strict=True):
            shift = compose(pose, inverse(group[0].pose))
            for each in group:
                self._log.append(replace(each, pose=compose(shift, each.pose)))
                self._draw(self._log[-1])
        self.pose = compose(shift, self.pose)

    def _groups(self) -> list[list[Taken]]:
        """Return the scans in groups of those that were taken near each other, one by one."""
        groups: list[list[Taken]] = []
        for each in self._log:
            if groups:
                move = between(groups[-1][0].pose, each.pose)
                if math.hypot(move.x, move.y) < GROUP and abs(move.yaw) < GROUP:
                    groups[-1].append(each)
                    continue
            groups.append([each])
        return groups

    def _seen(self, group: list[Taken]) -> Surface | None:
        """Return what a group of scans shows, seen from where the robot took the first one."""
        surfaces = Surfaces(self.grid.resolution)
        for each in group:
            laser = compose(between(group[0].pose, each.pose), self._beams.mount)
            surfaces.add(_from(laser, self._points(each.ranges)), laser[:2])
        return surfaces.around(0.0, 0.0, math.inf)

    def _fitted(self, ranges: Array) -> Pose:
        """Return where the robot is if its scan fits what is known."""
        beams, points = self._beams, self._points(ranges)
        every = max(1, math.ceil(len(points) / BEAMS))
        found = self._matcher.fit(
            compose(self.pose, beams.mount), points[::every], beams.range_max
        )
        return compose(found, inverse(beams.mount))

    def _draw(self, taken: Taken) -> None:
        """Put a scan on the map."""
        beams, ranges = self._beams, taken.ranges
        laser = compose(taken.pose, beams.mount)
        self.grid.add(laser, beams.angles, ranges, beams.range_max)
        self._surfaces.add(_from(laser, self._points(ranges)), laser[:2])

    def _points(self, ranges: Array) -> Array:
        """Return where the beams ended (k, 2), seen from the laser [m]."""
        hit = (ranges > 0) & (ranges < self._beams.range_max)
        reach, angles = ranges[hit], self._beams.angles[hit]
        points: Array = np.stack([reach * np.cos(angles), reach * np.sin(angles)], axis=1)
        return points


def _from(frame: Pose, points: Array) -> Array:
    """Return points (k, 2) given in a frame as they are in the frame of its pose."""
    cos, sin = math.cos(frame.yaw), math.sin(frame.yaw)
    turned: Array = points @ np.array([[cos, sin], [-sin, cos]]) + frame[:2]
    return turned
