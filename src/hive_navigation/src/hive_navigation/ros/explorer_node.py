# SPDX-License-Identifier: BSD-3-Clause
"""Drives a robot to the frontiers of its map until it has seen everything that it can reach."""

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
from hive_common.ros.names import own_names
from hive_common.ros.transforms import Transforms
from hive_navigation.control.catching_up import RECENT, CatchingUp
from hive_navigation.mapping.explorer import MARGIN, SPEED, Explorer
from hive_navigation.ros.startup import read_model, run_node
from hive_navigation.ros.topic_monitor import TopicMonitor

if TYPE_CHECKING:
    from hive_common.grid_map import GridMap
    from hive_common.pose import Pose

STEER_PERIOD = 0.1  # time between two commands [s]
ROUNDING = 1e-6
"""The difference of two stamps may come out a little less than a period [s]; a simulator that
waits for the command would wait in vain."""
STILL = (0.0, 0.0)  # command of a robot that has nowhere to go [m/s, rad/s]

QUICK = MARGIN / SPEED
"""Once planning has taken longer, the robot stands meanwhile [s, wall clock]: it would use up its
margin. A simulator waits for the next command, so this is right at any real-time factor."""

REST = 3.0
"""The robot follows a plan for this many times the time that planning took, even if there is a new
map: on a busy machine it would only plan, and stand."""

OLD = 2.0  # a transform to the map frame older than this is not used [s]
REFINE_TIMEOUT = 2.0  # time to wait for a mapper's refine service [s, wall clock]


class ExplorerNode:
    """Explores with one robot.

    ROS Subscribers: `odom` (nav_msgs/Odometry), of the robot; `map` (nav_msgs/OccupancyGrid), of
        the hive; tf from map to the robot's odom.
    ROS Publishers: `cmd_vel` (geometry_msgs/Twist), 10 Hz; `explored` (std_msgs/Bool), latched:
        whether exploring has finished and the map has been refined.
    ROS Services called: `refine_map` (std_srvs/Trigger), of the hive, if there is one.
    """

    def __init__(self, hive: str, name: str, explorer: Explorer) -> None:
        """Explore with a robot; `hive` is the hive's namespace and ends in a slash."""
        self._hive = hive
        self._odom_frame = f"{name}/odom"
        self._explorer = explorer
        self._chart: GridMap | None = None
        self._odometry: Odometry | None = None
        self._chart_is_new = False
        self._steered_at = -math.inf
        self._slowest = 0.0  # planning so far [s, wall clock]
        self._plan_again_at = -math.inf
        self._inbox = Inbox()
        self._catching_up = CatchingUp(rospy.get_time, time.monotonic)
        self._monitor = TopicMonitor(self._inbox)

    def run(self) -> None:
        """Explore until everything is known or the node is shut down."""
        self._transforms = Transforms(cache_time=5.0)
        # A simulator waits for commands that come once a period of simulated time.
        period = {"control_period": f"{STEER_PERIOD:.6f}"}
        self._commands = rospy.Publisher(
            "cmd_vel", Twist, queue_size=1, tcp_nodelay=True, headers=period
        )
        self._explored = rospy.Publisher("explored", Bool, queue_size=1, latch=True)
        self._explored.publish(Bool(False))
        monitor, chart = self._monitor, numpy_msg(OccupancyGrid)
        monitor.subscribe(f"{self._hive}map", chart, self._learn, 1, "start a mapper")
        monitor.subscribe("odom", Odometry, self._drive, 5, "start the robot's base")
        rospy.on_shutdown(lambda: self._commands.publish(Twist()))
        while not rospy.is_shutdown() and not self._explorer.finished:
            self._inbox.wait(timeout=0.5)
            self._steer()
            self._monitor.warn()
        if self._explorer.finished:
            self._commands.publish(Twist())
            self._refine()
            self._explored.publish(Bool(True))
            rospy.loginfo("exploring has finished; save the map with map_saver")
            rospy.spin()

    def _refine(self) -> None:
        """Have the mapper match all scans to each other; other makes of mapper cannot."""
        refine = rospy.ServiceProxy(f"{self._hive}refine_map", Trigger)
        try:
            refine.wait_for_service(REFINE_TIMEOUT)
            answer = refine()
        except (rospy.ROSException, rospy.ServiceException) as error:
            rospy.loginfo(f"the map is not refined: {error}")
            return
        if not answer.success:
            rospy.logwarn(f"the map is not refined: {answer.message}")

    def _learn(self, msg: OccupancyGrid) -> None:
        try:
            self._chart, self._chart_is_new = map_from_msg(msg), True
        except HiveError as error:
            rospy.logwarn_throttle_identical(10, f"a map is ignored: {error}")

    def _drive(self, msg: Odometry) -> None:
        self._odometry = msg

    def _steer(self) -> None:
        """Command the robot; plan again on a new map."""
        msg, chart = self._odometry, self._chart
        if msg is None or chart is None:
            return
        now = msg.header.stamp.to_sec()
        if self._steered_at <= now < self._steered_at + STEER_PERIOD - ROUNDING:
            return
        self._steered_at = now
        # The simulator waits for this command, and so for the mapper.
        if not rospy.rostime.is_wallclock():
            self._catching_up.wait(self._recent_until, self._inbox.wait)
        here = self._place(msg)
        if here is None:
            self._commands.publish(Twist())
            return
        age = abs(rospy.get_time() - now) + STEER_PERIOD
        speed = self._explorer.steer(here, age)
        if self._chart_is_new and (speed == STILL or time.monotonic() >= self._plan_again_at):
            self._chart_is_new = False
            self._plan(chart, here)
            speed = self._explorer.steer(here, age)
        command = Twist()
        command.linear.x, command.angular.z = speed
        self._commands.publish(command)

    def _plan(self, chart: GridMap, here: Pose) -> None:
        if self._slowest > QUICK:
            self._commands.publish(Twist())
        begun = time.monotonic()
        self._explorer.plan(chart, here)
        took = time.monotonic() - begun
        self._slowest = max(took, self._slowest)
        self._plan_again_at = begun + took + REST * took

    def _recent_until(self) -> dict[str, float]:
        """Return until when the mapper's transform counts as recent [s]; see `CatchingUp`."""
        try:
            moment = self._transforms.get_latest_common_time("map", self._odom_frame)
        except tf2_ros.TransformException:
            return {}
        return {} if moment.is_zero() else {"map": moment.to_sec() + RECENT}

    def _place(self, msg: Odometry) -> Pose | None:
        """Return where the robot is, frame map, or None without a recent transform."""
        try:
            frame = self._transforms.lookup_transform("map", self._odom_frame, rospy.Time(0))
            here = pose_from_msg(msg.pose.pose)
        except (tf2_ros.TransformException, ValueError) as error:
            rospy.logwarn_throttle_identical(10, f"the robot waits: {error}")
            return None
        if abs(msg.header.stamp.to_sec() - frame.header.stamp.to_sec()) > OLD:
            rospy.logwarn_throttle(10, f"the robot waits: no scan mapped for {OLD:g} s")
            return None
        return compose(pose_from_transform(frame.transform), here)


def main() -> int:
    """Run an explorer; see `ExplorerNode`. Return the exit code."""
    return run_node("explorer", _run)


def _run() -> None:
    names = own_names()
    base = read_model(names).base
    ExplorerNode(*names, Explorer(base.circumscribed_radius, base.max_speed)).run()
