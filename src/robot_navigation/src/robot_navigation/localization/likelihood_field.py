# SPDX-License-Identifier: BSD-3-Clause
"""How likely a laser scan is at a place: the likelihood-field model.

A beam is likely to end near something that the map shows, however it got there (Thrun, Burgard
and Fox, "Probabilistic Robotics", 2005, section 6.4). The distance to the nearest occupied cell is
known for every cell beforehand, so a beam costs one look into a table.

The book leaves out beams that hit nothing. With the fleet's laser, which reaches 3 m, they are
most of a scan, and that nothing is near says a lot about where one is. So such a beam is looked at
in several places along its way: it is unlikely if it passes through something on the map.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from scipy import ndimage

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from robot_description.models import Laser
    from robot_navigation.localization.amcl_settings import AmclSettings

    Array = NDArray[np.float64]

ALONG = (0.2, 0.4, 0.6, 0.8, 0.97)
"""Where along its range a beam that hits nothing is looked at."""

THROUGH = 0.05
"""A beam that hits nothing has passed through what it comes nearer to than this [m]."""

TEMPER = 0.08
"""What a beam counts for, from 0 to 1: neighbouring beams err together, which a product of their
likelihoods takes for certainty (Thrun, Burgard and Fox, section 6.3.4). Chosen by trying;
see decision 060."""

BATCH = 4000
"""So many poses are weighed at once, lest the tables of all their beams fill the memory."""


@dataclass(frozen=True)
class Beams:
    """The beams of a scan that count, seen from `base_footprint`.

    Attributes:
        ends: (n, 2) where beams have hit something [m].
        clear: (k, 2) places on the way of beams that have hit nothing [m].
    """

    ends: Array
    clear: Array


class BeamChooser:
    """Chooses evenly spread beams of a laser's scans.

    Args:
        laser: The laser.
        most: How many beams count.
    """

    def __init__(self, laser: Laser, most: int) -> None:
        self._laser = laser
        self._most = most
        self._angles = np.zeros(0)

    def of(self, ranges: Array) -> Beams:
        """Return the beams that count.

        Args:
            ranges: (beams,) [m], the first at half the field of view to the right; infinite where
                nothing was in range, negative or NaN where nothing is known.
        """
        laser = self._laser
        if len(self._angles) != len(ranges):
            steps = np.arange(len(ranges)) / len(ranges) - 0.5
            self._angles = steps * laser.field_of_view + laser.pose[2]
        chosen = np.linspace(0, len(ranges), min(self._most, len(ranges)), endpoint=False)
        picked = chosen.astype(np.intp)
        reach, angles = ranges[picked], self._angles[picked]
        hit = (reach >= laser.range_min) & (reach < laser.range_max)
        missed = reach >= laser.range_max
        along = np.multiply.outer(np.asarray(ALONG) * laser.range_max, np.ones(missed.sum()))
        return Beams(
            self._points(reach[hit], angles[hit]),
            self._points(along.ravel(), np.tile(angles[missed], len(ALONG))),
        )

    def _points(self, reach: Array, angles: Array) -> Array:
        x, y, _ = self._laser.pose
        return np.stack([x + reach * np.cos(angles), y + reach * np.sin(angles)], axis=1)


class LikelihoodField:
    """A map, prepared for weighing particles.

    Attributes:
        free: (rows, columns) whether a robot may be in a cell.
        resolution: Side of a cell [m].
        origin: x, y of the lower-left corner, frame map [m].
    """

    def __init__(
        self,
        cells: NDArray[np.int8],
        resolution: float,
        origin: tuple[float, float],
        settings: AmclSettings,
    ) -> None:
        """Prepare a map.

        Args:
            cells: (rows, columns) as in nav_msgs/OccupancyGrid: -1 unknown, else 0..100.
            resolution: Side of a cell [m].
            origin: x, y of the lower-left corner, frame map [m].
            settings: `laser_*` count.
        """
        self.free = cells == 0
        self.resolution = resolution
        self.origin = origin
        occupied = cells > 50  # noqa: PLR2004  (more likely occupied than not)
        farthest = settings.laser_likelihood_max_dist
        distance = np.full(cells.shape, farthest)
        if occupied.any():
            distance = ndimage.distance_transform_edt(~occupied) * resolution
        # One ring of cells around the map stands for everything outside it.
        distance = np.pad(np.minimum(distance, farthest), 1, constant_values=farthest)
        self._shape = distance.shape
        sigma = settings.laser_sigma_hit
        hit = settings.laser_z_hit * np.exp(-(distance**2) / (2 * sigma**2))
        through = settings.laser_z_hit * (distance >= THROUGH)
        self._hit = (TEMPER * np.log(hit + settings.laser_z_rand)).astype(np.float32).ravel()
        clear = TEMPER / len(ALONG) * np.log(through + settings.laser_z_rand)
        self._clear = clear.astype(np.float32).ravel()

    def log_likelihood(self, poses: Array, beams: Beams) -> Array:
        """Return how likely a scan is at each of several poses.

        Args:
            poses: (n, 3) of the base, frame map [m, m, rad].
            beams: The scan.

        Returns:
            (n,) logarithms of the likelihood, up to a constant that is the same for all.
        """
        found = np.zeros(len(poses))
        for first in range(0, len(poses), BATCH):
            some = slice(first, first + BATCH)
            for points, table in ((beams.ends, self._hit), (beams.clear, self._clear)):
                if len(points):
                    found[some] += table[self._cells(poses[some], points)].sum(axis=1)
        return found

    def _cells(self, poses: Array, points: Array) -> NDArray[np.int32]:
        """Return the places in the tables of points (b, 2) seen from poses (n, 3), as (n, b)."""
        scale = np.float32(1.0 / self.resolution)
        seen = (points * scale).astype(np.float32)
        cos, sin = (f(poses[:, 2]).astype(np.float32)[:, None] for f in (np.cos, np.sin))
        left, low = (
            ((poses[:, axis] - self.origin[axis]) * scale + 1)[:, None] for axis in (0, 1)
        )
        rows, columns = self._shape
        column: NDArray[np.int32]
        row: NDArray[np.int32]
        column = (left.astype(np.float32) + cos * seen[:, 0] - sin * seen[:, 1]).astype(np.int32)
        row = (low.astype(np.float32) + sin * seen[:, 0] + cos * seen[:, 1]).astype(np.int32)
        np.clip(column, 0, columns - 1, out=column)
        np.clip(row, 0, rows - 1, out=row)
        row *= columns
        row += column
        return row

    def anywhere(self, count: int, random: np.random.Generator) -> Array:
        """Return poses (count, 3) spread evenly over free cells and all headings, frame map."""
        rows, columns = np.nonzero(self.free)
        chosen = random.integers(len(rows), size=count)
        places = np.stack([columns[chosen], rows[chosen]], axis=1) + random.random((count, 2))
        headings = random.uniform(-np.pi, np.pi, (count, 1))
        spread: Array = np.hstack([places * self.resolution + self.origin, headings])
        return spread
