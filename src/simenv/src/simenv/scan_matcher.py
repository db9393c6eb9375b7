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

SPREAD = 0.05
"""How far from a surface a beam may end and still count for it [m]."""

TRUST = 0.02
"""How much a pose loses for lying at the window's edge, as a share of the best score: where a
scan fits everywhere alike, as along a bare wall, the odometry decides."""

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

    def look(self) -> None:
        """Take the grid as it is now for the scans to come."""
        occupied = self._grid.odds > 0
        if not occupied.any():
            self._field = np.zeros(0)
            return
        distance = ndimage.distance_transform_edt(~occupied) * self._grid.resolution
        self._field = np.exp(-((distance / SPREAD) ** 2) / 2).astype(np.float32)

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
        left, low = ((poses[:, i] - self._grid.origin[i])[:, None] * scale for i in (0, 1))
        rows, columns = self._field.shape
        column = np.clip((left + cos * x - sin * y).astype(np.int32), 0, columns - 1)
        row = np.clip((low + sin * x + cos * y).astype(np.int32), 0, rows - 1)
        found: Array = self._field.ravel()[row * columns + column].mean(axis=1)
        return found
