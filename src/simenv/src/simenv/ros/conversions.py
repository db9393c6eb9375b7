# SPDX-License-Identifier: BSD-3-Clause
"""What the simulation says, as ROS messages."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import nav_msgs.msg
import rospy
import sensor_msgs.msg
from geometry_msgs.msg import Quaternion, TransformStamped

from robot_description.follower import Pose
from robot_description.ros.conversions import cells_from_msg, pose_from_msg
from simenv.errors import MapError
from simenv.map_file import GridMap

if TYPE_CHECKING:
    from geometry_msgs.msg import Pose2D
    from std_msgs.msg import Header

    from robot_description.models import Laser
    from simenv.geometry import Array


def stamp_of(nanoseconds: int) -> rospy.Time:
    """Return a simulated time [ns] as a stamp."""
    return rospy.Time(*divmod(nanoseconds, 1_000_000_000))


def quaternion_of(yaw: float) -> Quaternion:
    """Return a turn about the z axis [rad]."""
    return Quaternion(0.0, 0.0, math.sin(yaw / 2), math.cos(yaw / 2))


def pose_from(message: Pose2D) -> Pose:
    """Return the pose that a message holds."""
    return Pose(message.x, message.y, message.theta)


def odometry_msg(
    header: Header, child_frame: str, pose: Pose, velocity: tuple[float, float, float]
) -> nav_msgs.msg.Odometry:
    """Say where a robot is.

    Args:
        header: Stamp, and the frame of the pose.
        child_frame: The frame that is there, in which the velocity is given.
        pose: Where it is [m, m, rad].
        velocity: vx, vy, wz [m/s, m/s, rad/s].
    """
    message = nav_msgs.msg.Odometry(header=header, child_frame_id=child_frame)
    message.pose.pose.position.x = pose.x
    message.pose.pose.position.y = pose.y
    message.pose.pose.orientation = quaternion_of(pose.yaw)
    twist = message.twist.twist
    twist.linear.x, twist.linear.y, twist.angular.z = velocity
    return message


def transform_msg(header: Header, child_frame: str, pose: Pose) -> TransformStamped:
    """Say where a frame is, seen from the frame of the header."""
    message = TransformStamped(header=header, child_frame_id=child_frame)
    message.transform.translation.x = pose.x
    message.transform.translation.y = pose.y
    message.transform.rotation = quaternion_of(pose.yaw)
    return message


def scan_msg(
    header: Header, laser: Laser, angles: Array, distances: Array
) -> sensor_msgs.msg.LaserScan:
    """Say what a laser measured.

    Args:
        header: Stamp, and the laser's frame.
        laser: The laser.
        angles: (beams,) their directions in that frame [rad].
        distances: (beams,) what they measured [m].
    """
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


def map_msg(header: Header, grid: GridMap) -> nav_msgs.msg.OccupancyGrid:
    """Return a map as a message; `header` says its frame and when it was loaded."""
    message = nav_msgs.msg.OccupancyGrid(header=header)
    message.info.map_load_time = header.stamp
    message.info.resolution = grid.resolution
    message.info.height, message.info.width = grid.cells.shape
    message.info.origin.position.x = grid.origin.x
    message.info.origin.position.y = grid.origin.y
    message.info.origin.orientation = quaternion_of(grid.origin.yaw)
    message.data = grid.cells.ravel().tolist()
    return message


def map_from_msg(message: nav_msgs.msg.OccupancyGrid) -> GridMap:
    """Return the map that a message holds.

    Raises:
        MapError: It holds none.
    """
    info = message.info
    if not (info.resolution > 0 and 0 < info.width * info.height == len(message.data)):
        raise MapError(
            f"the message holds {len(message.data)} cells, {info.width} x {info.height} of "
            f"{info.resolution:g} m; allowed: width x height cells of more than 0 m"
        )
    try:
        origin = pose_from_msg(info.origin)
    except ValueError as error:
        raise MapError(f"the map's origin: {error}") from None
    return GridMap(cells_from_msg(message), info.resolution, origin)
