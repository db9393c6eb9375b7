# SPDX-License-Identifier: BSD-3-Clause
"""Localization from the simulator's ground truth, in place of `amcl`."""

from __future__ import annotations

import math
from dataclasses import dataclass

import message_filters
import rospy
import tf2_ros
from geometry_msgs.msg import PoseWithCovarianceStamped
from nav_msgs.msg import Odometry

from hive_common.errors import ParameterError
from hive_common.pose import compose, inverse
from hive_common.ros.conversions import pose_from_msg, transform_to_msg
from hive_common.ros.names import RobotNames, own_names
from hive_navigation.ros.startup import read_settings, run_node

_TRANSFORM_PERIOD = 0.1
_POSE_PERIOD = 0.2
_ROUNDING = 1e-6  # stamps that are a period apart may differ by a little less [s]


@dataclass(frozen=True)
class FakeLocalizationSettings:
    """The parameters of `fake_localization`.

    Attributes:
        transform_tolerance: How far the transform is dated ahead [s], at least 0. Whoever looks up
            where the robot was at its newest scan or odometry needs a transform that is valid
            then; the default is one period of transforms more than the time to the next one.
    """

    transform_tolerance: float = 0.2

    def __post_init__(self) -> None:
        """Refuse a time that is negative or no number."""
        if not (self.transform_tolerance >= 0 and math.isfinite(self.transform_tolerance)):
            raise ParameterError(
                f"parameter ~transform_tolerance: {self.transform_tolerance}; allowed: a number "
                "of seconds, at least 0"
            )


class FakeLocalization:
    """Compares the simulator's ground truth with the odometry; `initialpose` is not needed.

    ROS Subscribers: `ground_truth`, `odom` (nav_msgs/Odometry).
    ROS Publishers: `amcl_pose` (geometry_msgs/PoseWithCovarianceStamped, 5 Hz), tf from map to
        the robot's odom (10 Hz), dated ahead as ROS's own nodes do.
    ROS Parameters: `~transform_tolerance`, see `FakeLocalizationSettings`.

    Raises:
        ParameterError: A parameter is unknown or has a value that is not allowed.
    """

    def __init__(self, names: RobotNames) -> None:
        settings = read_settings(FakeLocalizationSettings, names.of("fake_localization"))
        self._tolerance = rospy.Duration.from_sec(settings.transform_tolerance)
        self._odom_frame = f"{names.robot}/odom"
        self._transform_due = self._pose_due = 0.0
        self._broadcaster = tf2_ros.TransformBroadcaster()
        self._poses = rospy.Publisher(
            names.of("amcl_pose"), PoseWithCovarianceStamped, queue_size=1, latch=True
        )
        topics = [names.of(topic) for topic in ("ground_truth", "odom")]
        both = [message_filters.Subscriber(topic, Odometry) for topic in topics]
        self._pairs = message_filters.TimeSynchronizer(both, queue_size=10)
        self._pairs.registerCallback(self._compare)

    def _compare(self, truth: Odometry, odometry: Odometry) -> None:
        # In seconds: rospy.Time cannot be negative, as it would be in a simulation's first second.
        stamp, now = truth.header.stamp, truth.header.stamp.to_sec()
        here = pose_from_msg(truth.pose.pose)
        if not self._transform_due - 1.0 <= now < self._transform_due:
            self._transform_due = now + _TRANSFORM_PERIOD - _ROUNDING
            odom = compose(here, inverse(pose_from_msg(odometry.pose.pose)))
            self._broadcaster.sendTransform(
                transform_to_msg(odom, "map", self._odom_frame, stamp + self._tolerance)
            )
        if not self._pose_due - 1.0 <= now < self._pose_due:
            self._pose_due = now + _POSE_PERIOD - _ROUNDING
            pose = PoseWithCovarianceStamped()
            pose.header.stamp, pose.header.frame_id = stamp, "map"
            pose.pose.pose = truth.pose.pose
            self._poses.publish(pose)


def main() -> int:
    """Run one robot's localization; see `FakeLocalization`. Return the exit code."""
    return run_node("fake_localization", _run)


def _run() -> None:
    FakeLocalization(own_names())
    rospy.spin()
