# SPDX-License-Identifier: BSD-3-Clause
"""What robots' wheels measure of their motion."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from hive_common.compiled import compiled

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
        self._shares = np.zeros((0, 2))
        self._drawn = np.zeros((0, BLOCK, DRAWS))
        self._used = np.zeros(0, dtype=int)

    def add(self, random: np.random.Generator) -> None:
        """Add the wheels of a robot; `random` makes their errors."""
        self._random.append(random)
        self._shares = np.vstack([self._shares, random.normal(1.0, self._noise.wheels, 2)])
        self._drawn = np.concatenate([self._drawn, np.zeros((1, BLOCK, DRAWS))])
        self._used = np.append(self._used, 0)
        self._draw(-1)

    def remove(self, row: int) -> None:
        """Remove the wheels of a robot."""
        del self._random[row]
        self._shares = np.delete(self._shares, row, axis=0)
        self._drawn = np.delete(self._drawn, row, axis=0)
        self._used = np.delete(self._used, row)

    def felt(self, shifts: Array) -> Array:
        """Return what the wheels make of shifts (n, 3) of the bases in their own frames.

        Wheels that have not turned feel nothing.
        """
        felt, is_used_up = _felt(shifts, self._shares, self._drawn, self._used)
        if is_used_up:
            for row in np.flatnonzero(self._used == BLOCK):
                self._draw(row)
        return felt

    def _draw(self, row: int) -> None:
        """Draw the next errors of a robot, from its own source."""
        self._drawn[row] = self._random[row].normal(size=(BLOCK, DRAWS)) * self._errors
        self._used[row] = 0


@compiled(
    "Tuple((float64[:, ::1], boolean))(float64[:, ::1], float64[:, ::1], float64[:, :, ::1],"
    " int64[::1])"
)
def _felt(shifts: Array, shares: Array, drawn: Array, used: Indices) -> tuple[Array, bool]:
    """Return what the wheels felt, and whether some robot has used up its errors.

    Args:
        shifts: (n, 3) how far each base went, in its own frame [m, m, rad].
        shares: (n, 2) what the wheels measure of a way and of a turn.
        drawn: (n, BLOCK, DRAWS) errors.
        used: (n,) how many of them each robot has used; updated.
    """
    felt = np.zeros_like(shifts)
    is_used_up = False
    for i in range(len(shifts)):
        way, turn = math.hypot(shifts[i, 0], shifts[i, 1]), abs(shifts[i, 2])
        if way == 0 and turn == 0:
            continue
        error = drawn[i, used[i]]
        root = math.sqrt(way)
        # The error grows with the root of the way; here it is a share of the way.
        along = shares[i, 0] + (error[0] / root if way > 0 else 0.0)
        felt[i, 0], felt[i, 1] = shifts[i, 0] * along, shifts[i, 1] * along
        felt[i, 2] = shifts[i, 2] * shares[i, 1] + math.sqrt(turn) * error[1] + root * error[2]
        used[i] += 1
        is_used_up = is_used_up or used[i] == BLOCK
    return felt, is_used_up
