# SPDX-License-Identifier: BSD-3-Clause
"""Finds where on the map a scan was taken, near where the odometry says.

Each beam's end is drawn to the surface nearest to it, across that surface only (Chen and Medioni,
"Object modelling by registration of multiple range images", 1992). How far, and how far the
odometry is believed instead, follows from how sure each of them is: along a bare wall the scan
says nothing, so there the odometry decides.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from hive_common.pose import Pose

if TYPE_CHECKING:
    from hive_common.geometry import Array
    from robot_navigation.mapping.surfaces import Surfaces

NEAREST = (0.3, 0.3, 0.2, 0.1)
"""A beam that ends farther from anything known is about something new [m], in the first rounds and
in all that follow: at first the odometry may be off by a slip of the wheels."""

NOISE = 0.02
"""How far an end is from its surface, as a standard deviation [m]."""

OUTLIER = 0.05
"""Ends that are farther off than this count less and less [m]."""

ALIKE = 0.3
"""Neighbouring beams err together, so each counts for so much of itself."""

ODOMETRY = (0.02, 0.02)
"""How far the odometry is off between two scans, as standard deviations [m] and [rad]."""

ROUNDS = 12
"""So often the ends are drawn, at most."""

STILL = 1e-5
"""Less than this is no move [m, rad]."""

FEWEST = 30
"""With fewer beams that end near something known, the odometry alone is believed."""


class ScanMatcher:
    """Fits scans to what is known of the surfaces."""

    def __init__(self, surfaces: Surfaces) -> None:
        """Fit to these, which may grow."""
        self._surfaces = surfaces

    def fit(self, guess: Pose, points: Array, reach: float) -> Pose:
        """Return where the laser was.

        Args:
            guess: Where the odometry says that it was, frame map.
            points: (n, 2) where beams ended, seen from the laser [m].
            reach: How far from it [m].
        """
        known = self._surfaces.around(guess.x, guess.y, reach + NEAREST[0])
        if known is None:
            return guess
        best = np.array(guess)
        trust = np.diag([ODOMETRY[0] ** -2, ODOMETRY[0] ** -2, ODOMETRY[1] ** -2])
        for turn in range(ROUNDS):
            reach = NEAREST[min(turn, len(NEAREST) - 1)]
            cos, sin = np.cos(best[2]), np.sin(best[2])
            arms = points @ np.array([[cos, sin], [-sin, cos]])
            ends = arms + best[:2]
            away, nearest = known.tree.query(ends, distance_upper_bound=reach)
            near = np.isfinite(away)
            # What is seen from behind is the other side of a thin wall.
            near[near] = (known.normals[nearest[near]] * arms[near]).sum(axis=1) < 0
            if near.sum() < FEWEST:
                return guess
            arms, ends, nearest = arms[near], ends[near], nearest[near]
            normals = known.normals[nearest]
            off = ((ends - known.points[nearest]) * normals).sum(axis=1)
            weights = ALIKE * known.flatness[nearest] / (1 + (off / OUTLIER) ** 2) / NOISE**2
            lever = normals[:, 1] * arms[:, 0] - normals[:, 0] * arms[:, 1]
            slopes = np.column_stack([normals, lever])
            weighed = slopes * weights[:, None]
            move = np.linalg.solve(
                slopes.T @ weighed + trust,
                -(weighed.T @ off) - trust @ (best - np.array(guess)),
            )
            best += move
            if turn >= len(NEAREST) and np.abs(move).max() < STILL:
                break
        return Pose(*best.tolist())
