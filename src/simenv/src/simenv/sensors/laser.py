# SPDX-License-Identifier: BSD-3-Clause
"""What laser scanners measure in the world."""

from __future__ import annotations

import itertools
import math
from typing import TYPE_CHECKING

import numpy as np

from hive_common.compiled import compiled
from hive_common.pose import Pose, compose
from simenv.bodies.footprints import Footprints
from simenv.sensors.beams import Fan, Fans, cast

if TYPE_CHECKING:
    from collections.abc import Sequence

    from hive_common.geometry import Array, Indices
    from robot_description.models import Laser
    from simenv.world.surroundings import Surroundings

SURE = 6.0  # standard deviations by which a measured distance is off at most


class Scanner:
    """The laser scanner of one robot.

    Attributes:
        fan: Its beams.
        ranges: The shortest and the longest distance that it measures [m].
        is_covered: Whether something covers it, so that it measures nothing.
    """

    def __init__(self, laser: Laser, noise: float, random: np.random.Generator) -> None:
        """Mount a scanner; `noise` is the standard deviation of a distance [m]."""
        self._mount = Pose(*laser.pose)
        self._noise = noise
        self._random = random
        self.is_covered = False
        self.ranges = (laser.range_min, laser.range_max)
        increment = laser.field_of_view / laser.beams
        self.fan = Fan(-laser.field_of_view / 2, increment, laser.beams)

    @property
    def angles(self) -> Array:
        """The directions (beams,) of its beams, counter-clockwise from its heading [rad]."""
        return self.fan.angles

    @property
    def reach(self) -> float:
        """How far away something may be that it measures, from the middle of the robot [m]."""
        return self.ranges[1] + SURE * self._noise + math.hypot(*self._mount[:2])

    def origin(self, robot: Pose) -> Pose:
        """Return the pose of the scanner with the robot's base at `robot`, frame map."""
        return compose(robot, self._mount)

    def measure(self, robot: Pose, segments: Array) -> Array:
        """Take a scan (beams,) [m] of `segments` (k, 2, 2), frame map [m]; see `Scanners.take`.

        `robot` is where the robot's base is, frame map.
        """
        alone = Scanners([self], Footprints([]))
        starts = np.array([0, len(segments)])
        return alone.see([0], np.array([robot]), (segments, starts), np.zeros((0, 3)))[0]

    def fill_errors(self, errors: Array) -> None:
        """Draw the errors (beams,) of the next scan [m]; NaN where nothing is measured."""
        if self.is_covered:
            errors.fill(np.nan)
        else:
            self._random.standard_normal(out=errors)
            errors *= self._noise


class Scanners:
    """The laser scanners of n robots."""

    def __init__(self, scanners: Sequence[Scanner], footprints: Footprints) -> None:
        """Take the scanners of robots and their footprints, both in the same order."""
        self._scanners = scanners
        self._footprints = footprints
        self._reaches = np.array([scanner.reach for scanner in scanners])
        self._ranges = np.array([scanner.ranges for scanner in scanners]).reshape(-1, 2)
        self._fans = Fans([scanner.fan for scanner in scanners])

    def take(self, rows: Sequence[int], poses: Array, surroundings: Surroundings) -> list[Array]:
        """Take a scan with each of some robots' scanners, of everything around them.

        Args:
            rows: The robots.
            poses: (n, 3) of all robots, frame map [m, m, rad].
            surroundings: What is there besides robots.

        Returns:
            For each of `rows`: distances (beams,) [m]. As in REP 117 infinity if nothing is in
            range, minus infinity if something is too close.
        """
        where = poses[rows]
        near = surroundings.near(where, self._reaches[rows])
        return self.see(rows, where, (near.segments, near.starts), poses)

    def see(
        self, rows: Sequence[int], where: Array, near: tuple[Array, Indices], poses: Array
    ) -> list[Array]:
        """Take a scan with each of some scanners, of segments and of robots at `poses`.

        See `take`; `where` (m, 3) are the poses of the scanners' own robots, and `near` are
        `segments` and `firsts` of `cast`.
        """
        chosen = [self._scanners[row] for row in rows]
        which = np.array(rows, dtype=np.int64)
        places = zip(chosen, where.tolist(), strict=True)
        origins = np.array([scanner.origin(Pose(*place)) for scanner, place in places])
        starts = list(itertools.accumulate((each.fan.number for each in chosen), initial=0))
        slices = [slice(*ends) for ends in itertools.pairwise(starts)]
        errors = np.empty(starts[-1])
        for scanner, its_own in zip(chosen, slices, strict=True):
            scanner.fill_errors(errors[its_own])
        distances = cast(
            origins.reshape(-1, 3),
            which,
            np.array(starts),
            self._fans.spreads,
            self._fans.places,
            self._fans.directions,
            *near,
            poses,
            self._footprints.points,
            self._footprints.radii,
            self._reaches,
        )
        measured = read(distances, errors, np.array(starts), self._ranges[which])
        return [measured[its_own] for its_own in slices]


@compiled("float64[::1](float64[::1], float64[::1], int64[::1], float64[:, ::1])")
def read(distances: Array, errors: Array, starts: Indices, ranges: Array) -> Array:
    """Return what scanners measure, see `Scanners.take`.

    Args:
        distances: The true distances of all beams, scanner by scanner [m].
        errors: Of each beam [m]; NaN measures nothing.
        starts: (m + 1,) where the beams of each scanner begin.
        ranges: (m, 2) the shortest and longest distance of each scanner [m].
    """
    measured = distances + errors
    for i in range(len(ranges)):
        for beam in range(starts[i], starts[i + 1]):
            if measured[beam] > ranges[i, 1]:
                measured[beam] = np.inf
            elif not measured[beam] >= ranges[i, 0]:
                measured[beam] = -np.inf
    return measured
