# SPDX-License-Identifier: BSD-3-Clause
"""What robots' wheels measure of their motion."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from hive_common.geometry import Array, Indices
    from simenv.noise import Noise

BLOCK = 64
"""Steps of a robot for which random numbers are drawn at once; one by one gives the same."""

DRAWS = 3  # errors of a step: in distance, in turning, and by veering off


class Wheels:
    """The wheels of n robots, with errors by `noise`; row i of every array belongs to robot i."""

    def __init__(self, noise: Noise) -> None:
        self._noise = noise
        self._errors = np.array([noise.distance, noise.heading, noise.veer])
        self._random: list[np.random.Generator] = []
        self._shares = np.zeros((0, 3))
        self._drawn = np.zeros((0, BLOCK, DRAWS))
        self._used = np.zeros(0, dtype=int)

    def add(self, random: np.random.Generator) -> None:
        """Add the wheels of a robot; `random` makes their errors."""
        self._random.append(random)
        along, turning = random.normal(1.0, self._noise.wheels, 2)
        self._shares = np.vstack([self._shares, (along, along, turning)])
        self._drawn = np.concatenate([self._drawn, np.zeros((1, BLOCK, DRAWS))])
        self._used = np.append(self._used, BLOCK)

    def remove(self, row: int) -> None:
        """Remove the wheels of a robot."""
        del self._random[row]
        self._shares = np.delete(self._shares, row, axis=0)
        self._drawn = np.delete(self._drawn, row, axis=0)
        self._used = np.delete(self._used, row)

    def felt(self, driven: Array, ways: Array, turns: Array) -> Array:
        """Return what the wheels make of shifts.

        Args:
            driven: (n, 3) how far each base went, in its own frame [m, m, rad].
            ways: (n,) how long that way is [m].
            turns: (n,) how much of that is turning, at least 0 [rad].

        Returns:
            (n, 3); wheels that have not turned feel nothing.
        """
        rows = (ways + turns).nonzero()[0]
        shifts = driven[rows]
        root = np.sqrt(ways[rows])
        along, turning, veer = self._draw(rows).T
        felt_here: Array = shifts * self._shares[rows]
        # What grows with the root of the way, as a share of the way.
        felt_here[:, :2] += shifts[:, :2] * (along / np.where(root > 0, root, 1.0))[:, None]
        felt_here[:, 2] += np.sqrt(turns[rows]) * turning + root * veer
        if len(rows) == len(driven):
            return felt_here
        felt = np.zeros_like(driven)
        felt[rows] = felt_here
        return felt

    def _draw(self, rows: Indices) -> Array:
        """Return the next errors (k, DRAWS) of these robots, each from its own source."""
        used = self._used[rows]
        for row in rows[used == BLOCK].tolist():
            self._drawn[row] = self._random[row].normal(size=(BLOCK, DRAWS)) * self._errors
            self._used[row] = 0
        drawn: Array = self._drawn[rows, self._used[rows]]
        self._used[rows] += 1
        return drawn
