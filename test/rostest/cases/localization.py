# SPDX-License-Identifier: BSD-3-Clause
"""`amcl` with its standard topics and services, under a robot that drives to a goal.

Beside it stands a robot that the simulator tells where it is, for navigation of ROS's own.
"""

import contextlib
import math
import queue
import time

import actionlib
import pytest
import rospy
import tf2_ros
from actionlib_msgs.msg import GoalStatus
from geometry_msgs.msg import PoseArray, PoseWithCovarianceStamped
from move_base_msgs.msg import MoveBaseAction, MoveBaseGoal
from nav_msgs.msg import Odometry
from rosgraph_msgs.msg import Clock
from sensor_msgs.msg import LaserScan
from std_msgs.msg import Float64
from std_srvs.srv import Empty

from hive_lab.runner.limits import PATIENCE

FACTOR = 2  # how much faster simulated time passes, by the launch file
SLOW = 0.2  # and where what a busy machine has not done in time would count


@pytest.fixture(scope="module", autouse=True)
def node():
    rospy.init_node("localization_cases")
    while not rospy.get_rostime():
        rospy.wait_for_message("/clock", Clock, timeout=PATIENCE)


def pose():
    """Return the next amcl_pose that is not older than this call.

    A scan that was on its way may be what an update is made of, so it is asked for again then.
    """
    poses, now = queue.Queue(), rospy.Time.now()
    subscriber = rospy.Subscriber("robot1/amcl_pose", PoseWithCovarianceStamped, poses.put)
    rospy.wait_for_service("robot1/request_nomotion_update", PATIENCE)
    ask = rospy.ServiceProxy("robot1/request_nomotion_update", Empty)
    ask()
    message = poses.get(timeout=PATIENCE)
    while message.header.stamp < now:
        ask()
        message = poses.get(timeout=PATIENCE)
    subscriber.unregister()
    return message


def far_from_the_truth(message):
    truth = rospy.wait_for_message("robot1/ground_truth", Odometry, timeout=PATIENCE)
    here, there = message.pose.pose.position, truth.pose.pose.position
    return math.hypot(here.x - there.x, here.y - there.y)


def test_a_robot_drives_to_its_goal_with_amcl_and_knows_where_it_is():
    client = actionlib.SimpleActionClient("robot1/move_base", MoveBaseAction)
    assert client.wait_for_server(rospy.Duration(int(FACTOR * PATIENCE)))
    goal = MoveBaseGoal()
    goal.target_pose.header.frame_id = "map"
    goal.target_pose.pose.position.x, goal.target_pose.pose.position.y = 5.4, 4.4
    goal.target_pose.pose.orientation.w = 1.0
    client.send_goal(goal)

    assert client.wait_for_result(rospy.Duration(int(FACTOR * PATIENCE)))
    assert client.get_state() == GoalStatus.SUCCEEDED
    message = pose()
    assert message.header.frame_id == "map"
    assert far_from_the_truth(message) < 0.15
    assert 0 < message.pose.covariance[0] < 0.1


def test_global_localization_spreads_the_particles_over_the_whole_map():
    clouds = queue.Queue()
    rospy.Subscriber("robot1/particlecloud", PoseArray, clouds.put)
    rospy.wait_for_service("robot1/global_localization", PATIENCE)
    rospy.ServiceProxy("robot1/global_localization", Empty)()

    spread, end = 0.0, time.monotonic() + PATIENCE
    while spread < 5.0:
        assert time.monotonic() < end, f"particles over {spread:.1f} m only"
        pose()  # a cloud is published with each update, to whoever is connected by then
        with contextlib.suppress(queue.Empty):
            xs = [p.position.x for p in clouds.get(timeout=1.0).poses]
            spread = max(xs) - min(xs)


def test_an_initialpose_that_is_none_is_ignored_and_a_good_one_is_taken():
    truth = rospy.wait_for_message("robot1/ground_truth", Odometry, timeout=PATIENCE)
    publisher = rospy.Publisher("robot1/initialpose", PoseWithCovarianceStamped, queue_size=5)
    while not publisher.get_num_connections():
        rospy.sleep(0.05)
    bad = PoseWithCovarianceStamped()
    bad.pose.covariance[0] = -1.0
    publisher.publish(bad)
    good = PoseWithCovarianceStamped()
    good.header.frame_id = "map"
    good.pose.pose = truth.pose.pose
    for place in (0, 7, 35):
        good.pose.covariance[place] = 0.001
    publisher.publish(good)

    for _ in range(20):
        if far_from_the_truth(pose()) < 0.15:
            return
    pytest.fail("amcl did not take the initialpose")


class StrictPlanner:
    """Looks up transforms as costmap_2d and the stock local planners do.

    A scan counts once the odometry of its time is there (tf's message filter, frame odom). Then
    the plan, which is in the map frame, is wanted at that very time, without waiting for it.
    """

    def __init__(self, robot):
        self.found, self.failed = 0, []
        self._odom, self._base = f"{robot}/odom", f"{robot}/base_footprint"
        self._buffer = tf2_ros.Buffer()
        self._listener = tf2_ros.TransformListener(self._buffer)
        self._scans = queue.Queue()
        rospy.Subscriber(f"{robot}/scan", LaserScan, self._scans.put)

    def wait_for_map(self):
        """Wait until the robot is localized, and leave out what came before."""
        end = time.monotonic() + PATIENCE
        while not self._buffer.can_transform("map", self._base, rospy.Time(0)):
            assert time.monotonic() < end, f"{self._base} is not in the map"
            time.sleep(0.01)
        with contextlib.suppress(queue.Empty):
            while True:
                self._scans.get_nowait()

    def watch(self, scans):
        """Look at a number of scans; those from before its first transform do not count."""
        while self.found + len(self.failed) < scans:
            stamp = self._scans.get(timeout=PATIENCE).header.stamp
            if not self._comes(stamp):
                continue
            try:
                self._buffer.lookup_transform(self._odom, "map", stamp)
                self.found += 1
            except tf2_ros.ExtrapolationException as error:
                self.failed.append(str(error))

    def _comes(self, stamp):
        """Return whether the odometry of a time comes; that of a time long past does not."""
        end = time.monotonic() + 1.0
        while not self._buffer.can_transform(self._odom, self._base, stamp):
            if time.monotonic() > end:
                return False
            time.sleep(0.002)  # tf2's own wait looks every 20 ms
        return True


def test_a_strict_stock_local_planner_finds_every_transform_at_the_time_of_its_scan():
    planner = StrictPlanner("robot2")
    planner.wait_for_map()
    factor = rospy.Publisher("simenv/rtf", Float64, queue_size=1)
    while not factor.get_num_connections():
        rospy.sleep(0.05)
    # The tolerance is in simulated time: now it is longer than a machine holds a node up.
    factor.publish(SLOW)
    planner.watch(60)
    factor.publish(FACTOR)

    # One may be late where time was still fast; without the tolerance half of them are.
    assert len(planner.failed) <= 4, planner.failed[:3]
    assert planner.found >= 56
