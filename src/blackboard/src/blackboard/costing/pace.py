# SPDX-License-Identifier: BSD-3-Clause
"""How long a robot's drives take, learned from those it has done.

Besides its length, a drive's duration depends on the building as much as on the robot: bends,
narrow places, turning at both ends. No data sheet tells it, so a robot begins with a rule of thumb
and corrects it after every drive by recursive least squares (Ljung, "System Identification", 1999,
section 11.2).
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, TypeVar

import numpy as np

from blackboard.errors import CharacteristicsError

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

    from hive_common.pose import Pose

    Floats = NDArray[np.float64]

_Number = TypeVar("_Number", float, "NDArray[np.float64]")

MEAN_SPEED_SHARE = 0.6
"""The rule of thumb: the mean speed over the demo's drives, as a share of the greatest speed
(docs/benchmarks.md)."""

_UNCERTAINTY = (4.0, 1.0, 1.0)
"""How far off the rule of thumb may be [s a drive, s/m, s/rad]."""

_SPREAD = 0.1
"""By which share a drive differs from the next one like it."""

_MAX_ERROR = 0.3
"""A delayed drive counts as longer by this share of its duration at most, or by three times the
uncertainty if that is more."""

_FORGETTING = 0.99
"""Weight of what was learned after the next drive."""

_MIN_DISTANCE = 0.5
"""A shorter drive says nothing [m]."""


class Pace:
    """Predicts the duration of drives: a time for each, for each metre, and for each radian.

    Args:
        max_speed: The robot's greatest speed [m/s].
        times: What has been learned already, see `times`; may be empty.

    Attributes:
        times: What a drive takes: [s] in any case, [s/m] for its length, [s/rad] for turning.

    Raises:
        CharacteristicsError: The times are not three.
    """

    times: tuple[float, ...]

    def __init__(self, max_speed: float, times: Sequence[float] = ()) -> None:
        self._least = 1.0 / max_speed
        self._times = np.array(times or (0.0, self._least / MEAN_SPEED_SHARE, 0.0))
        if self._times.shape != (3,):
            raise CharacteristicsError(f"pace is {tuple(times)}; allowed: three times, or nothing")
        self.times = tuple(self._times.tolist())
        self._covariance = np.diag(np.square(_UNCERTAINTY))

    def duration(self, start: Pose, goal: Pose, distance: float) -> float:
        """Return how long a drive over a distance [m] takes [s]; infinite if there is no path."""
        if distance == 0.0 or math.isinf(distance):
            return distance
        turning = _turns(start, goal) if self.times[2] else 0.0
        return max(self._least * distance, _learned(self.times, distance, turning))

    def durations(self, distances: Floats, turning: Floats) -> Floats:
        """Return how long many drives take [s]; see `duration` and `turnings`."""
        least = self._least * distances
        taken = np.maximum(least, _learned(self.times, distances, turning))
        found: Floats = np.where((distances == 0.0) | np.isinf(distances), distances, taken)
        return found

    def learn(self, start: Pose, goal: Pose, distance: float, duration: float) -> None:
        """Learn from a drive that took a time [s]; see `duration`."""
        if not (_MIN_DISTANCE <= distance < math.inf and duration > 0.0):
            return
        share = np.array([1.0, distance, _turns(start, goal)]) / duration
        variance = float(share @ self._covariance @ share)
        most = max(_MAX_ERROR, 3.0 * math.sqrt(variance))
        error = float(np.clip(1.0 - share @ self._times, -most, most))
        gain = self._covariance @ share / (_FORGETTING * _SPREAD**2 + variance)
        self._times = self._times + gain * error
        self.times = tuple(self._times.tolist())
        self._covariance = (
            self._covariance - np.outer(gain, share @ self._covariance)
        ) / _FORGETTING


def _learned(times: tuple[float, ...], distance: _Number, turning: _Number) -> _Number:
    """Return what drives take by what has been learned [s]."""
    per_drive, per_metre, per_radian = times
    return per_drive + per_metre * distance + per_radian * turning


def turnings(starts: Sequence[Pose], goals: Sequence[Pose]) -> Floats:
    """Return how much a robot turns at both ends of straight paths [rad], (starts, goals)."""
    here = np.array([(pose.x, pose.y, pose.yaw) for pose in starts]).reshape(-1, 1, 3)
    there = np.array([(pose.x, pose.y, pose.yaw) for pose in goals]).reshape(1, -1, 3)
    offset = there - here
    bearing = np.arctan2(offset[..., 1], offset[..., 0])
    both = _bend(bearing - here[..., 2]) + _bend(there[..., 2] - bearing)
    stays = (offset[..., 0] == 0.0) & (offset[..., 1] == 0.0)
    found: Floats = np.where(stays, _bend(offset[..., 2]), both)
    return found


def _bend(angle: Floats) -> Floats:
    """Return angles without whole turns and without their signs [rad]."""
    bend: Floats = np.abs((angle + math.pi) % math.tau - math.pi)
    return bend


def _turns(start: Pose, goal: Pose) -> float:
    """Return how much a robot turns at both ends of a straight path [rad]."""
    if start.distance_to(goal) == 0.0:
        return abs(math.remainder(goal.yaw - start.yaw, math.tau))
    bearing = math.atan2(goal.y - start.y, goal.x - start.x)
    turn = abs(math.remainder(bearing - start.yaw, math.tau))
    return turn + abs(math.remainder(goal.yaw - bearing, math.tau))
