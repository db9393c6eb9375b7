# SPDX-License-Identifier: BSD-3-Clause
"""Odometry of the last seconds: looks up the pose at the time of a scan."""

from __future__ import annotations

from collections import deque
from typing import TYPE_CHECKING

from hive_common.pose import blend

if TYPE_CHECKING:
    from hive_common.pose import Pose

KEPT = 100  # number of readings kept: 5 s at 20 Hz


class OdometryHistory:
    """The latest readings of a robot's odometry."""

    def __init__(self) -> None:
        self._readings: deque[tuple[float, Pose]] = deque(maxlen=KEPT)

    def add(self, time: float, pose: Pose) -> None:
        """Add a reading; if it is older than the last one, time has restarted [s]."""
        if self._readings and time < self._readings[-1][0]:
            self._readings.clear()
        self._readings.append((time, pose))

    def at(self, time: float) -> Pose | None:
        """Return where the base was at a time [s], frame odom, or None if that is not known."""
        after = None
        for then, pose in reversed(self._readings):
            if then == time:
                return pose
            if then < time:
                if after is None:
                    return None
                return blend(pose, after[1], (time - then) / (after[0] - then))
            after = (then, pose)
        return None
