# SPDX-License-Identifier: BSD-3-Clause
"""Drives a robot to where the map ends, until everything that it can reach is known."""

from __future__ import annotations

import math
import time
from typing import TYPE_CHECKING

import rospy
import tf2_ros
from geometry_msgs.msg import Twist
from nav_msgs.msg import OccupancyGrid, Odometry
from rospy.numpy_msg import numpy_msg
from std_msgs.msg import Bool
from std_srvs.srv import Trigger

from hive_common.errors import HiveError
from hive_common.pose import compose
from hive_common.ros.conversions import map_from_msg, pose_from_msg, pose_from_transform
from hive_common.ros.inbox import Inbox
from hive_common.ros.links import mend_links
from robot_navigation.mapping.explorer import Explorer
from robot_navigation.mapping.overdue import Overdue
from robot_navigation.ros.params import hive_and_robot, read_model

if TYPE_CHECKING:
    from collections.abc import Callable

    from hive_common.map_file import GridMap
    from hive_common.pose import Pose

STEER_PERIOD = 0.1
"""Between two commands [s]."""

STILL = (0.0, 0.0)
"""How a robot drives that has nowhere to go [m/s, rad/s]."""

QUICK = 0.2
"""While a plan that takes longer is made, the robot stands [s, wall clock]."""

REST = 3.0
"""For so many times as long as a plan took the robot goes by it, however new the map is: on a busy
machine it would do nothing but plan, and stand."""

OLD = 2.0
"""What is known of the place on the map counts no longer than this [s]."""

PATIENCE = 10.0
"""After this time in vain it is said what is missing [s, wall clock]."""

SOON = 2.0
"""A mapper that can refine its map offers it within this time [s, wall clock]."""

ADVICE = {"odom": "start the robot's base", "map": "start a mapper"}


class ExplorerNode:
    """Explores with one robot.

    ROS Subscribers: `odom` (nav_msgs/Odometry), of the robot; `map` (nav_msgs/OccupancyGrid), of
        the hive; tf from map to the robot's odom.
    ROS Publishers: `cmd_vel` (geometry_msgs/Twist), 10 Hz; `explored` (std_msgs/Bool), latched:
        whether everything that can be reached has been seen, and the map been refined.
    ROS Services called: `refine_map` (std_srvs/Trigger), of the hive, where there is one.
    """

    def __init__(self, hive: str, name: str, explorer: Explorer) -> None:
        """Explore with the robot `name` of the hive, whose namespace ends in a slash."""
        self._hive = hive
        self._odom_frame = f"{name}/odom"
        self._explorer = explorer
        self._chart: GridMap | None = None
        self._odometry: Odometry | None = None
        self._is_new = False
        self._steered = -math.inf
        self._planning = 0.0
        self._rested = -math.inf
        self._inbox = Inbox()
        self._overdue = Overdue(ADVICE, PATIENCE, time.monotonic())

    def start(self) -> None:
        """Open topics."""
        self._transforms = tf2_ros.Buffer(cache_time=rospy.Duration(5))
        self._listener = tf2_ros.TransformListener(self._transforms)
        self._commands = rospy.Publisher("cmd_vel", Twist, queue_size=1, tcp_nodelay=True)
        self._explored = rospy.Publisher("explored", Bool, queue_size=1, latch=True)
        self._explored.publish(Bool(False))
        grid = numpy_msg(OccupancyGrid)
        rospy.Subscriber(f"{self._hive}map", grid, self._later("map", self._learn), queue_size=1)
        rospy.Subscriber("odom", Odometry, self._later("odom", self._drive), queue_size=5)
        rospy.on_shutdown(lambda: self._commands.publish(Twist()))

    def run(self) -> None:
        """Explore until all is known or the node is shut down."""
        while not rospy.is_shutdown() and not self._explorer.finished:
            self._inbox.wait(timeout=0.5)
            self._steer()
            for topic in self._overdue.news(time.monotonic()):
                rospy.logwarn(f"no {topic} for {PATIENCE:g} s: {ADVICE[topic]}")
        if self._explorer.finished:
            self._commands.publish(Twist())
            self._refine()
            self._explored.publish(Bool(True))
            rospy.loginfo("everything that can be reached has been seen; save it with map_saver")
            rospy.spin()

    def _refine(self) -> None:
        """Have the mapper fit all that was seen to each other; other mappers do not offer it."""
        refine = rospy.ServiceProxy(f"{self._hive}refine_map", Trigger)
        try:
            refine.wait_for_service(SOON)
            answer = refine()
        except (rospy.ROSException, rospy.ServiceException) as error:
            rospy.loginfo(f"the map stays as it is: {error}")
            return
        if not answer.success:
            rospy.logwarn(f"the map stays as it is: {answer.message}")

    def _later(self, topic: str, take_in: Callable[..., None]) -> Callable[..., None]:
        """Return a callback that has the main thread take in a message."""

        def now(msg: object) -> None:
            self._overdue.came(topic, time.monotonic())
            take_in(msg)

        return lambda msg: self._inbox.put(lambda: now(msg))

    def _learn(self, msg: OccupancyGrid) -> None:
        try:
            self._chart, self._is_new = map_from_msg(msg), True
        except HiveError as error:
            rospy.logwarn_throttle_identical(10, f"a map is ignored: {error}")

    def _drive(self, msg: Odometry) -> None:
        self._odometry = msg

    def _steer(self) -> None:
        """Tell the robot how to drive, and make a new plan on every new map."""
        msg, chart = self._odometry, self._chart
        if msg is None or chart is None:
            return
        now = msg.header.stamp.to_sec()
        if self._steered <= now < self._steered + STEER_PERIOD:
            return
        self._steered = now
        here = self._place(msg)
        if here is None:
            self._commands.publish(Twist())
            return
        speed = self._explorer.steer(here)
        if self._is_new and (speed == STILL or time.monotonic() >= self._rested):
            self._is_new = False
            self._plan(chart, here)
            speed = self._explorer.steer(here)
        command = Twist()
        command.linear.x, command.angular.z = speed
        self._commands.publish(command)

    def _plan(self, chart: GridMap, here: Pose) -> None:
        if self._planning > QUICK:
            self._commands.publish(Twist())
        begun = time.monotonic()
        self._explorer.plan(chart, here)
        now = time.monotonic()
        self._planning = now - begun
        self._rested = now + REST * self._planning

    def _place(self, msg: Odometry) -> Pose | None:
        """Return where the robot is, frame map, or None where that is not known lately."""
        try:
            frame = self._transforms.lookup_transform("map", self._odom_frame, rospy.Time(0))
            here = pose_from_msg(msg.pose.pose)
        except (tf2_ros.TransformException, ValueError) as error:
            rospy.logwarn_throttle_identical(10, f"the robot stands still: {error}")
            return None
        if abs(msg.header.stamp.to_sec() - frame.header.stamp.to_sec()) > OLD:
            rospy.logwarn_throttle(10, f"the robot stands still: no scan mapped for {OLD:g} s")
            return None
        return compose(pose_from_transform(frame.transform), here)


def main() -> int:
    """Explore until the node is shut down; see `ExplorerNode`. Return the exit code."""
    rospy.init_node("explorer")
    mend_links()
    try:
        hive, name = hive_and_robot()
        base = read_model().base
    except HiveError as error:
        rospy.logfatal(str(error))
        return 1
    node = ExplorerNode(hive, name, Explorer(base.circumscribed_radius, base.max_speed))
    node.start()
    node.run()
    return 0
