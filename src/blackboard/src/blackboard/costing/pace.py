# SPDX-License-Identifier: BSD-3-Clause
"""How long a robot's drives take, learned from those that it has done.

What a drive takes besides its length hangs on the building as much as on the robot: bends, narrow
places, turning at both ends. No data sheet says it, so a robot begins with a rule of thumb and
corrects it after every drive, by recursive least squares (Ljung, "System Identification", 1999,
section 11.2).
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from blackboard.errors import CharacteristicsError

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from blackboard.domain.path_lengths import PathLengths
    from blackboard.domain.task import TaskStep
    from hive_common.pose import Pose

# Until a robot has driven: the mean of its speed over the drives of the demo is about this share
# of its greatest speed (docs/benchmarks.md).
MEAN_SPEED_SHARE = 0.6

# How far the rule of thumb may be off: s a drive, s/m, s/rad.
_UNSURE = (4.0, 1.0, 1.0)

# By which share a drive differs from the next one like it.
_SPREAD = 0.1

# A drive that was held up counts as if it had taken so much of its time longer at most, or three
# times as much as the robot is unsure about it where that is more.
_MOST = 0.3

# What was learned counts for so much after the next drive.
_MEMORY = 0.99

# A drive shorter than this [m] says nothing.
_SHORTEST = 0.5


class Pace:
    """Predicts the duration of drives: a time for each, one a metre, and one a radian of turning.

    Args:
        max_speed: The robot's greatest speed [m/s].
        times: What has been learned already, see `times`; empty where nothing has.

    Raises:
        CharacteristicsError: The times are not three.
    """

    def __init__(self, max_speed: float, times: Sequence[float] = ()) -> None:
        self._least = 1.0 / max_speed
        self._times = np.array(times or (0.0, self._least / MEAN_SPEED_SHARE, 0.0))
        if self._times.shape != (3,):
            raise CharacteristicsError(f"pace is {tuple(times)}; allowed: three times, or nothing")
        self._unsure = np.diag(np.square(_UNSURE))

    @property
    def times(self) -> tuple[float, ...]:
        """What a drive takes: [s] in any case, [s/m] for its length, [s/rad] for turning."""
        return tuple(self._times.tolist())

    def duration(self, start: Pose, goal: Pose, way: float) -> float:
        """Return how long a drive takes [s].

        Args:
            start: Where it begins.
            goal: Where it ends.
            way: Its length [m]; infinite where there is none.
        """
        if way == 0.0 or math.isinf(way):
            return way
        per_drive, per_metre, per_radian = self._times.tolist()
        learned = per_drive + per_metre * way + per_radian * _turns(start, goal)
        return max(float(learned), self._least * way)

    def learn(self, start: Pose, goal: Pose, way: float, duration: float) -> None:
        """Take a drive into account that took a time [s]; see `duration`."""
        if not (_SHORTEST <= way < math.inf and duration > 0.0):
            return
        share = np.array([1.0, way, _turns(start, goal)]) / duration
        doubt = float(share @ self._unsure @ share)
        most = max(_MOST, 3.0 * math.sqrt(doubt))
        error = float(np.clip(1.0 - share @ self._times, -most, most))
        gain = self._unsure @ share / (_MEMORY * _SPREAD**2 + doubt)
        self._times = self._times + gain * error
        self._unsure = (self._unsure - np.outer(gain, share @ self._unsure)) / _MEMORY


class DriveWatch:
    """Times a robot's drives and lets its pace learn from them; see `executor.StepWatch`.

    Args:
        pace: What learns.
        ways: Knows how far it was.
        now: Gives the time [s].
        here: Says where the robot stands.
    """

    def __init__(
        self,
        pace: Pace,
        path_lengths: PathLengths,
        now: Callable[[], float],
        here: Callable[[], Pose],
    ) -> None:
        self._pace = pace
        self._path_lengths = path_lengths
        self._now = now
        self._here = here
        self._begun: tuple[TaskStep, Pose, float] | None = None

    def begin(self, step: TaskStep) -> None:
        """Note that a drive begins."""
        self._begun = (step, self._here(), self._now())

    def drop(self) -> None:
        """Note that what was begun was stopped, or is tried again: its time says nothing."""
        self._begun = None

    def end(self) -> None:
        """Note that what was begun has been done."""
        if self._begun is not None:
            step, start, since = self._begun
            way = self._path_lengths.length(start, step.goal)
            self._pace.learn(start, step.goal, way, self._now() - since)
        self._begun = None


def _turns(start: Pose, goal: Pose) -> float:
    """Return how much a robot turns at both ends of a straight way [rad]."""
    if start.distance_to(goal) == 0.0:
        return abs(math.remainder(goal.yaw - start.yaw, math.tau))
    bearing = math.atan2(goal.y - start.y, goal.x - start.x)
    ends = (bearing - start.yaw, goal.yaw - bearing)
    return sum(abs(math.remainder(turn, math.tau)) for turn in ends)
