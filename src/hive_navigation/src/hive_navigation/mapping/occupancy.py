# SPDX-License-Identifier: BSD-3-Clause
"""An occupancy grid that is built from scans and grows.

It follows Moravec and Elfes, "High resolution maps from wide angle sonar", ICRA 1985; the log odds
are those of Thrun, Burgard and Fox, "Probabilistic Robotics", 2005, section 9.2.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from hive_common.grid_map import FREE, OCCUPIED, UNKNOWN, GridMap
from hive_common.map_file import MAX_CELLS
from hive_common.pose import Pose

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from hive_common.geometry import Array

MISS = -0.4  # log odds that a passing beam adds to a cell
HIT = 0.85  # log odds that an ending beam adds to a cell
MAX_ODDS = 6.0  # bound of a cell's log odds, so that the map learns in time that a door has opened
SURE = 0.3  # a cell with higher log odds is occupied; one below the negative is free
STRIDE = 5.0  # by how much the grid grows at least towards what lies beyond it [m]


class OccupancyGrid:
    """The log odds (rows, columns) that cells are occupied."""

    def __init__(
        self, size: tuple[float, float], origin: tuple[float, float], resolution: float
    ) -> None:
        """Start unknown; `size` is width and depth [m], `origin` in frame map [m]."""
        columns, rows = (round(side / resolution) for side in size)
        self.odds: Array = np.zeros((rows, columns))  # 0 is unknown; row 0 is the lowest
        self.resolution = resolution  # side of a cell [m]
        self.origin = origin  # x, y of the lower left corner, frame map [m]
        self.full = False  # whether a scan reached so far that the grid did not grow to it

    def add(self, origin: Pose, angles: Array, ranges: Array, range_max: float) -> None:
        """Take in a scan.

        Args:
            origin: Pose of the laser, frame map.
            angles: (n,) directions of the beams relative to the laser [rad].
            ranges: (n,) [m]; infinite if nothing was in range, negative or NaN if unknown.
            range_max: How far the laser sees [m].
        """
        known = ranges > 0
        angles, ranges = angles[known] + origin.yaw, ranges[known]
        hits = ranges < range_max
        self._make_room(origin, angles, np.minimum(ranges, range_max))
        passed = np.zeros(self.odds.size, dtype=bool)
        passed[self._passed(origin, angles, np.minimum(ranges, range_max))] = True
        # The beam ends at the surface; the cell behind it is the solid one.
        ends = ranges[hits] + self.resolution / 2
        ended = np.zeros(self.odds.size, dtype=bool)
        ended[self._at(origin, angles[hits], ends)] = True
        odds = self.odds.ravel()
        odds[passed & ~ended] += MISS
        odds[ended] += HIT
        np.clip(odds, -MAX_ODDS, MAX_ODDS, out=odds)

    def clear(self) -> None:
        """Forget everything, but keep the size."""
        self.odds[:] = 0.0

    def as_map(self) -> GridMap:
        """Return the map with free, occupied and unknown cells."""
        cells = np.full(self.odds.shape, UNKNOWN, dtype=np.int8)
        cells[self.odds < -SURE] = FREE
        cells[self.odds > SURE] = OCCUPIED
        return GridMap(cells, self.resolution, Pose(*self.origin, 0.0))

    def _make_room(self, origin: Pose, angles: Array, ranges: Array) -> None:
        """Grow to where a scan reaches beyond the grid."""
        reach = ranges + self.resolution
        missing = []
        for here, turn, corner, cells in (
            (origin.y, np.sin(angles), self.origin[1], self.odds.shape[0]),
            (origin.x, np.cos(angles), self.origin[0], self.odds.shape[1]),
        ):
            ends = (here + reach * turn - corner) / self.resolution
            low, high = -ends.min(initial=0.0), ends.max(initial=0.0) - cells
            stride = round(STRIDE / self.resolution)
            missing.append([max(0, math.ceil(side / stride)) * stride for side in (low, high)])
        sides = [n + sum(more) for n, more in zip(self.odds.shape, missing, strict=True)]
        if math.prod(sides) > MAX_CELLS:
            self.full = True
        elif np.any(missing):
            self.odds = np.pad(self.odds, missing)
            (below, _), (left, _) = missing
            x, y = self.origin
            self.origin = (x - left * self.resolution, y - below * self.resolution)

    def _passed(self, origin: Pose, angles: Array, ranges: Array) -> NDArray[np.intp]:
        """Return the cells that beams pass before they end."""
        step = self.resolution / 2
        along = np.arange(0.0, ranges.max(initial=0.0), step)
        reach = np.broadcast_to(along, (len(angles), len(along)))
        before = reach < ranges[:, None] - step
        spread = np.broadcast_to(angles[:, None], reach.shape)
        return self._at(origin, spread[before], reach[before])

    def _at(self, origin: Pose, angles: Array, reach: Array) -> NDArray[np.intp]:
        """Return the cells at distances in directions, without those off the grid."""
        rows, columns = self.odds.shape
        x = (origin.x + reach * np.cos(angles) - self.origin[0]) / self.resolution
        y = (origin.y + reach * np.sin(angles) - self.origin[1]) / self.resolution
        column, row = np.floor(x).astype(np.intp), np.floor(y).astype(np.intp)
        inside = (row >= 0) & (row < rows) & (column >= 0) & (column < columns)
        found: NDArray[np.intp] = (row * columns + column)[inside]
        return found
