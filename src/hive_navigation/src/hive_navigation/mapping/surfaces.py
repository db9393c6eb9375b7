# SPDX-License-Identifier: BSD-3-Clause
"""Surfaces at sub-cell precision: the mean of the beams' ends in each cell.

An occupancy grid tells in which cells a wall lies. The mean of the beams' ends tells where in a
cell, which is what a scan can be matched to closely; gmapping does the same (Grisetti, Stachniss
and Burgard, IEEE Transactions on Robotics 23(1), 2007).
"""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from scipy import spatial

if TYPE_CHECKING:
    from hive_common.geometry import Array

NEIGHBOURS = 6  # number of points that determine a surface's direction, including the point itself


class Surface(NamedTuple):
    """The surfaces around a place."""

    tree: spatial.cKDTree  # finds the nearest point
    points: Array  # (k, 2) frame map [m]
    normals: Array  # (k, 2) unit vectors towards the side from which the surface was seen
    flatness: Array  # (k,) from 0 for scattered points to 1 for points on a line


class Surfaces:
    """The mean of the beams' ends in each square."""

    def __init__(self, side: float) -> None:
        """Start empty; squares have a `side` [m]."""
        self._side = side
        self.clear()

    def clear(self) -> None:
        """Forget everything."""
        self._row: dict[tuple[int, int], int] = {}
        self._count: Array = np.zeros(0)
        self._sums: Array = np.zeros((0, 2))
        self._views: Array = np.zeros((0, 2))

    def add(self, ends: Array, laser: tuple[float, float]) -> None:
        """Add the ends of beams (n, 2) that a laser at (x, y) measured, frame map [m]."""
        squares, places = np.unique(
            np.floor(ends / self._side).astype(np.int64), axis=0, return_inverse=True
        )
        rows = [self._row.setdefault((x, y), len(self._row)) for x, y in squares.tolist()]
        more = len(self._row) - len(self._count)
        if more:
            self._count = np.concatenate([self._count, np.zeros(more)])
            self._sums = np.concatenate([self._sums, np.zeros((more, 2))])
            self._views = np.concatenate([self._views, np.zeros((more, 2))])
        where = np.array(rows, dtype=np.intp)[places]
        np.add.at(self._count, where, 1.0)
        np.add.at(self._sums, where, ends)
        np.add.at(self._views, where, np.array(laser) - ends)

    def around(self, x: float, y: float, reach: float) -> Surface | None:
        """Return the surfaces within `reach` [m] of a place along x and y.

        None if there are too few points to determine a direction.
        """
        if not len(self._count):
            return None
        means = self._sums / self._count[:, None]
        close = (np.abs(means - (x, y)) <= reach).all(axis=1)
        points = means[close]
        if len(points) < NEIGHBOURS:
            return None
        tree = spatial.cKDTree(points)
        _, near = tree.query(points, k=NEIGHBOURS)
        away = points[near] - points[near].mean(axis=1, keepdims=True)
        xx, yy = (away**2).mean(axis=1).T
        xy = (away[:, :, 0] * away[:, :, 1]).mean(axis=1)
        along = 0.5 * np.arctan2(2 * xy, xx - yy)
        spread = np.hypot(xx - yy, 2 * xy)
        normals = np.stack([-np.sin(along), np.cos(along)], axis=1)
        normals[(normals * self._views[close]).sum(axis=1) < 0] *= -1
        return Surface(tree, points, normals, spread / (xx + yy + 1e-12))
