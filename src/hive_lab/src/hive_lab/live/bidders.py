# SPDX-License-Identifier: BSD-3-Clause
"""Fake bases of robots that bid and never drive, for measuring the auction alone.

    python3 -m hive_lab.live.bidders /robot1 /robot2

takes the namespaces of all robots, so that they share one process beside the hive's own.
"""

from __future__ import annotations

from typing import Any

import actionlib
import rospy
from geometry_msgs.msg import PoseWithCovarianceStamped
from move_base_msgs.msg import MoveBaseAction

from hive_common.ros import action_servers
from hive_common.ros.signals import init_node
from hive_lab.live.fake_base import pose_message

SPACING = 2.0  # distance between two robots, which stand in a row [m]


class Bidder:
    """A robot's localization, and a `move_base` that accepts every goal and never moves.

    Create it after `rospy.init_node`; the robot stands at x [m], y = 0.

    ROS Actions: server of `move_base` (move_base_msgs/MoveBaseAction).
    ROS Publishers: `amcl_pose` (geometry_msgs/PoseWithCovarianceStamped), latched.
    """

    def __init__(self, namespace: str, x: float) -> None:
        self._pose = rospy.Publisher(
            f"{namespace}/amcl_pose", PoseWithCovarianceStamped, latch=True, queue_size=1
        )
        self._pose.publish(pose_message(x, 0.0))
        self._server = actionlib.ActionServer(
            f"{namespace}/move_base", MoveBaseAction, _accept, _cancel, auto_start=False
        )
        action_servers.start(self._server)


def _accept(goal: Any) -> None:  # noqa: ANN401  (a ServerGoalHandle)
    goal.set_accepted()


def _cancel(goal: Any) -> None:  # noqa: ANN401  (a ServerGoalHandle)
    goal.set_canceled()


def main() -> None:
    """Serve until the node is shut down."""
    init_node("bidders", anonymous=True)
    robots = [Bidder(name, SPACING * i) for i, name in enumerate(rospy.myargv()[1:])]
    rospy.spin()
    robots.clear()


if __name__ == "__main__":
    main()
