# SPDX-License-Identifier: BSD-3-Clause
"""A robot whose navigation knows nothing of right of way, as one that ROS's `move_base` drives.

All that is known of it is where it is. It moves aside for nobody and waits for nobody, so it is
announced as one that stays where it is, and while it moves, as one that claims what it needs to
stop. The others wait for it, or plan around it.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, NamedTuple

from hive_navigation.traffic.right_of_way import (
    Announcement,
    Limits,
    claimed_stretch,
    no_right,
)

if TYPE_CHECKING:
    from hive_common.pose import Pose
    from hive_navigation.planning.path import Point
    from robot_description.models import Base

STANDING = 0.02  # slower than this a robot stands; localization jitters [m/s]
LONGEST = 2.0  # poses further apart than this say nothing of the speed [s]


class _Seen(NamedTuple):
    time: float  # [s]
    x: float  # frame map [m]
    y: float


class ForeignRobot:
    """Turns the poses of a robot into what it would announce.

    Args:
        name: The robot.
        base: Its base, from the robot's model.
    """

    def __init__(self, name: str, base: Base) -> None:
        self._name = name
        self._radius = base.circumscribed_radius
        self._limits = Limits(base.max_speed, base.acceleration, base.max_yaw_rate)
        self._last: _Seen | None = None

    def announcement(self, time: float, pose: Pose) -> Announcement:
        """Return what to announce of the robot.

        Args:
            time: When it was there [s].
            pose: Where it was, frame map.
        """
        path: tuple[Point, ...] = ((pose.x, pose.y),)
        claim = 0.0
        last, self._last = self._last, _Seen(time, pose.x, pose.y)
        if last is not None and 0 < time - last.time < LONGEST:
            dx, dy = pose.x - last.x, pose.y - last.y
            # A pose that was corrected looks like a leap.
            speed = min(math.hypot(dx, dy) / (time - last.time), self._limits.speed)
            if speed > STANDING:
                claim = claimed_stretch(speed, self._limits.acceleration, math.inf)
                reach = claim / math.hypot(dx, dy)
                path = (*path, (pose.x + reach * dx, pose.y + reach * dy))
        return Announcement(
            name=self._name,
            time=time,
            x=pose.x,
            y=pose.y,
            radius=self._radius,
            right=no_right(self._name),
            path=path,
            claim=claim,
            stationary=True,
            yaw=pose.yaw,
            limits=self._limits,
        )
