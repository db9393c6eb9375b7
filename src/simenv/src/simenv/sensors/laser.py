# SPDX-License-Identifier: BSD-3-Clause
"""What a laser scanner measures in the world.

The beams are cut exactly with the segments near the robot (`beams`). That was measured against
sphere tracing on a distance field of 2 cm, in numpy, from 200 places of the lab: cutting takes a
third of the time, and it is exact where the field is out by 2 cm and rounds corners.
"""

from __future__ import annotations

import itertools
from typing import TYPE_CHECKING

import numpy as np

from hive_common.pose import Pose, compose
from simenv.sensors.beams import Fan, cast

if TYPE_CHECKING:
    from collections.abc import Sequence

    from hive_common.geometry import Array
    from robot_description.models import Laser
    from simenv.bodies.footprints import Footprints
    from simenv.world.surroundings import Surroundings


class Scanner:
    """The laser scanner of one robot.

    Attributes:
        is_covered: Whether something lies on it, so that it measures nothing.
        fan: Its beams.
    """

    def __init__(self, laser: Laser, noise: float, random: np.random.Generator) -> None:
        """Mount a scanner.

        Args:
            laser: What the robot's model says of it.
            noise: Standard deviation of a measured distance [m].
            random: Where the noise comes from.
        """
        self._laser = laser
        self._mount = Pose(*laser.pose)
        self._noise = noise
        self._random = random
        self.is_covered = False
        increment = laser.field_of_view / laser.beams
        self.fan = Fan(-laser.field_of_view / 2, increment, laser.beams)

    @property
    def angles(self) -> Array:
        """The directions (beams,) of its beams, counter-clockwise from its heading [rad]."""
        return self.fan.angles

    @property
    def reach(self) -> float:
        """How far it sees [m]."""
        return self._laser.range_max

    def origin(self, robot: Pose) -> Pose:
        """Return where the scanner is when the robot's base is at `robot`, frame map."""
        return compose(robot, self._mount)

    def measure(self, robot: Pose, segments: Array) -> Array:
        """Take a scan.

        Args:
            robot: Where the robot's base is, frame map.
            segments: (k, 2, 2) what the beams can hit, frame map [m].

        Returns:
            (beams,) distances [m]; see `read`.
        """
        owners = np.zeros(len(segments), dtype=int)
        distances, _ = cast([self.fan], np.array([self.origin(robot)]), segments, owners)
        return self.read(distances)

    def read(self, distances: Array) -> Array:
        """Return what the scanner makes of true distances (beams,) [m].

        Returns:
            (beams,) distances [m]. As REP 117 says: infinity where nothing is in range, minus
            infinity where something is too close to be measured.
        """
        if self.is_covered:
            return np.full(len(distances), -np.inf)
        measured: Array = distances + self._random.normal(0.0, self._noise, len(distances))
        measured[measured > self._laser.range_max] = np.inf
        measured[measured < self._laser.range_min] = -np.inf
        return measured


def take_scans(
    scanners: Sequence[Scanner],
    rows: Sequence[int],
    poses: Array,
    footprints: Footprints,
    surroundings: Surroundings,
) -> list[Array]:
    """Take a scan with each of m scanners; they see walls, obstacles, and the other robots.

    Args:
        scanners: The scanners.
        rows: On which robot each is mounted, a row of `poses`.
        poses: (n, 3) where all robots are, frame map [m, m, rad].
        footprints: Of all robots.
        surroundings: What else there is.

    Returns:
        For each scanner: (beams,) distances [m], see `Scanner.read`.
    """
    where = zip(scanners, poses[list(rows)].tolist(), strict=True)
    origins = np.array([scanner.origin(Pose(*pose)) for scanner, pose in where])
    reaches = np.array([scanner.reach for scanner in scanners])
    segments, owners, _ = surroundings.near(origins, reaches)
    x, y = (origins[:, None, :2] - poses[:, :2]).transpose(2, 0, 1)
    near = np.hypot(x, y) <= reaches[:, None] + footprints.radii
    near[np.arange(len(rows)), rows] = False
    who, others = near.nonzero()
    if len(who):
        edges = footprints.outlines(others, poses[others]).reshape(-1, 2, 2)
        segments = np.concatenate([segments, edges])
        owners = np.concatenate([owners, who.repeat(footprints.corners)])
    distances, starts = cast([scanner.fan for scanner in scanners], origins, segments, owners)
    ends = itertools.pairwise(starts)
    return [
        scanner.read(distances[first:last])
        for scanner, (first, last) in zip(scanners, ends, strict=True)
    ]
