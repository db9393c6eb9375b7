# SPDX-License-Identifier: BSD-3-Clause
"""Finds where on the map a scan fits best, near where the odometry says it was taken.

All poses of a small window are tried at once, on three levels that get finer (Olson, "Real-time
correlative scan matching", ICRA 2009): it has no gradient to get stuck with, and the window is
small because the odometry between two scans is good.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from scipy import ndimage

from robot_description.follower import Pose

if TYPE_CHECKING:
    from simenv.geometry import Array
    from simenv.occupancy import OccupancyGrid

SPREAD = 0.12
"""How far from a surface a beam may end and still count for it [m]."""

TRUST = 0.1
"""How much a pose loses for lying half the widest window off, as a share of the best score.

Where a scan fits everywhere alike, as along a bare wall, the odometry decides. Tried on
explorations of the whole lab: the farthest that the mapper was from the truth was 0.71 m with 1.0,
0.18 m with 0.2, and 0.17 m with 0.1.
"""

FEWEST = 30
"""With fewer beams that hit something, the odometry alone is believed."""

LEVELS = ((0.12, 0.06), (0.04, 0.02), (0.0134, 0.0067))
"""Half the window on each level: [m] and [rad]."""

PLACES = np.linspace(-1.0, 1.0, 7)
"""What is tried on each side of the middle, as shares of half the window."""


class ScanMatcher:
    """Fits scans to a grid."""

    def __init__(self, grid: OccupancyGrid) -> None:
        """Fit to this grid, which may grow."""
        self._grid = grid
        self._field: Array = np.zeros(0)
        self._corner = (0.0, 0.0)

    def look(self, here: Pose, reach: float) -> None:
        """Take the grid as it is now around a place.

        Args:
            here: The place, frame map.
            reach: How far from it scans may reach [m].
        """
        grid = self._grid
        side = grid.resolution
        cells = reach / side
        column, row = ((here[i] - grid.origin[i]) / side for i in (0, 1))
        low, left = max(0, int(row - cells)), max(0, int(column - cells))
        occupied = grid.odds[low : int(row + cells) + 1, left : int(column + cells) + 1] > 0
        if not occupied.any():
            self._field = np.zeros(0)
            return
        distance = ndimage.distance_transform_edt(~occupied) * side
        self._field = np.exp(-((distance / SPREAD) ** 2) / 2).astype(np.float32)
        # The middle of the first cell: between the middles it is interpolated.
        self._corner = (grid.origin[0] + (left + 0.5) * side, grid.origin[1] + (low + 0.5) * side)

    def fit(self, guess: Pose, points: Array) -> Pose:
        """Return where the laser was.

        Args:
            guess: Where the odometry says that it was, frame map.
            points: (n, 2) where beams ended, seen from the laser [m].
        """
        if not self._field.size or len(points) < FEWEST:
            return guess
        best = np.array(guess)
        for shift, turn in LEVELS:
            tried = np.stack(np.meshgrid(PLACES, PLACES, PLACES), axis=-1).reshape(-1, 3)
            poses = best + tried * (shift, shift, turn)
            away = ((poses - np.array(guess)) / (LEVELS[0][0], LEVELS[0][0], LEVELS[0][1])) ** 2
            scores = self._score(poses, points)
            best = poses[np.argmax(scores - TRUST * scores.max() * away.sum(axis=1))]
        return Pose(*best.tolist())

    def _score(self, poses: Array, points: Array) -> Array:
        """Return how well a scan fits at each of some poses (n, 3), 0..1."""
        scale = 1.0 / self._grid.resolution
        cos, sin = np.cos(poses[:, 2])[:, None], np.sin(poses[:, 2])[:, None]
        x, y = points[:, 0] * scale, points[:, 1] * scale
        left, low = ((poses[:, i] - self._corner[i])[:, None] * scale for i in (0, 1))
        places = (low + sin * x + cos * y, left + cos * x - sin * y)
        fits: Array = ndimage.map_coordinates(self._field, places, order=1, mode="nearest")
        mean: Array = fits.mean(axis=1)
        return mean
