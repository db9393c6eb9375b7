# SPDX-License-Identifier: BSD-3-Clause
"""What robots' wheels say of the way that their bases go."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from simenv.geometry import Array, Indices
    from simenv.noise import Noise

BLOCK = 64
"""Chance is drawn for so many steps of a robot at once; the numbers are the same one by one."""

DRAWS = 3
"""Errors of a step: along the way, of turning, of veering off."""


class Wheels:
    """The wheels of n robots; row i of every array belongs to robot i.

    Args:
        noise: How wrong they are, see `Noise`.
    """

    def __init__(self, noise: Noise) -> None:
        self._noise = noise
        self._random: list[np.random.Generator] = []
        self._shares = np.zeros((0, 3))
        self._drawn = np.zeros((0, BLOCK, DRAWS))
        self._used = np.zeros(0, dtype=int)

    def add(self, random: np.random.Generator) -> None:
        """Mount the wheels of one more robot; `random` makes their errors."""
        self._random.append(random)
        along, turning = random.normal(1.0, self._noise.wheels, 2)
        self._shares = np.vstack([self._shares, (along, along, turning)])
        self._drawn = np.concatenate([self._drawn, np.zeros((1, BLOCK, DRAWS))])
        self._used = np.append(self._used, BLOCK)

    def remove(self, row: int) -> None:
        """Take a robot's wheels away."""
        del self._random[row]
        self._shares = np.delete(self._shares, row, axis=0)
        self._drawn = np.delete(self._drawn, row, axis=0)
        self._used = np.delete(self._used, row)

    def felt(self, driven: Array) -> Array:
        """Return what the wheels make of shifts.

        Args:
            driven: (n, 3) how far each base went, in its own frame [m, m, rad].

        Returns:
            (n, 3); wheels that have not turned feel nothing.
        """
        felt = np.zeros_like(driven)
        rows = np.flatnonzero(driven.any(axis=1))
        shifts = driven[rows]
        way, turn = np.hypot(shifts[:, 0], shifts[:, 1]), np.abs(shifts[:, 2])
        root = np.sqrt(way)
        chance = self._draw(rows)
        along = self._noise.distance * root * chance[:, 0] / np.where(way > 0, way, 1.0)
        felt[rows] = shifts * self._shares[rows]
        felt[rows, :2] += shifts[:, :2] * along[:, None]
        felt[rows, 2] += self._noise.heading * np.sqrt(turn) * chance[:, 1]
        felt[rows, 2] += self._noise.veer * root * chance[:, 2]
        return felt

    def _draw(self, rows: Indices) -> Array:
        """Return the next normal numbers (k, DRAWS) of these robots, each from its own source."""
        for row in rows[self._used[rows] == BLOCK].tolist():
            self._drawn[row] = self._random[row].normal(size=(BLOCK, DRAWS))
            self._used[row] = 0
        drawn: Array = self._drawn[rows, self._used[rows]]
        self._used[rows] += 1
        return drawn
