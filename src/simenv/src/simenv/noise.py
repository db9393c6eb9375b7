# SPDX-License-Identifier: BSD-3-Clause
"""Noise of the robots' sensors."""

from __future__ import annotations

import math
import zlib
from dataclasses import dataclass, fields

import numpy as np

from simenv.errors import CommandError


@dataclass(frozen=True)
class Noise:
    """Noise of the robots' sensors; every figure at least 0.

    The errors of the odometry grow with the square root of the distance, as in the motion model of
    Thrun, Burgard and Fox, "Probabilistic Robotics", 2005, section 5.4. Wheels also differ from
    their nominal size, so each robot has a constant error of its own (Borenstein and Feng,
    "Measurement and correction of systematic odometry errors in mobile robots", 1996).
    """

    laser: float = 0.01  # standard deviation of a measured distance [m]
    distance: float = 0.01  # standard deviation of the odometry's distance after 1 m [m]
    heading: float = 0.01  # standard deviation of the odometry's heading after turning 1 rad [rad]
    veer: float = 0.01  # standard deviation of the odometry's heading after 1 m [rad]
    wheels: float = 0.005  # standard deviation of robots' relative errors of distance and turn [-]

    def __post_init__(self) -> None:
        """Refuse what is not a standard deviation."""
        for field in fields(self):
            value = getattr(self, field.name)
            if not (math.isfinite(value) and value >= 0):
                raise CommandError(f"noise {field.name}: {value}; allowed: a number, at least 0")

    def times(self, share: float) -> Noise:
        """Return this noise multiplied by `share`, at least 0."""
        return Noise(*(getattr(self, field.name) * share for field in fields(self)))


NO_NOISE = Noise(0.0, 0.0, 0.0, 0.0, 0.0)  # perfect sensors


@dataclass(frozen=True)
class Dice:
    """A robot's random generators, one a sensor, so that none depends on the use of another."""

    wheels: np.random.Generator
    laser: np.random.Generator
    arm: np.random.Generator


def dice_of(seed: int, name: str) -> Dice:
    """Return a robot's random generators.

    They depend on the seed and the name alone, so another robot or another scan does not change
    what the others measure.
    """
    sources = np.random.SeedSequence([seed, zlib.crc32(name.encode())]).spawn(3)
    return Dice(*map(np.random.default_rng, sources))
