# SPDX-License-Identifier: BSD-3-Clause
"""Robots that stop for a moment, each at random times that no planner foresees."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from collections.abc import Collection

EVERY = 1.0  # so often each robot may stop [s]
CHANCE = 0.01  # that it does
SHORTEST, LONGEST = 1.0, 3.0  # how long it stops [s]


class Delays:
    """Who is stopped when.

    Args:
        seed: Of everything random. Each robot draws for itself, so that it stops at the same
            times in a fleet of any size.
    """

    def __init__(self, seed: int) -> None:
        self._seed = seed
        self._random: list[np.random.Generator] = []
        self._until: list[float] = []  # by robot [s]
        self._next = 0.0  # [s]

    def stopped(self, names: Collection[str], now: float) -> set[str]:
        """Return the robots that are stopped.

        Args:
            names: All robots; further ones come last.
            now: The time [s].
        """
        for number in range(len(self._until), len(names)):
            self._random.append(np.random.default_rng((self._seed, number, 1)))
            self._until.append(-math.inf)
        while self._next <= now:
            for number, random in enumerate(self._random):
                stops, lasts = random.random() < CHANCE, random.uniform(SHORTEST, LONGEST)
                if stops:
                    self._until[number] = self._next + lasts
            self._next += EVERY
        return {name for name, until in zip(names, self._until, strict=True) if now < until}
