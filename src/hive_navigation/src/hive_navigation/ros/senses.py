# SPDX-License-Identifier: BSD-3-Clause
"""What a robot's `move_base` senses: pose, scan, its own arm."""

from __future__ import annotations

from typing import TYPE_CHECKING

import rospy
import tf2_ros
from actionlib_msgs.msg import GoalStatus, GoalStatusArray
from rospy.numpy_msg import numpy_msg
from sensor_msgs.msg import LaserScan

from hive_common.ros.conversions import pose_from_transform
from hive_navigation.control.catching_up import RECENT, SLACK
from hive_navigation.ros.scan_reader import ScanReader

if TYPE_CHECKING:
    from hive_common.pose import Pose
    from hive_common.ros.names import RobotNames
    from hive_navigation.ros.surroundings import Surroundings
    from robot_description.scan import Scan

_AT_WORK = {GoalStatus.PENDING, GoalStatus.ACTIVE, GoalStatus.PREEMPTING}

_AHEAD = rospy.Duration(10)
"""A transform may be dated ahead, so that it is there when it is asked for; no more than this."""


class Senses:
    """The latest of each, as the control loop has received it through the inbox.

    Scans and transforms older than `timeout` [s] do not count, and neither do scans that
    `ScanReader` skips: a laser that is blind is a laser that is gone. A scan is due every
    `scan_period` [s].

    ROS Subscribers: `scan` (sensor_msgs/LaserScan), `pick/status` (actionlib_msgs/
        GoalStatusArray), of the robot.
    """

    def __init__(
        self,
        names: RobotNames,
        surroundings: Surroundings,
        map_frame: str,
        timeout: float,
        scan_period: float,
    ) -> None:
        self.arm_at_work = False  # whether the robot is picking or placing
        self._inbox = surroundings.inbox
        self._transforms = surroundings.transforms
        self._frames = map_frame, f"{names.robot}/base_footprint"
        self._timeout = rospy.Duration.from_sec(timeout)
        self._scan_recent = scan_period + SLACK
        # The latest that can be used, when it was measured, and when it came.
        self._scan: tuple[rospy.Time, rospy.Time, Scan] | None = None
        self._scan_topic = names.of("scan")
        self._reader = ScanReader(self._scan_topic)
        rospy.Subscriber(self._scan_topic, numpy_msg(LaserScan), self._see, queue_size=1)
        rospy.Subscriber(names.of("pick/status"), GoalStatusArray, self._feel, queue_size=1)

    def pose(self) -> Pose | None:
        """Return where the base is, frame map, or None without a recent transform."""
        try:
            return self.here()
        except (tf2_ros.TransformException, ValueError):
            return None

    def here(self) -> Pose:
        """Return where the base is, frame map; see `lookup` for what it raises."""
        return self.lookup(*self._frames)

    def lookup(self, parent: str, child: str) -> Pose:
        """Return the pose of a frame in another.

        Raises:
            TransformException: None is recent.
            ValueError: The transform is no pose.
        """
        found = self._transforms.lookup_transform(parent, child, rospy.Time(0))
        age = rospy.Time.now() - found.header.stamp
        if not found.header.stamp.is_zero() and not -_AHEAD <= age <= self._timeout:
            raise tf2_ros.ExtrapolationException(
                f"the latest transform from {child} to {parent} is {age.to_sec():.1f} s old"
            )
        return pose_from_transform(found.transform)

    def scan(self) -> Scan | None:
        """Return the latest scan that can be used, or None without a recent one."""
        if self._scan is None:
            return None
        # One that is dated ahead must not count on after the laser has died.
        measured, came, scan = self._scan
        now = rospy.Time.now()
        return scan if max(now - measured, now - came) <= self._timeout else None

    def recent_until(self) -> dict[str, float]:
        """Return until when scan and pose count as recent [s]; see `CatchingUp`."""
        until = {}
        if self._scan is not None:
            until[self._scan_topic] = self._scan[0].to_sec() + self._scan_recent
        try:
            moment = self._transforms.get_latest_common_time(*self._frames)
        except tf2_ros.TransformException:
            return until
        if not moment.is_zero():  # as it is where all transforms are fixed
            until[self._frames[1]] = moment.to_sec() + RECENT
        return until

    def forget(self) -> None:
        """Forget the scan: its time may be one that is still to come."""
        self._scan = None

    def missing(self) -> str:
        """Return what is missing and what to do; empty if nothing is."""
        if self.scan() is None:
            if self._reader.flaw:
                return f"no scan on {self._scan_topic} can be used: {self._reader.flaw}"
            return f"no recent scan on {self._scan_topic}: start the laser"
        if self.pose() is None:
            parent, child = self._frames
            return f"no recent transform from {child} to {parent}: start the localization"
        return ""

    def _see(self, msg: LaserScan) -> None:
        self._inbox.put(lambda: self._take(msg))

    def _take(self, msg: LaserScan) -> None:
        scan = self._reader.read(msg)
        if scan is not None:
            self._scan = (msg.header.stamp, rospy.Time.now(), scan)

    def _feel(self, msg: GoalStatusArray) -> None:
        at_work = any(status.status in _AT_WORK for status in msg.status_list)
        self._inbox.put(lambda: setattr(self, "arm_at_work", at_work))
