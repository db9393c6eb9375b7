# SPDX-License-Identifier: BSD-3-Clause
"""Stands in for robots that bid and do not drive, where only the auction is looked at.

    python3 -m hive_lab.live.bidders /robot1 /robot2

takes the namespaces of all robots, so that they share one process beside the hive's own.
"""

from __future__ import annotations

from typing import Any

import actionlib
import rospy
from geometry_msgs.msg import PoseWithCovarianceStamped
from move_base_msgs.msg import MoveBaseAction

SPACING = 2.0
"""Distance between two robots, which stand in a row [m]."""


class Bidder:
    """A robot's localization and its `move_base`, which takes every goal and never moves.

    Make it after `rospy.init_node`.

    Args:
        namespace: Of the robot.
        x: Where it stands [m], with y = 0.

    ROS Actions: server of `move_base` (move_base_msgs/MoveBaseAction).
    ROS Publishers: `amcl_pose` (geometry_msgs/PoseWithCovarianceStamped), latched.
    """

    def __init__(self, namespace: str, x: float) -> None:
        self._pose = rospy.Publisher(
            f"{namespace}/amcl_pose", PoseWithCovarianceStamped, latch=True, queue_size=1
        )
        message = PoseWithCovarianceStamped()
        message.header.frame_id = "map"
        message.pose.pose.position.x = x
        message.pose.pose.orientation.w = 1.0
        self._pose.publish(message)
        self._server = actionlib.ActionServer(
            f"{namespace}/move_base", MoveBaseAction, _accept, _cancel, auto_start=False
        )
        self._server.start()


def _accept(goal: Any) -> None:  # noqa: ANN401  (a ServerGoalHandle)
    goal.set_accepted()


def _cancel(goal: Any) -> None:  # noqa: ANN401  (a ServerGoalHandle)
    goal.set_canceled()


def main() -> None:
    """Stand in for robots until the node is shut down."""
    rospy.init_node("bidders", anonymous=True)
    robots = [Bidder(name, SPACING * i) for i, name in enumerate(rospy.myargv()[1:])]
    rospy.spin()
    robots.clear()


if __name__ == "__main__":
    main()
