# SPDX-License-Identifier: BSD-3-Clause
"""What a robot's `move_base` hears and sees: pose, scan, the other robots, its own arm."""

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

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from hive_common.pose import Pose
    from hive_common.ros.inbox import Inbox
    from robot_navigation.traffic.right_of_way import Announcement

_AT_WORK = {GoalStatus.PENDING, GoalStatus.ACTIVE, GoalStatus.PREEMPTING}


class Senses:
    """The latest of everything, as the main thread has taken it in.

    Args:
        inbox: Through which the main thread takes it in.
        hive: Namespace of the hive, ending in a slash.
        map_frame: Frame of goals and plans.
        base_frame: Frame of the robot's base.
        timeout: What is older counts as not there [s].

    ROS Subscribers: `scan` (sensor_msgs/LaserScan), `pick/status` (actionlib_msgs/
        GoalStatusArray), `traffic` of the hive (robot_description/Traffic), tf.

    Attributes:
        heard: The latest announcement of every robot that speaks, this one included.
        arm_at_work: Whether the robot picks or puts down at the moment.
    """

    def __init__(
        self, inbox: Inbox, hive: str, map_frame: str, base_frame: str, timeout: float
    ) -> None:
        self.heard: dict[str, Announcement] = {}
        self.arm_at_work = False
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
        """Return where the base is, frame map, or None where that has not been known lately."""
        try:
            found = self.lookup(*self._frames)
        except tf2_ros.TransformException:
            return None
        return found

    def lookup(self, parent: str, child: str) -> Pose:
        """Return where a frame is in another one, as far as is known lately.

        Raises:
            tf2_ros.TransformException: It is not known.
        """
        found = self._transforms.lookup_transform(parent, child, rospy.Time(0))
        age = rospy.Time.now() - found.header.stamp
        if not found.header.stamp.is_zero() and age > self._timeout:
            raise tf2_ros.ExtrapolationException(
                f"the latest transform from {child} to {parent} is {age.to_sec():.1f} s old"
            )
        return pose_from_transform(found.transform)

    def ranges(self) -> NDArray[np.float64] | None:
        """Return the latest scan (beams,) [m], or None where there has been none lately."""
        scan = self._scan
        if scan is None or rospy.Time.now() - scan.header.stamp > self._timeout:
            return None
        return np.asarray(scan.ranges, dtype=np.float64)

    def missing(self) -> str:
        """Say what is missing; empty where everything is there."""
        if self.ranges() is None:
            return f"no scan lately on {rospy.resolve_name('scan')}: start the laser"
        if self.pose() is None:
            parent, child = self._frames
            return f"no transform lately from {child} to {parent}: start the localization"
        return ""

    def _see(self, msg: LaserScan) -> None:
        self._inbox.put(lambda: setattr(self, "_scan", msg))

    def _feel(self, msg: GoalStatusArray) -> None:
        at_work = any(status.status in _AT_WORK for status in msg.status_list)
        self._inbox.put(lambda: setattr(self, "arm_at_work", at_work))

    def _hear(self, msg: Traffic) -> None:
        try:
            said = traffic_from_msg(msg)
        except ValueError as error:
            rospy.logwarn_throttle_identical(10, str(error))
            return
        self._inbox.put(lambda: self.heard.update({said.name: said}))
