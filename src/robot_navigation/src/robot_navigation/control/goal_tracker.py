# SPDX-License-Identifier: BSD-3-Clause
"""One goal being pursued: what has been tried for it, and when to give it up."""

from __future__ import annotations

import enum
import math
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from robot_navigation.planning.path import angle_between

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

    from hive_common.pose import Pose
    from robot_navigation.control.settings import Settings
    from robot_navigation.traffic.right_of_way import Meeting

NEARER = 0.1
"""A goal counts as nearer when this much less of the way is left [m]."""


class Errand(enum.Enum):
    """Why a robot drives."""

    NONE = 0
    """It does not."""
    GOAL = 1
    """To its goal."""
    ASIDE = 2
    """To a passing place."""


class Outcome(NamedTuple):
    """How a goal has ended: whether it was reached, and what to tell about it."""

    reached: bool
    text: str


class GoalTracker:
    """A goal and how its pursuit goes.

    Attributes:
        goal: Frame map.
        retry_at: Until then the robot does not plan again [s].
    """

    def __init__(self, goal: Pose, now: float, settings: Settings) -> None:
        self.goal = goal
        self.retry_at = now
        self._settings = settings
        self._attempts = 0
        self._least = math.inf
        self._nearer_at = now

    def note(self, now: float, left: float) -> None:
        """Take note of how much of the way is left [m]."""
        if left < self._least - NEARER:
            self._least = left
            self._nearer_at = now

    def hopeless(self, now: float) -> bool:
        """Return whether the goal has come no nearer for too long."""
        return now - self._nearer_at > self._settings.give_up

    def failed(self, now: float, why: str) -> Outcome | None:
        """Count an attempt that failed; return the outcome if it was the last one."""
        self._attempts += 1
        self.retry_at = now + self._settings.patience
        if self._attempts <= self._settings.attempts:
            return None
        text = f"{why} (given up after {self._settings.attempts} attempts)"
        return Outcome(reached=False, text=text)

    def blocked(self, now: float, pose: Pose, points: NDArray[np.float64]) -> Outcome | None:
        """Count an attempt that something seen has stopped; the next one may come at once.

        Args:
            now: The time [s].
            pose: Where the robot is, frame map.
            points: What blocks the way, (n, 2) array, frame map [m].
        """
        x, y = points[np.argmin(np.hypot(*(points - np.array(pose[:2])).T))]
        outcome = self.failed(
            now,
            f"something that is not on the map is in the way at ({x:.2f}, {y:.2f}); "
            "clear it away, or choose another goal",
        )
        self.retry_at = now
        return outcome

    def arrived(self, now: float, pose: Pose) -> Outcome | None:
        """Compare where the robot has come to a stand with the goal."""
        away = math.dist(pose[:2], self.goal[:2])
        turned = abs(angle_between(pose.yaw, self.goal.yaw))
        settings = self._settings
        if away <= settings.position_tolerance and turned <= settings.yaw_tolerance:
            return Outcome(reached=True, text=f"reached within {away:.2f} m and {turned:.2f} rad")
        return self.failed(
            now,
            f"the goal was missed by {away:.2f} m and {turned:.2f} rad; allowed are "
            f"{settings.position_tolerance:g} m and {settings.yaw_tolerance:g} rad",
        )

    def given_up(self, pose: Pose, met: Sequence[Meeting]) -> Outcome:
        """Return the outcome of a goal that comes no nearer, saying what blocks where."""
        text = f"no nearer to the goal for {self._settings.give_up:g} s; the robot stands at "
        text += f"({pose.x:.2f}, {pose.y:.2f})"
        nearest = min(met, key=lambda meeting: meeting.room, default=None)
        if nearest is not None and math.isfinite(nearest.room):
            other = nearest.other
            text += f" behind {other.name} at ({other.x:.2f}, {other.y:.2f})"
            text += ", which stays there" if other.parked else ""
        return Outcome(reached=False, text=text + "; clear the way and send the goal again")
