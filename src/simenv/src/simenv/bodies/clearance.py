# SPDX-License-Identifier: BSD-3-Clause
"""Who surely touches nothing in a step, told without looking at anything.

A robot that has 2 m around it need not be compared with walls in every step of 1 cm. So when it is
looked at, it is noted how far its base may go before its circle can touch something; every step
takes from that what the robot itself, the others and people may have gone. Only who has used it up
is looked at again.

This leaves out looks, never contacts: a robot that passes here would pass the exact look too.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from hive_common.geometry import distances

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from hive_common.geometry import Array, Indices
    from simenv.world.surroundings import Surroundings

REACH = 2.0
"""Nothing is sought farther from the middle of a robot [m]."""

ROUNDING = 1e-6
"""Taken off every distance, lest a last bit matters [m]."""

PAUSE = 8
"""A robot that is too near to something is not measured again for so many steps."""


class Clearance:
    """How far n robots may go before they are to be looked at; row i belongs to robot i."""

    def __init__(self, surroundings: Surroundings) -> None:
        """Know nothing of robots yet.

        Args:
            surroundings: What there is besides robots.
        """
        self._surroundings = surroundings
        self._obstacles = surroundings.obstacles
        self.begin(np.zeros(0))

    def begin(self, radii: Array) -> None:
        """Look at everybody anew.

        Args:
            radii: (n,) of the circles around the robots' bases that hold them [m].
        """
        self._radii = radii
        self._still = np.full(len(radii), -np.inf)
        self._moving = np.full(len(radii), -np.inf)
        self._paused = np.zeros(len(radii), dtype=int)
        self._walked = self._obstacles.walked
        self._changes = self._obstacles.changes

    def doubtful(self, poses: Array, ways: Array, swings: Array) -> Indices:
        """Return which robots may touch something in a step; the others surely do not.

        The others keep their distance even from where any robot may be moved to meanwhile.

        Args:
            poses: (n, 3) where the robots stand before the step, frame map.
            ways: (n,) how far their bases go at most [m].
            swings: (n,) how far anything on them goes at most [m], at least `ways`.

        Returns:
            (k,) rows in ascending order; of robots that move only.
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
        """Return (n,) whose room is used up after a step in which nothing goes farther."""
        short: NDArray[np.bool_] = np.minimum(self._still, self._moving - widest) < 0
        return short

    def _measure(self, rows: Indices, poses: Array) -> None:
        """Note how much room robots have around them where they stand."""
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
