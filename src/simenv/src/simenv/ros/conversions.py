# SPDX-License-Identifier: BSD-3-Clause
"""Makes ROS messages from what the simulation measures."""

from __future__ import annotations

from typing import TYPE_CHECKING

import nav_msgs.msg
import rospy
import sensor_msgs.msg

from hive_common.ros.conversions import quaternion_of

if TYPE_CHECKING:
    from std_msgs.msg import Header

    from hive_common.geometry import Array
    from hive_common.pose import Pose
    from robot_description.models import Laser


def stamp_of(nanoseconds: int) -> rospy.Time:
    """Return a simulated time [ns] as a stamp."""
    return rospy.Time(*divmod(nanoseconds, 1_000_000_000))


def odometry_msg(
    header: Header, child_frame: str, pose: Pose, velocity: tuple[float, float, float]
) -> nav_msgs.msg.Odometry:
    """Make an Odometry: `pose` in the header's frame, `velocity` in `child_frame`."""
    message = nav_msgs.msg.Odometry(header=header, child_frame_id=child_frame)
    message.pose.pose.position.x = pose.x
    message.pose.pose.position.y = pose.y
    message.pose.pose.orientation = quaternion_of(pose.yaw)
    twist = message.twist.twist
    twist.linear.x, twist.linear.y, twist.angular.z = velocity
    return message


def scan_msg(
    header: Header, laser: Laser, angles: Array, distances: Array
) -> sensor_msgs.msg.LaserScan:
    """Make a LaserScan of distances (beams,) [m] at angles (beams,) [rad] in the laser's frame."""
    return sensor_msgs.msg.LaserScan(
        header=header,
        angle_min=float(angles[0]),
        angle_max=float(angles[-1]),
        angle_increment=laser.field_of_view / laser.beams,
        scan_time=1.0 / laser.rate,
        range_min=laser.range_min,
        range_max=laser.range_max,
        ranges=distances.tolist(),
    )
