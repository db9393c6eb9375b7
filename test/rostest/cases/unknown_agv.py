# SPDX-License-Identifier: BSD-3-Clause
"""An AGV of which nothing is known but its name at the broker: its factsheet says what it is."""

import rospy
from blackboard.msg import RobotStatus, TaskCost, TaskMsg, TaskState
from geometry_msgs.msg import PoseWithCovarianceStamped
from hive_operator import TOLERANCE, Operator, apart, sender, task
from launching import wait_until_empty
from nav_msgs.msg import Path

AGENT = "/vda5050_agent"
GOAL = (14.0, 5.4, 0.0)


def test_an_agv_takes_what_its_factsheet_says_that_it_can_carry_and_shows_where_it_goes():
    rospy.init_node("operator")
    paths = []
    rospy.Subscriber("agv1/move_base/plan", Path, paths.append)
    operator = Operator(robots=("robot1", "agv1"))
    operator.expect(lambda: {"robot1", "agv1"} <= set(operator.robots), "a status of both")
    operator.set_state("robot1", "defect", RobotStatus.DEFECT)

    operator.post(task("H1", TaskMsg.GAB, GOAL, GOAL, payload=70.0))  # an LD-60 carries 60 kg
    operator.expect(lambda: operator.bids["H1"]["agv1"], "a bid of agv1")
    assert operator.bids["H1"]["agv1"][0].cost >= TaskCost.MAX_COST
    assert "60" in operator.bids["H1"]["agv1"][0].reason

    operator.post(task("L1", TaskMsg.GAB, GOAL, GOAL, payload=50.0))
    end = operator.follow("L1")
    assert (end.state, end.robot_id) == (TaskState.DONE, "agv1")
    assert apart(operator.place("agv1"), GOAL) < 2 * TOLERANCE
    operator.expect(lambda: paths and not paths[-1].poses, "no path of agv1, which stands")
    ends = [each.poses[-1].pose.position for each in paths if each.poses]
    assert ends, "no path of agv1 while it drove"
    assert apart((ends[-1].x, ends[-1].y), GOAL) < 2 * TOLERANCE


def test_where_an_agv_is_that_no_simulator_tells_of_is_shown_by_its_agent():
    poses = {}
    rospy.Subscriber(
        "agv1/amcl_pose",
        PoseWithCovarianceStamped,
        lambda message: poses.update({sender(message): message}),
    )
    wait_until_empty(lambda: {AGENT} - poses.keys())

    shown = poses[AGENT]
    assert shown.header.frame_id == "map"
    assert apart((shown.pose.pose.position.x, shown.pose.pose.position.y), GOAL) < 2 * TOLERANCE
