# SPDX-License-Identifier: BSD-3-Clause
"""Progress towards one goal: failed attempts, whether the robot is stuck, and when to give up."""

from __future__ import annotations

import math
from dataclasses import dataclass, fields
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from hive_common.number_checks import check_numbers
from hive_navigation.planning.path import angle_between

if TYPE_CHECKING:
    from collections.abc import Sequence

    from hive_common.geometry import Array
    from hive_common.pose import Pose
    from hive_navigation.traffic.right_of_way import Meeting

MIN_PROGRESS = 0.1  # the remaining path must shrink by this much to count as progress [m]
STUCK_DISTANCE = 0.05  # a robot that moves less than this stands still [m]
STUCK_ANGLE = 0.1  # a robot that turns less than this stands still [rad]


@dataclass(frozen=True)
class NavigationSettings:
    """The settings of one robot's navigation; `config/move_base.yaml` explains each.

    Raises:
        ParameterError: A value is not above 0; `settle` may be 0.
    """

    control_rate: float = 12.0  # [Hz]
    senses_timeout: float = 1.0  # [s]
    patience: float = 5.0  # [s]
    attempts: int = 5
    give_up: float = 120.0  # [s]
    announce: float = 8.0  # [m]
    silence: float = 2.0  # [s]
    settle: float = 0.3  # [s]
    position_tolerance: float = 0.1  # [m]
    yaw_tolerance: float = 0.1  # [rad]

    def __post_init__(self) -> None:
        names = {field.name for field in fields(self)}
        check_numbers(self, above_zero=names - {"settle"}, at_least_zero={"settle"})


class GoalOutcome(NamedTuple):
    """How a goal ended: whether the robot reached it, and a text for people."""

    reached: bool
    text: str


class StuckDetector:
    """Measures how long a robot has been standing still."""

    def __init__(self) -> None:
        self._since = -math.inf
        self._mark: Pose | None = None

    def update(self, now: float, pose: Pose) -> None:
        """Take in the robot's pose, frame map, at a time [s]."""
        mark = self._mark
        if (
            mark is None
            or math.dist(mark[:2], pose[:2]) > STUCK_DISTANCE
            or abs(angle_between(mark.yaw, pose.yaw)) > STUCK_ANGLE
        ):
            self._mark = pose
            self._since = now

    def duration(self, now: float) -> float:
        """Return how long the robot has been standing still [s]."""
        return now - self._since


class GoalTracker:
    """One goal and the attempts to reach it."""

    def __init__(self, goal: Pose, now: float, settings: NavigationSettings) -> None:
        self.goal = goal  # frame map
        self.retry_at = now  # the robot does not plan again before this time [s]
        self._settings = settings
        self._failures = 0
        self._least_left = math.inf
        self._progress_at = now

    def update(self, now: float, left: float) -> None:
        """Take in the length of the remaining path [m]."""
        if left < self._least_left - MIN_PROGRESS:
            self._least_left = left
            self._progress_at = now

    def note_progress(self, now: float) -> None:
        """Take in that the robot has come on, whatever remains of its path."""
        self._progress_at = now

    def is_hopeless(self, now: float) -> bool:
        """Return whether the robot has made no progress for too long."""
        return now - self._progress_at > self._settings.give_up

    def attempt_failed(self, now: float, why: str) -> GoalOutcome | None:
        """Count a failed attempt; return the outcome if it was the last one allowed."""
        self._failures += 1
        self.retry_at = now + self._settings.patience
        if self._failures <= self._settings.attempts:
            return None
        text = f"{why} (given up after {self._settings.attempts} attempts)"
        return GoalOutcome(reached=False, text=text)

    def blocked(self, now: float, pose: Pose, points: Array) -> GoalOutcome | None:
        """Count an attempt that obstacles at `points` (n, 2), frame map [m], have stopped.

        The next attempt may follow at once.
        """
        x, y = points[np.argmin(np.hypot(*(points - np.array(pose[:2])).T))]
        outcome = self.attempt_failed(
            now,
            f"an obstacle that is not on the map blocks the path at ({x:.2f}, {y:.2f}); "
            "clear it away, or choose another goal",
        )
        self.retry_at = now
        return outcome

    def stopped_at(self, now: float, pose: Pose) -> GoalOutcome | None:
        """Compare the pose in which the robot stopped with the goal."""
        away = math.dist(pose[:2], self.goal[:2])
        turned = abs(angle_between(pose.yaw, self.goal.yaw))
        settings = self._settings
        if away <= settings.position_tolerance and turned <= settings.yaw_tolerance:
            text = f"reached within {away:.2f} m and {turned:.2f} rad"
            return GoalOutcome(reached=True, text=text)
        return self.attempt_failed(
            now,
            f"the robot missed the goal by {away:.2f} m and {turned:.2f} rad; allowed: "
            f"{settings.position_tolerance:g} m and {settings.yaw_tolerance:g} rad",
        )

    def given_up(self, pose: Pose, met: Sequence[Meeting]) -> GoalOutcome:
        """Return the outcome of a hopeless goal; the text says what blocks the robot where."""
        text = f"no progress towards the goal for {self._settings.give_up:g} s; the robot is at "
        text += f"({pose.x:.2f}, {pose.y:.2f})"
        nearest = min(met, key=lambda meeting: meeting.room, default=None)
        if nearest is not None and math.isfinite(nearest.room):
            other = nearest.other
            text += f" behind {other.name} at ({other.x:.2f}, {other.y:.2f})"
            text += ", which stays there" if other.stationary else ""
        return GoalOutcome(reached=False, text=text + "; clear the path and send the goal again")
