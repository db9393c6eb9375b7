# SPDX-License-Identifier: BSD-3-Clause
"""The transforms between the links of robots that share a process; none of them moves."""

from __future__ import annotations

from typing import TYPE_CHECKING

import rospy
from geometry_msgs.msg import Quaternion, TransformStamped, Vector3

from hive_common.errors import ParameterError
from hive_common.structuring import NotAllowedError
from robot_description.joints import fixed_joints

if TYPE_CHECKING:
    from hive_common.ros.names import RobotNames


def links_of(robot: RobotNames) -> list[TransformStamped]:
    """Return the transforms between the links of a robot, from its `robot_description`.

    Raises:
        ParameterError: The parameter is not set, or is not a URDF.
    """
    name = robot.of("robot_description")
    try:
        joints = fixed_joints(str(rospy.get_param(name, "")))
    except NotAllowedError as error:
        raise ParameterError(
            f"{name}: {error}; load it with roslaunch robot_description description.launch"
        ) from None
    transforms = []
    for joint in joints:
        transform = TransformStamped(child_frame_id=joint.child)
        transform.header.frame_id, transform.header.stamp = joint.parent, rospy.Time.now()
        transform.transform.translation = Vector3(*joint.position)
        transform.transform.rotation = Quaternion(*joint.rotation)
        transforms.append(transform)
    return transforms
