# SPDX-License-Identifier: BSD-3-Clause
"""What a robot's `move_base` senses and hears: pose, scan, the other robots, its own arm."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
import rospy
import tf2_ros
from actionlib_msgs.msg import GoalStatus, GoalStatusArray
from robot_description.msg import Traffic
from rospy.numpy_msg import numpy_msg
from sensor_msgs.msg import LaserScan

from hive_common.ros.conversions import pose_from_transform
from robot_navigation.ros.conversions import traffic_from_msg
from robot_navigation.traffic.neighbourhood import Neighbourhood

if TYPE_CHECKING:
    from hive_common.geometry import Array
    from hive_common.pose import Pose
    from hive_common.ros.inbox import Inbox

_AT_WORK = {GoalStatus.PENDING, GoalStatus.ACTIVE, GoalStatus.PREEMPTING}


class Senses:
    """The latest of each, as the main thread has received it through the inbox.

    Scans and transforms older than `timeout` [s] do not count. `hive` ends in a slash.

    ROS Subscribers: `scan` (sensor_msgs/LaserScan), `pick/status` (actionlib_msgs/
        GoalStatusArray), `traffic` of the hive (robot_description/Traffic), tf.
    """

    def __init__(
        self, inbox: Inbox, hive: str, map_frame: str, base_frame: str, timeout: float
    ) -> None:
        self.heard = Neighbourhood()  # what every robot announces, this one included
        self.arm_at_work = False  # whether the robot is picking or placing
        self._inbox = inbox
        self._frames = map_frame, base_frame
        self._timeout = rospy.Duration.from_sec(timeout)
        self._scan: LaserScan | None = None
        self._transforms = tf2_ros.Buffer(cache_time=rospy.Duration(5))
        self._listener = tf2_ros.TransformListener(self._transforms)
        rospy.Subscriber("scan", numpy_msg(LaserScan), self._see, queue_size=1)
        rospy.Subscriber("pick/status", GoalStatusArray, self._feel, queue_size=1)
        rospy.Subscriber(f"{hive}traffic", Traffic, self._hear, queue_size=50)

    def pose(self) -> Pose | None:
        """Return where the base is, frame map, or None without a recent transform."""
        try:
            return self.lookup(*self._frames)
        except tf2_ros.TransformException:
            return None

    def lookup(self, parent: str, child: str) -> Pose:
        """Return the pose of a frame in another; raise TransformException if none is recent."""
        found = self._transforms.lookup_transform(parent, child, rospy.Time(0))
        age = rospy.Time.now() - found.header.stamp
        if not found.header.stamp.is_zero() and age > self._timeout:
            raise tf2_ros.ExtrapolationException(
                f"the latest transform from {child} to {parent} is {age.to_sec():.1f} s old"
            )
        return pose_from_transform(found.transform)

    def ranges(self) -> Array | None:
        """Return the latest scan (beams,) [m], or None without a recent one."""
        scan = self._scan
        if scan is None or rospy.Time.now() - scan.header.stamp > self._timeout:
            return None
        return np.asarray(scan.ranges, dtype=np.float64)

    def missing(self) -> str:
        """Return what is missing and what to do; empty if nothing is."""
        if self.ranges() is None:
            return f"no recent scan on {rospy.resolve_name('scan')}: start the laser"
        if self.pose() is None:
            parent, child = self._frames
            return f"no recent transform from {child} to {parent}: start the localization"
        return ""

    def _see(self, msg: LaserScan) -> None:
        self._inbox.put(lambda: setattr(self, "_scan", msg))

    def _feel(self, msg: GoalStatusArray) -> None:
        at_work = any(status.status in _AT_WORK for status in msg.status_list)
        self._inbox.put(lambda: setattr(self, "arm_at_work", at_work))

    def _hear(self, msg: Traffic) -> None:
        try:
            announcement = traffic_from_msg(msg)
        except ValueError as error:
            rospy.logwarn_throttle_identical(10, str(error))
            return
        self._inbox.put(lambda: self.heard.hear(announcement))
