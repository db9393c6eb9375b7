# SPDX-License-Identifier: BSD-3-Clause
"""The likelihood-field model: how likely a laser scan is at a pose.

A beam is likely to end near an occupied cell, whatever is between (Thrun, Burgard and Fox,
"Probabilistic Robotics", 2005, section 6.4). The distances to the nearest occupied cell are
computed once for all cells, so each beam costs one table look-up.

The book leaves out beams that hit nothing. With the fleet's laser, which reaches 3 m, they are
most of a scan, and free space around the robot says a lot about where it is. So such a beam is
checked at several places along its course: it is unlikely if it passes through an occupied cell.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from hive_common.compiled import compiled
from hive_common.distances import distances
from hive_common.errors import MapError

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from hive_common.geometry import Array
    from hive_navigation.localization.amcl_settings import AmclSettings
    from robot_description.models import Laser
    from robot_description.scan import Scan

ALONG = (0.2, 0.4, 0.6, 0.8, 0.97)
"""Where a beam that hits nothing is checked, as shares of its range."""

THROUGH = 0.05  # a beam that comes nearer than this to an occupied cell passes through it [m]

TEMPER = 0.08
"""Weight of a beam, 0..1: neighbouring beams err together, and the product of their likelihoods
would be overconfident (Thrun, Burgard and Fox, section 6.3.4). Found by experiment, see
docs/decisions/060."""


@dataclass(frozen=True)
class Beams:
    """The beams of a scan that are used, in `base_footprint` [m]."""

    ends: Array
    """(n, 2) ends of the beams that hit something."""
    clear: Array
    """(k, 2) points along the beams that hit nothing."""


class BeamChooser:
    """Chooses at most `max_beams` evenly spread beams of each scan."""

    def __init__(self, laser: Laser, max_beams: int) -> None:
        self._mount = laser.pose
        self._max_beams = max_beams

    def of(self, scan: Scan) -> Beams:
        """Return the chosen beams of a scan."""
        beams = len(scan.ranges)
        chosen = np.linspace(0, beams, min(self._max_beams, beams), endpoint=False)
        picked = chosen.astype(np.intp)
        reach = scan.ranges[picked]
        angles = scan.angle_min + scan.angle_increment * picked + self._mount[2]
        hit, missed = np.isfinite(reach), np.isposinf(reach)
        along = np.multiply.outer(np.asarray(ALONG) * scan.range_max, np.ones(missed.sum()))
        return Beams(
            self._points(reach[hit], angles[hit]),
            self._points(along.ravel(), np.tile(angles[missed], len(ALONG))),
        )

    def _points(self, reach: Array, angles: Array) -> Array:
        x, y, _ = self._mount
        return np.stack([x + reach * np.cos(angles), y + reach * np.sin(angles)], axis=1)


class LikelihoodField:
    """A map with the tables that weigh particles."""

    def __init__(
        self,
        cells: NDArray[np.int8],
        resolution: float,
        origin: tuple[float, float],
        settings: AmclSettings,
    ) -> None:
        """Compute the tables.

        Args:
            cells: (rows, columns) as in nav_msgs/OccupancyGrid: -1 unknown, else 0..100.
            resolution: Side of a cell [m].
            origin: x, y of the lower-left corner, frame map [m].
            settings: The `laser_*` settings apply.
        """
        self._free = cells == 0
        self._resolution = resolution
        self._origin = origin
        occupied = cells > 50  # noqa: PLR2004  (more likely occupied than not)
        farthest = settings.laser_likelihood_max_dist
        # A ring of cells around the map represents everything outside it.
        around = (cells.shape[0] + 2, cells.shape[1] + 2)
        hit, clear = _tables(np.array(farthest), settings)
        self._hit = np.full(around, hit, dtype=np.float32)
        self._clear = np.full(around, clear, dtype=np.float32)
        for rows, apart in distances(occupied, farthest / resolution, walled=False):
            hit, clear = _tables(np.minimum(apart * resolution, farthest), settings)
            self._hit[1:-1, 1:-1][rows], self._clear[1:-1, 1:-1][rows] = hit, clear

    def log_likelihood(self, poses: Array, beams: Beams) -> Array:
        """Return the log likelihoods (n,) of a scan, up to a common constant.

        `poses` (n, 3) are those of the base, frame map [m, m, rad].
        """
        found = np.zeros(len(poses))
        origin = (float(self._origin[0]), float(self._origin[1]))
        for points, table in ((beams.ends, self._hit), (beams.clear, self._clear)):
            _add_likelihoods(found, poses, points, table, self._resolution, origin)
        return found

    def anywhere(self, count: int, random: np.random.Generator) -> Array:
        """Return poses (count, 3) drawn evenly from free cells and all headings, frame map.

        Raises:
            MapError: No cell of the map is free.
        """
        rows, columns = np.nonzero(self._free)
        if not len(rows):
            raise MapError("no cell of the map is free, so the robot can be nowhere on it")
        chosen = random.integers(len(rows), size=count)
        places = np.stack([columns[chosen], rows[chosen]], axis=1) + random.random((count, 2))
        headings = random.uniform(-np.pi, np.pi, (count, 1))
        spread: Array = np.hstack([places * self._resolution + self._origin, headings])
        return spread


def _tables(
    distance: NDArray[np.float64], settings: AmclSettings
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return what the ends of beams and what they pass say at distances from obstacles [m]."""
    sigma = settings.laser_sigma_hit
    hit = settings.laser_z_hit * np.exp(-(distance**2) / (2 * sigma**2))
    through = settings.laser_z_hit * (distance >= THROUGH)
    clear = TEMPER / len(ALONG) * np.log(through + settings.laser_z_rand)
    return TEMPER * np.log(hit + settings.laser_z_rand), clear


@compiled(
    "void(float64[::1], float64[:, ::1], float64[:, ::1], float32[:, ::1], float64,"
    " UniTuple(float64, 2))"
)
def _add_likelihoods(
    found: Array,
    poses: Array,
    points: Array,
    table: NDArray[np.float32],
    resolution: float,
    origin: tuple[float, float],
) -> None:
    """Add to (n,) what a table says of points (b, 2) seen from poses (n, 3), and sum it up."""
    rows, columns = np.int32(table.shape[0]), np.int32(table.shape[1])
    scale = np.float32(1.0 / resolution)
    xs, ys = (points[:, 0] * scale).astype(np.float32), (points[:, 1] * scale).astype(np.float32)
    cells = np.empty(len(points), dtype=np.int32)
    values = table.reshape(-1)
    for pose in range(len(poses)):
        cos, sin = np.float32(math.cos(poses[pose, 2])), np.float32(math.sin(poses[pose, 2]))
        left = np.float32((poses[pose, 0] - origin[0]) * scale + 1)
        low = np.float32((poses[pose, 1] - origin[1]) * scale + 1)
        # A loop of its own, which the compiler turns into vector instructions.
        for point in range(len(cells)):
            column = np.int32(left + cos * xs[point] - sin * ys[point])
            row = np.int32(low + sin * xs[point] + cos * ys[point])
            column = min(max(column, np.int32(0)), np.int32(columns - 1))
            row = min(max(row, np.int32(0)), np.int32(rows - 1))
            cells[point] = row * columns + column
        total = 0.0
        for point in range(len(cells)):
            total += values[cells[point]]
        found[pose] += total
