# SPDX-License-Identifier: BSD-3-Clause
"""Shows on this machine's ROS master where robots of other machines are, and where they drive."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import rosgraph
import rospy
import tf2_ros
from geometry_msgs.msg import TransformStamped

from blackboard.codec.drive_kinds import KINDS, PLAN, POSE
from hive_common.errors import ParameterError
from hive_common.ros.conversions import pose_from_msg
from hive_common.ros.names import RobotNames, plan_topic
from robot_description.ros.fixed_links import links_of

if TYPE_CHECKING:
    from blackboard.ros.relay import Relay

_MAP_FRAME = "map"


class RemoteDrives:
    """Publishes poses, paths and frames of robots that other machines tell of.

    A robot of this machine is left out: what it says itself is here already, and newer.

    Args:
        relay: Of this process.
        hive: Namespace of the hive on this machine, ending in a slash.

    ROS Publishers: of every robot ROBOT/amcl_pose (geometry_msgs/PoseWithCovarianceStamped) and
        its path (nav_msgs/Path), see `hive_common.ros.names.plan_topic`, both latched; tf from
        map to ROBOT/base_footprint, and between the links of the robot.
    ROS Parameters: ROBOT/robot_description, from which the links are read; `plan_topic` of it.
    """

    def __init__(self, relay: Relay, hive: str) -> None:
        self._relay = relay
        self._hive = hive
        self._broadcaster = tf2_ros.TransformBroadcaster()
        self._static_broadcaster = tf2_ros.StaticTransformBroadcaster()
        self._links: list[TransformStamped] = []

    def show(self, robot: str) -> None:
        """Show a robot from now on, if it is another machine's."""
        names = RobotNames(self._hive, robot)
        try:
            if not _runs_here(names.node):
                self._show(names)
        except OSError as error:
            rospy.logwarn(
                f"it is not shown where {robot} is, because the ROS master does not answer "
                f"({error}); start hive_gateway again"
            )

    def _show(self, names: RobotNames) -> None:
        robot = names.robot
        self._show_links(names)
        poses = rospy.Publisher(names.of(POSE), KINDS[POSE], latch=True, queue_size=1)
        paths = rospy.Publisher(plan_topic(names), KINDS[PLAN], latch=True, queue_size=1)

        def show_pose(msg: Any, _sender: str) -> None:  # noqa: ANN401  (a PoseWithCovarianceStamped)
            pose_from_msg(msg.pose.pose)  # refuses what is no pose
            poses.publish(msg)
            self._broadcaster.sendTransform(_frame_of(robot, msg.pose.pose))

        def show_path(msg: Any, _sender: str) -> None:  # noqa: ANN401  (a Path)
            paths.publish(msg)

        self._relay.hear(f"{robot}/{POSE}", KINDS[POSE], robot, show_pose)
        self._relay.hear(f"{robot}/{PLAN}", KINDS[PLAN], robot, show_path)

    def _show_links(self, names: RobotNames) -> None:
        if not rospy.has_param(names.of("robot_description")):
            return
        try:
            self._links += links_of(names)
        except ParameterError as error:
            rospy.logwarn(f"RViz will not show the body of {names.robot}: {error}")
            return
        # The topic is latched, so its last message has to tell all of them.
        self._static_broadcaster.sendTransform(self._links)


def _runs_here(node: str) -> bool:
    """Return whether a robot's part of the hive runs on this machine.

    In a process with several robots it is no node of its own, but it has that node's parameters.
    """
    if rospy.has_param(node):
        return True
    try:
        rosgraph.Master(rospy.get_name()).lookupNode(node)
    except rosgraph.MasterError:
        return False
    return True


def _frame_of(robot: str, pose: Any) -> TransformStamped:  # noqa: ANN401  (geometry_msgs/Pose)
    """Return where a robot's base is, dated by this machine.

    The robot's clock may be another one's, and a robot that stands tells the same stamp again,
    which tf does not take twice.
    """
    frame = TransformStamped(child_frame_id=f"{robot}/base_footprint")
    frame.header.frame_id, frame.header.stamp = _MAP_FRAME, rospy.Time.now()
    place = frame.transform.translation
    place.x, place.y, place.z = pose.position.x, pose.position.y, pose.position.z
    frame.transform.rotation = pose.orientation
    return frame
