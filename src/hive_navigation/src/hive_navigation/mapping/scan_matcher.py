# SPDX-License-Identifier: BSD-3-Clause
"""Point-to-plane scan matching: finds where on the map a scan was taken, near the odometry's pose.

Each beam's end is pulled to the nearest surface, across that surface only (Chen and Medioni,
"Object modelling by registration of multiple range images", 1992). The scan and the odometry are
weighted by their uncertainties: along a bare wall the scan says nothing, so the odometry decides.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from hive_common.pose import Pose

if TYPE_CHECKING:
    from hive_common.geometry import Array
    from hive_navigation.mapping.surfaces import Surfaces

NEAREST = (0.3, 0.3, 0.2, 0.1)
"""A beam that ends farther from all surfaces is ignored [m], in the first rounds and all others:
at first the odometry may be off because wheels slipped."""

NOISE = 0.02  # standard deviation of an end from its surface [m]
OUTLIER = 0.05  # the weight of ends farther off than this decreases [m]
ALIKE = 0.3  # weight of a beam: neighbouring beams err together
ODOMETRY = (0.02, 0.02)  # standard deviations of the odometry between two scans [m], [rad]
MAX_ROUNDS = 12  # number of rounds in which the ends are matched
STILL = 1e-5  # a smaller move ends the rounds [m, rad]
MIN_BEAMS = 30  # with fewer beams that end near a surface, only the odometry is used


class ScanMatcher:
    """Matches scans to surfaces, which may grow."""

    def __init__(self, surfaces: Surfaces) -> None:
        self._surfaces = surfaces

    def fit(self, guess: Pose, points: Array, reach: float) -> Pose:
        """Return where the laser was, from its pose by odometry, frame map.

        `points` (n, 2) are the ends of the beams relative to it; it sees as far as `reach` [m].
        """
        known = self._surfaces.around(guess.x, guess.y, reach + NEAREST[0])
        if known is None:
            return guess
        best = np.array(guess)
        trust = np.diag([ODOMETRY[0] ** -2, ODOMETRY[0] ** -2, ODOMETRY[1] ** -2])
        for turn in range(MAX_ROUNDS):
            reach = NEAREST[min(turn, len(NEAREST) - 1)]
            cos, sin = np.cos(best[2]), np.sin(best[2])
            arms = points @ np.array([[cos, sin], [-sin, cos]])
            ends = arms + best[:2]
            away, nearest = known.tree.query(ends, distance_upper_bound=reach)
            near = np.isfinite(away)
            # A surface seen from behind is the other side of a thin wall.
            near[near] = (known.normals[nearest[near]] * arms[near]).sum(axis=1) < 0
            if near.sum() < MIN_BEAMS:
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
