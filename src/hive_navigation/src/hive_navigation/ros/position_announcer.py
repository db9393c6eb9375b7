# SPDX-License-Identifier: BSD-3-Clause
"""Announces where a robot is that another `move_base` drives, so that others keep clear of it."""

from __future__ import annotations

from typing import TYPE_CHECKING

import rospy
import tf2_ros
from geometry_msgs.msg import PoseWithCovarianceStamped
from robot_description.msg import Traffic

from hive_common.ros.conversions import pose_from_msg, pose_from_transform
from hive_common.ros.names import own_names
from hive_common.ros.transforms import Transforms
from hive_navigation.ros.conversions import traffic_to_msg
from hive_navigation.ros.startup import read_model, run_node
from hive_navigation.traffic.foreign_robot import ForeignRobot

if TYPE_CHECKING:
    from collections.abc import Callable

    from hive_common.pose import Pose
    from hive_common.ros.names import RobotNames
    from hive_navigation.traffic.right_of_way import Announcement

_MAP_FRAME = "map"
_OLDEST = 2.0  # a transform of longer ago says nothing of now [s]


class PositionAnnouncer:
    """Announces one robot's position, by its tf if there is one, else by its `amcl_pose`.

    `amcl` publishes its pose only when the robot has moved, so the last one stays true; tf is
    newer while the robot drives.

    ROS Subscribers: tf, from map to the robot's base; `amcl_pose`
        (geometry_msgs/PoseWithCovarianceStamped).
    ROS Publishers: `traffic` (robot_description/Traffic) of the hive.
    ROS Parameters: `characteristics` of the robot.

    Args:
        names: The robot's names.
        transforms: What is known of tf.
        tell: Publishes an announcement in a frame.
        base_frame: The frame of the robot's base; empty for `base_footprint` with the robot's
            name in front.

    Raises:
        ParameterError: The robot has no model.
    """

    PERIOD = 0.2
    """Time between two announcements [s]; a claim lasts longer (`right_of_way.CLAIM_TIME`)."""

    def __init__(
        self,
        names: RobotNames,
        transforms: tf2_ros.Buffer,
        tell: Callable[[Announcement, str], None],
        base_frame: str = "",
    ) -> None:
        self._robot = ForeignRobot(names.robot, read_model(names).base)
        self._base = base_frame or f"{names.robot}/base_footprint"
        self._transforms, self._tell = transforms, tell
        self._localized: Pose | None = None
        topic = names.of("amcl_pose")
        heard = rospy.resolve_name(topic)  # it may be remapped
        self._missing = f"no transform from {self._base} to {_MAP_FRAME} and nothing on {heard}"
        rospy.Subscriber(topic, PoseWithCovarianceStamped, self._localize, queue_size=1)

    def announce(self) -> None:
        """Announce where the robot is, if that is known."""
        pose = self._by_tf() or self._localized
        if pose is None:
            rospy.logwarn_throttle(10, f"{self._missing}: start the robot's localization")
            return
        self._tell(self._robot.announcement(rospy.get_time(), pose), _MAP_FRAME)

    def _by_tf(self) -> Pose | None:
        """Return where tf says that the robot is; None where it does not say."""
        try:
            found = self._transforms.lookup_transform(_MAP_FRAME, self._base, rospy.Time(0))
        except tf2_ros.TransformException:
            return None
        recent = (rospy.Time.now() - found.header.stamp).to_sec() < _OLDEST
        return pose_from_transform(found.transform) if recent else None

    def _localize(self, msg: PoseWithCovarianceStamped) -> None:
        try:
            self._localized = pose_from_msg(msg.pose.pose)
        except ValueError as error:
            rospy.logwarn_throttle_identical(10, f"amcl_pose is ignored: {error}")


def main() -> int:
    """Announce one robot's position; see `PositionAnnouncer`. Return the exit code.

    ROS Parameters: `~base_frame`, the frame of the robot's base (ROBOT/base_footprint).
    """
    return run_node("position_announcer", _run)


def _run() -> None:
    names = own_names()
    transforms = Transforms(cache_time=5.0)
    publisher = rospy.Publisher(f"{names.hive}traffic", Traffic, queue_size=10)

    def tell(announcement: Announcement, frame: str) -> None:
        publisher.publish(traffic_to_msg(announcement, frame))

    base_frame = str(rospy.get_param("~base_frame", ""))
    announcer = PositionAnnouncer(names, transforms, tell, base_frame)
    while not rospy.is_shutdown():
        announcer.announce()
        try:
            rospy.sleep(announcer.PERIOD)
        except rospy.ROSTimeMovedBackwardsException:
            continue
    transforms.close()
