# SPDX-License-Identifier: BSD-3-Clause
"""Finds the robots that surely touch nothing in a step, without an exact check.

A robot with 2 m of room need not be compared with walls in every step of 1 cm. So a measurement
notes how far its base may go before its circle can touch something. Every step subtracts what the
robot, the others and people may have moved. Only robots without room left are measured again.

This saves checks and never misses a contact: these robots would pass the exact check, too.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from hive_common.geometry import distances

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from hive_common.geometry import Array, Indices
    from simenv.world.surroundings import Surroundings

REACH = 2.0  # nothing farther from the middle of a robot counts [m]
ROUNDING = 1e-6  # subtracted from every distance against rounding errors [m]
PAUSE = 8  # steps before a robot that is too near to something is measured again


class Clearance:
    """How far n robots may go before an exact check; row i belongs to robot i."""

    def __init__(self, surroundings: Surroundings) -> None:
        """Begin without robots."""
        self._surroundings = surroundings
        self._obstacles = surroundings.obstacles
        self.begin(np.zeros(0))

    def begin(self, radii: Array) -> None:
        """Begin with robots whose bases fit in circles of these radii (n,) [m]."""
        self._radii = radii
        self._still = np.full(len(radii), -np.inf)
        self._moving = np.full(len(radii), -np.inf)
        self._paused = np.zeros(len(radii), dtype=int)
        self._walked = self._obstacles.walked
        self._changes = self._obstacles.changes

    def doubtful(self, poses: Array, ways: Array, swings: Array) -> Indices:
        """Return which robots may touch something in a step; the others surely do not.

        The others keep their distance even from wherever any robot may move in the step.

        Args:
            poses: (n, 3) where the robots stand before the step, frame map.
            ways: (n,) how far their bases go at most [m].
            swings: (n,) how far anything on them goes at most [m], at least `ways`.

        Returns:
            (k,) rows of moving robots, in ascending order.
        """
        if self._obstacles.changes != self._changes:
            self.begin(self._radii)
        walked, self._walked = self._obstacles.walked - self._walked, self._obstacles.walked
        longest, widest = ways.max(), swings.max()
        self._still -= ways + walked
        self._moving -= ways + longest
        doubtful: Indices = self._short(widest).nonzero()[0]
        if not len(doubtful):
            return doubtful
        doubtful = doubtful[swings[doubtful] > 0]
        fresh = doubtful[self._paused[doubtful] == 0]
        self._paused[doubtful] -= 1
        if len(fresh):
            self._measure(fresh, poses)
            self._still[fresh] -= ways[fresh]
            self._moving[fresh] -= ways[fresh] + longest
            near = self._short(widest)[fresh]
            self._paused[fresh] = np.where(near, PAUSE, 0)
            doubtful = doubtful[self._short(widest)[doubtful]]
        return doubtful

    def _short(self, widest: float) -> NDArray[np.bool_]:
        """Return (n,) which robots have no room left if nothing moves more than `widest` [m]."""
        short: NDArray[np.bool_] = np.minimum(self._still, self._moving - widest) < 0
        return short

    def _measure(self, rows: Indices, poses: Array) -> None:
        """Measure the room around robots where they stand."""
        places, radii = poses[rows], self._radii[rows]
        near = self._surroundings.near(places, np.full(len(rows), REACH))
        room = np.full(len(rows), REACH)
        away = distances(places[near.places, :2], near.segments)
        np.minimum.at(room, near.places, away)
        self._still[rows] = room - radii - ROUNDING
        x, y = (places[:, None, :2] - poses[:, :2]).transpose(2, 0, 1)
        gaps = np.hypot(x, y) - radii[:, None] - self._radii
        gaps[np.arange(len(rows)), rows] = np.inf
        self._moving[rows] = gaps.min(axis=1) - ROUNDING
