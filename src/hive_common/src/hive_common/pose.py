# SPDX-License-Identifier: BSD-3-Clause
"""Where something stands in the plane."""

from __future__ import annotations

import math
from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class Pose:
    """A position and heading in the map frame (REP-105).

    Attributes:
        x: [m].
        y: [m].
        yaw: Heading, counter-clockwise from the x axis [rad].
    """

    x: float
    y: float
    yaw: float = 0.0

    @property
    def is_finite(self) -> bool:
        """Whether every number is one: neither `nan` nor infinite."""
        return all(map(math.isfinite, (self.x, self.y, self.yaw)))

    def distance_to(self, other: Pose) -> float:
        """Return the distance to another position as the crow flies [m]."""
        return math.hypot(other.x - self.x, other.y - self.y)

    def __str__(self) -> str:
        return f"({self.x:.2f}, {self.y:.2f})"
