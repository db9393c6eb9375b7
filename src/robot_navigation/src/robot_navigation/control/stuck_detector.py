# SPDX-License-Identifier: BSD-3-Clause
"""Since when a robot has been standing still."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from robot_navigation.planning.path import angle_between

if TYPE_CHECKING:
    from hive_common.pose import Pose

DISTANCE = 0.05
"""Moving less than this is standing still [m]."""

ANGLE = 0.1
"""Turning less than this is standing still [rad]."""


class StuckDetector:
    """Notices when a robot moves.

    Attributes:
        since: When it last moved [s].
    """

    def __init__(self) -> None:
        self.since = -math.inf
        self._mark: Pose | None = None

    def update(self, now: float, pose: Pose) -> None:
        """Take note of where the robot is.

        Args:
            now: The time [s].
            pose: Frame map.
        """
        mark = self._mark
        if (
            mark is None
            or math.dist(mark[:2], pose[:2]) > DISTANCE
            or abs(angle_between(mark.yaw, pose.yaw)) > ANGLE
        ):
            self._mark = pose
            self.since = now

    def lasts(self, now: float) -> float:
        """Return for how long the robot has been standing [s]."""
        return now - self.since
