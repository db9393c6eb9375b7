# SPDX-License-Identifier: BSD-3-Clause
"""`amcl` with its standard topics and services, under a robot that drives to a goal."""

import contextlib
import math
import queue
import time

import actionlib
import pytest
import rospy
from actionlib_msgs.msg import GoalStatus
from geometry_msgs.msg import PoseArray, PoseWithCovarianceStamped
from move_base_msgs.msg import MoveBaseAction, MoveBaseGoal
from nav_msgs.msg import Odometry
from rosgraph_msgs.msg import Clock
from std_srvs.srv import Empty

WAIT = 40.0  # on the wall clock [s]
FACTOR = 2  # how much faster simulated time passes, by the launch file


@pytest.fixture(scope="module", autouse=True)
def node():
    rospy.init_node("localization_cases")
    while not rospy.get_rostime():
        rospy.wait_for_message("/clock", Clock, timeout=WAIT)


def pose():
    """Return the next amcl_pose that is not older than this call.

    A scan that was on its way may be what an update is made of, so it is asked for again then.
    """
    poses, now = queue.Queue(), rospy.Time.now()
    subscriber = rospy.Subscriber("robot1/amcl_pose", PoseWithCovarianceStamped, poses.put)
    rospy.wait_for_service("robot1/request_nomotion_update", WAIT)
    ask = rospy.ServiceProxy("robot1/request_nomotion_update", Empty)
    ask()
    message = poses.get(timeout=WAIT)
    while message.header.stamp < now:
        ask()
        message = poses.get(timeout=WAIT)
    subscriber.unregister()
    return message


def far_from_the_truth(message):
    truth = rospy.wait_for_message("robot1/ground_truth", Odometry, timeout=WAIT)
    here, there = message.pose.pose.position, truth.pose.pose.position
    return math.hypot(here.x - there.x, here.y - there.y)


def test_a_robot_drives_to_its_goal_with_amcl_and_knows_where_it_is():
    client = actionlib.SimpleActionClient("robot1/move_base", MoveBaseAction)
    assert client.wait_for_server(rospy.Duration(int(FACTOR * WAIT)))
    goal = MoveBaseGoal()
    goal.target_pose.header.frame_id = "map"
    goal.target_pose.pose.position.x, goal.target_pose.pose.position.y = 5.4, 4.4
    goal.target_pose.pose.orientation.w = 1.0
    client.send_goal(goal)

    assert client.wait_for_result(rospy.Duration(int(FACTOR * WAIT)))
    assert client.get_state() == GoalStatus.SUCCEEDED
    message = pose()
    assert message.header.frame_id == "map"
    assert far_from_the_truth(message) < 0.15
    assert 0 < message.pose.covariance[0] < 0.1


def test_global_localization_spreads_the_particles_over_the_whole_map():
    clouds = queue.Queue()
    rospy.Subscriber("robot1/particlecloud", PoseArray, clouds.put)
    rospy.wait_for_service("robot1/global_localization", WAIT)
    rospy.ServiceProxy("robot1/global_localization", Empty)()

    spread, end = 0.0, time.monotonic() + WAIT
    while spread < 5.0:
        assert time.monotonic() < end, f"particles over {spread:.1f} m only"
        pose()  # a cloud is published with each update, to whoever is connected by then
        with contextlib.suppress(queue.Empty):
            xs = [p.position.x for p in clouds.get(timeout=1.0).poses]
            spread = max(xs) - min(xs)


def test_an_initialpose_that_is_none_is_ignored_and_a_good_one_is_taken():
    truth = rospy.wait_for_message("robot1/ground_truth", Odometry, timeout=WAIT)
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
