# SPDX-License-Identifier: BSD-3-Clause
"""A hive needs nothing of a robot but odom, scan, cmd_vel and tf: no simulator, no /clock."""

import pytest
import rosgraph
import rospy
from blackboard.msg import TaskMsg, TaskState
from geometry_msgs.msg import PoseWithCovarianceStamped
from hive_operator import TOLERANCE, Operator, apart, task
from nav_msgs.msg import Odometry

from hive_common.pose import Pose, compose
from hive_common.ros.conversions import pose_from_msg
from hive_lab.runner.limits import PATIENCE

START = Pose(2.6, 2.0, 0.0)
GOALS = ((4.6, 2.6, 0.0), (4.6, 4.2, 1.57))
DRIFT = 0.15
"""Largest error of the odometry after these few metres [m]."""


@pytest.fixture(scope="module")
def operator():
    rospy.init_node("operator")
    operator = Operator(robots=())
    operator.expect(lambda: "robot1" in operator.robots, "a status of robot1")
    return operator


def business_of(node):
    """Return a node's publications, subscriptions and services."""
    everything = rosgraph.Master("/operator").getSystemState()
    return [{name for name, nodes in kind if node in nodes} for kind in everything]


def test_a_task_is_done_by_a_robot_that_no_simulator_knows(operator):
    operator.post(task("R1", TaskMsg.GAB, *GOALS))
    end = operator.follow("R1")
    here = rospy.wait_for_message("/robot1/amcl_pose", PoseWithCovarianceStamped, timeout=PATIENCE)
    odometry = rospy.wait_for_message("/robot1/odom", Odometry, timeout=PATIENCE)

    assert (end.state, end.robot_id) == (TaskState.DONE, "robot1")
    assert apart(pose_from_msg(here.pose.pose), GOALS[-1]) < TOLERANCE + DRIFT
    assert apart(compose(START, pose_from_msg(odometry.pose.pose)), GOALS[-1]) < TOLERANCE + DRIFT


@pytest.mark.usefixtures("operator")
def test_the_robot_speaks_nothing_but_odom_scan_and_tf_and_hears_cmd_vel():
    spoken, heard, services = business_of("/plain_robot")

    assert spoken == {"/robot1/odom", "/robot1/scan", "/tf", "/rosout"}
    assert heard == {"/robot1/cmd_vel"}
    assert {service.rpartition("/")[2] for service in services} == {
        "get_loggers",
        "set_logger_level",
    }


@pytest.mark.usefixtures("operator")
def test_nobody_tells_a_simulated_time():
    publishers, _, _ = rosgraph.Master("/operator").getSystemState()

    assert not rospy.get_param("/use_sim_time", False)
    assert "/clock" not in dict(publishers)
    assert not [topic for topic, _ in publishers if "simenv" in topic]
