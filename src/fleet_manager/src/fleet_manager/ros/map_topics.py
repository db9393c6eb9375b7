# SPDX-License-Identifier: BSD-3-Clause
"""The topics of what windows and RViz show on the map: clicks, the map, poses and paths.

The command line needs none of their messages, so they are kept out of `hive_topics`.
"""

from __future__ import annotations

from functools import partial
from typing import TYPE_CHECKING

import rosgraph.names
import rospy
from geometry_msgs.msg import PointStamped, PoseStamped, PoseWithCovarianceStamped
from nav_msgs.msg import OccupancyGrid, Path
from rospy.numpy_msg import numpy_msg

from fleet_manager.codec.drive_facts import path_fact, pose_fact
from fleet_manager.desk.chart import levels_of
from fleet_manager.desk.facts import Clicked, MapKnown
from hive_common.errors import MapError
from hive_common.pose import Pose
from hive_common.ros.conversions import map_from_msg, pose_from_msg
from hive_common.ros.names import RobotNames, plan_topic

if TYPE_CHECKING:
    from fleet_manager.desk.inbox import FactSink


class MapTopics:
    """Listens to what is drawn on the map; `put` takes in facts."""

    def __init__(self, put: FactSink) -> None:
        self._put = put

    def listen_to_person(self) -> None:
        """Follow where a person points in RViz, and the map.

        ROS Subscribers:
            clicked_point (geometry_msgs/PointStamped), move_base_simple/goal
            (geometry_msgs/PoseStamped), map (nav_msgs/OccupancyGrid).
        """
        rospy.Subscriber("clicked_point", PointStamped, self._hear_point)
        rospy.Subscriber("move_base_simple/goal", PoseStamped, self._hear_goal)
        rospy.Subscriber("map", numpy_msg(OccupancyGrid), self._hear_map)

    def listen_to_drive(self, robot: str) -> None:
        """Follow a robot's pose and its planned path.

        ROS Subscribers:
            ROBOT/amcl_pose (geometry_msgs/PoseWithCovarianceStamped), ROBOT/move_base/plan
            (nav_msgs/Path), or the topic that the robot's parameter `plan_topic` names.
        """
        if rosgraph.names.is_legal_base_name(robot):
            hear = partial(self._hear_path, robot)
            plan = plan_topic(RobotNames(rospy.get_namespace(), robot))
            rospy.Subscriber(plan, Path, hear, queue_size=1)
            locate = partial(self._hear_pose, robot)
            rospy.Subscriber(f"{robot}/amcl_pose", PoseWithCovarianceStamped, locate, queue_size=1)

    def _hear_point(self, msg: PointStamped) -> None:
        pose = Pose(msg.point.x, msg.point.y)
        self._put(Clicked(pose, msg.header.frame_id, has_heading=False))

    def _hear_goal(self, msg: PoseStamped) -> None:
        try:
            pose = pose_from_msg(msg.pose)
        except ValueError as error:
            _warn_of_pose(error)
        else:
            self._put(Clicked(pose, msg.header.frame_id, has_heading=True))

    def _hear_map(self, msg: OccupancyGrid) -> None:
        try:
            levels = levels_of(map_from_msg(msg))
        except MapError as error:
            rospy.logwarn_throttle_identical(10, f"a map is ignored: {error}")
            return
        self._put(MapKnown(levels), "map")

    def _hear_pose(self, robot: str, msg: PoseWithCovarianceStamped) -> None:
        try:
            self._put(pose_fact(robot, msg), ("pose", robot))
        except ValueError as error:
            _warn_of_pose(error)

    def _hear_path(self, robot: str, msg: Path) -> None:
        self._put(path_fact(robot, msg), ("path", robot))


def _warn_of_pose(error: ValueError) -> None:
    rospy.logwarn_throttle_identical(10, f"a pose is ignored: {error}")
