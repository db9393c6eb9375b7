# SPDX-License-Identifier: BSD-3-Clause
"""What messages tell of where a robot is and where it drives, as the windows' facts."""

from __future__ import annotations

from typing import TYPE_CHECKING

from fleet_manager.desk.facts import PlannedPath, RobotPose
from hive_common.ros.conversions import pose_from_msg

if TYPE_CHECKING:
    from geometry_msgs.msg import PoseWithCovarianceStamped
    from nav_msgs.msg import Path


def pose_fact(robot: str, msg: PoseWithCovarianceStamped) -> RobotPose:
    """Return where a robot is; raise ValueError if the message holds no pose."""
    return RobotPose(robot, pose_from_msg(msg.pose.pose))


def path_fact(robot: str, msg: Path) -> PlannedPath:
    """Return the path that a robot is about to drive."""
    points = tuple((pose.pose.position.x, pose.pose.position.y) for pose in msg.poses)
    return PlannedPath(robot, points)
