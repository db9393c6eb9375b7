# SPDX-License-Identifier: BSD-3-Clause
"""Where the odometry had a robot a moment ago: a scan and the odometry rarely come together."""

from __future__ import annotations

from collections import deque
from typing import TYPE_CHECKING

from hive_common.pose import blend

if TYPE_CHECKING:
    from hive_common.pose import Pose

KEPT = 100
"""How many readings are kept: 5 s at 20 Hz."""


class OdometryHistory:
    """The latest readings of a robot's odometry."""

    def __init__(self) -> None:
        self._readings: deque[tuple[float, Pose]] = deque(maxlen=KEPT)

    def add(self, time: float, pose: Pose) -> None:
        """Take in a reading; one from before the last means that time began anew [s]."""
        if self._readings and time < self._readings[-1][0]:
            self._readings.clear()
        self._readings.append((time, pose))

    def at(self, time: float) -> Pose | None:
        """Return where the base was, frame odom, or None where that is not known (yet).

        Args:
            time: [s]
        """
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
