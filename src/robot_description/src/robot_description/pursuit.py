# SPDX-License-Identifier: BSD-3-Clause
"""One goal being pursued, and what has been tried for it."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from robot_description.follower import Pose

NEARER = 0.1
"""A goal counts as nearer when this much less of the way is left [m]."""


class Pursuit:
    """A goal and how its pursuit goes.

    Attributes:
        goal: Frame map.
        attempts: Plans that have failed so far.
        retry_at: When the robot may plan again [s].
        nearer_at: When the goal last came nearer [s].
    """

    def __init__(self, goal: Pose, now: float) -> None:
        self.goal = goal
        self.attempts = 0
        self.retry_at = now
        self.nearer_at = now
        self._least = math.inf

    def note(self, now: float, left: float) -> None:
        """Take note of how much of the way is left [m]."""
        if left < self._least - NEARER:
            self._least = left
            self.nearer_at = now
