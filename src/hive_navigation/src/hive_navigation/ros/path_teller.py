# SPDX-License-Identifier: BSD-3-Clause
"""Tells which path a robot follows, for windows and RViz."""

from __future__ import annotations

from typing import TYPE_CHECKING

import rospy
from nav_msgs.msg import Path as PathMsg

from hive_common.ros.conversions import path_to_msg
from hive_common.ros.names import OUR_PLAN

if TYPE_CHECKING:
    from hive_common.ros.names import RobotNames
    from hive_navigation.planning.path import Path


class PathTeller:
    """Publishes a robot's planned path when it changes.

    Args:
        robot: The robot's names.
        frame: Of the path.

    ROS Publishers: `move_base/plan` (nav_msgs/Path) of the robot, latched; empty while it follows
        none.
    """

    def __init__(self, robot: RobotNames, frame: str) -> None:
        self._frame = frame
        self._told: Path | None = None
        self._publisher = rospy.Publisher(robot.of(OUR_PLAN), PathMsg, queue_size=1, latch=True)

    def tell(self, path: Path | None, now: rospy.Time) -> None:
        """Say which path the robot follows now; None if it follows none."""
        if path is self._told:
            return
        self._told = path
        points = () if path is None else path.points
        self._publisher.publish(path_to_msg(points, self._frame, now))
