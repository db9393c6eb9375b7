# SPDX-License-Identifier: BSD-3-Clause
"""Converts between ROS messages and the values of navigation and simulation."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

import numpy as np
from geometry_msgs.msg import Point, PoseStamped, Quaternion, TransformStamped, Twist
from geometry_msgs.msg import Pose as PoseMsg
from nav_msgs.msg import OccupancyGrid, Path
from std_msgs.msg import Header

from hive_common.errors import MapError
from hive_common.pose import Pose
from hive_common.turned_map import TurnedMap

if TYPE_CHECKING:
    from collections.abc import Iterable, Sequence

    import rospy
    from numpy.typing import NDArray

    from hive_common.grid_map import GridMap
    from hive_common.pose import Velocity

PLANAR = (0, 1, 5)  # indices of x, y and yaw in a covariance of x, y, z, roll, pitch, yaw
SMALL = 1e-9  # an eigenvalue this little below 0 is a rounding error
MAX_TILT = 0.01  # a map's origin tilted this little is flat: 1 cm on a map of 200 m [rad]


UNIT_WITHIN = 0.1
"""How far the length of a quaternion may be from 1; rounding leaves some thousandths."""


def yaw_of(quaternion: Any) -> float:  # noqa: ANN401  (geometry_msgs/Quaternion)
    """Return the heading [rad] of a quaternion in the plane, which need not be quite normalized.

    Raises:
        ValueError: It is not a rotation: all zero, not finite, or far from length 1.
    """
    q = quaternion
    length = math.hypot(q.x, q.y, q.z, q.w)
    if not abs(length - 1.0) <= UNIT_WITHIN:
        raise ValueError(
            f"orientation ({q.x:g}, {q.y:g}, {q.z:g}, {q.w:g}) is not a rotation; "
            "for a heading send (0, 0, sin(yaw/2), cos(yaw/2))"
        )
    return math.atan2(2 * (q.w * q.z + q.x * q.y), q.w**2 + q.x**2 - q.y**2 - q.z**2)


def quaternion_of(yaw: float) -> Quaternion:
    """Return the quaternion of a heading [rad]."""
    return Quaternion(0.0, 0.0, math.sin(yaw / 2), math.cos(yaw / 2))


def pose_from_msg(msg: Any) -> Pose:  # noqa: ANN401  (geometry_msgs/Pose)
    """Read a geometry_msgs/Pose.

    Raises:
        ValueError: Its position is not finite or too far away, or its orientation is not a
            rotation.
    """
    return _checked(Pose(msg.position.x, msg.position.y, yaw_of(msg.orientation)))


def planar_pose(pose: Sequence[float]) -> PoseMsg:
    """Make a geometry_msgs/Pose of x, y, yaw [m, m, rad]."""
    x, y, yaw = pose
    return PoseMsg(Point(x, y, 0.0), quaternion_of(yaw))


def covariance_to_msg(covariance: NDArray[np.float64]) -> list[float]:
    """Return the 36 numbers of a PoseWithCovariance from (3, 3) of x, y, yaw [m^2, rad^2]."""
    full = np.zeros((6, 6))
    full[np.ix_(PLANAR, PLANAR)] = covariance
    return [float(value) for value in full.ravel()]


def covariance_from_msg(msg: Any) -> NDArray[np.float64]:  # noqa: ANN401  (PoseWithCovariance)
    """Return the covariance (3, 3) of x, y, yaw [m^2, rad^2].

    Raises:
        ValueError: It is not a covariance: not symmetric, or with a variance below 0.
    """
    full = np.array(msg.covariance, dtype=np.float64).reshape(6, 6)
    found: NDArray[np.float64] = full[np.ix_(PLANAR, PLANAR)]
    good = np.isfinite(found).all() and np.allclose(found, found.T)
    if not good or np.linalg.eigvalsh(found).min() < -SMALL:
        raise ValueError(
            "this is not a covariance; send variances of at least 0 for x, y and yaw [m^2, rad^2]"
        )
    return found


def pose_from_transform(msg: Any) -> Pose:  # noqa: ANN401  (geometry_msgs/Transform)
    """Read a geometry_msgs/Transform in the plane."""
    return _checked(Pose(msg.translation.x, msg.translation.y, yaw_of(msg.rotation)))


def _checked(pose: Pose) -> Pose:
    if pose.flaw:
        raise ValueError(f"position ({pose.x:g}, {pose.y:g}) {pose.flaw}; send it in m")
    return pose


def cells_from_msg(msg: Any) -> NDArray[np.int8]:  # noqa: ANN401  (OccupancyGrid, numpy data)
    """Return the cells (rows, columns) of a nav_msgs/OccupancyGrid: -1 unknown, else 0..100."""
    return np.asarray(msg.data, dtype=np.int8).reshape(msg.info.height, msg.info.width)


def grid_from_msg(msg: Any) -> GridMap:  # noqa: ANN401  (OccupancyGrid, with numpy data)
    """Read a nav_msgs/OccupancyGrid as blocked and free cells.

    Raises:
        MapError: See `map_from_msg`.
    """
    return map_from_msg(msg).free_or_blocked()


def pose_to_msg(pose: Pose, frame: str, stamp: rospy.Time) -> PoseStamped:
    """Make a PoseStamped."""
    msg = PoseStamped(header=Header(stamp=stamp, frame_id=frame))
    msg.pose.position.x, msg.pose.position.y = pose.x, pose.y
    msg.pose.orientation = quaternion_of(pose.yaw)
    return msg


def transform_to_msg(pose: Pose, frame: str, child: str, stamp: rospy.Time) -> TransformStamped:
    """Make a TransformStamped: the pose of the frame `child` in `frame`."""
    msg = TransformStamped(header=Header(stamp=stamp, frame_id=frame), child_frame_id=child)
    msg.transform.translation.x, msg.transform.translation.y = pose.x, pose.y
    msg.transform.rotation = quaternion_of(pose.yaw)
    return msg


def path_to_msg(points: Iterable[tuple[float, float]], frame: str, stamp: rospy.Time) -> Path:
    """Make a Path whose poses head along it."""
    corners = [(float(x), float(y)) for x, y in points]
    yaw = 0.0
    poses = []
    for index, (x, y) in enumerate(corners):
        if index + 1 < len(corners):
            next_x, next_y = corners[index + 1]
            yaw = math.atan2(next_y - y, next_x - x)
        poses.append(pose_to_msg(Pose(x, y, yaw), frame, stamp))
    return Path(header=Header(stamp=stamp, frame_id=frame), poses=poses)


def twist_from(velocity: Velocity) -> Twist:
    """Make a Twist."""
    msg = Twist()
    msg.linear.x, msg.linear.y, msg.angular.z = velocity
    return msg


def map_msg(header: Header, grid: GridMap | TurnedMap) -> OccupancyGrid:
    """Make an OccupancyGrid; `header` holds its frame and when it was loaded."""
    message = OccupancyGrid(header=header)
    message.info.map_load_time = header.stamp
    message.info.resolution = grid.resolution
    message.info.height, message.info.width = grid.cells.shape
    message.info.origin.position.x = grid.origin.x
    message.info.origin.position.y = grid.origin.y
    message.info.origin.orientation = quaternion_of(grid.origin.yaw)
    message.data = grid.cells.ravel().tolist()
    return message


def map_from_msg(message: OccupancyGrid) -> GridMap:
    """Read an OccupancyGrid; where its origin has a yaw, draw it anew (`turned_map`).

    Raises:
        MapError: It holds no map, or one that is tilted, or too large to be drawn anew.
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
    turn = info.origin.orientation
    tilt = 2 * math.asin(min(1.0, math.hypot(turn.x, turn.y)))
    if tilt > MAX_TILT:
        raise MapError(
            f"the map's origin is tilted by {tilt:.2g} rad; allowed: a turn about z only, "
            "(0, 0, sin(yaw/2), cos(yaw/2))"
        )
    return TurnedMap(cells_from_msg(message), info.resolution, origin).upright()
