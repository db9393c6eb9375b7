# SPDX-License-Identifier: BSD-3-Clause
"""A robot whose navigation stack has stock names joins as it is (docs/noetic-robots.md).

The last case leaves the hive without the robot.
"""

import pytest
import rosgraph
import rospy
from actionlib_msgs.msg import GoalStatus, GoalStatusArray
from blackboard.msg import TaskMsg, TaskState
from hive_operator import Operator, task
from launching import kill
from nav_msgs.msg import Path
from robot_description.msg import Traffic

ROBOT = "guest"
STOCK = {
    "/amcl_pose",
    "/move_base/feedback",
    "/move_base/result",
    "/move_base/status",
    "/odom",
}
"""What a robot's own nodes say, for whoever drives it."""


@pytest.fixture(scope="module")
def operator():
    """An operator's program, once the robot was heard."""
    rospy.init_node("operator")
    operator = Operator(robots=())
    operator.expect(
        lambda: ROBOT in operator.robots and operator.heartbeat, f"a status of {ROBOT}"
    )
    operator.hear_again(ROBOT)
    return operator


@pytest.fixture(scope="module")
def heard(operator):
    """Messages of topics by the topic's name, from before the first task."""
    plan = rospy.get_param(f"{ROBOT}/plan_topic")
    kinds = {"traffic": Traffic, "/move_base/status": GoalStatusArray, plan: Path}
    found = {name: [] for name in kinds}
    for name, kind in kinds.items():
        operator._hear(name, kind, found[name].append)  # noqa: SLF001  (wakes whoever waits)
    return found


def listening(node):
    """Return the topics that a node subscribes to."""
    _, subscribed, _ = rosgraph.Master("/stock_names").getSystemState()
    return {topic for topic, nodes in subscribed if node in nodes}


@pytest.mark.usefixtures("operator")
def test_its_robot_node_listens_where_a_stock_stack_speaks():
    topics = listening(f"/{ROBOT}/robot")

    assert topics >= STOCK
    assert not {topic for topic in topics if topic.startswith(f"/{ROBOT}/move_base")}
    assert not topics & {f"/{ROBOT}{topic}" for topic in STOCK}


def test_it_does_a_task(operator, heard):
    operator.post(task("N1", TaskMsg.GAB, (3.2, 2.0, 0.0), (3.2, 2.6, 0.0)))
    end = operator.follow("N1")

    assert (end.state, end.robot_id) == (TaskState.DONE, ROBOT)
    assert heard["/move_base/NavfnROS/plan"]  # where windows and RViz look for its path


def test_it_is_announced_by_the_transform_of_its_base_link(heard):
    xs = [said.way[0].x for said in heard["traffic"] if said.name == ROBOT]

    # Its amcl_pose is good to 0.1 m; only tf knows better.
    assert any(abs(10 * x - round(10 * x)) > 0.1 for x in xs)


def test_the_map_is_that_of_its_own_map_server():
    publishers, _, _ = rosgraph.Master("/stock_names").getSystemState()

    assert dict(publishers)["/map"] == ["/own_map"]


def test_its_drive_ends_with_its_robot_node(operator, heard):
    operator.post(task("N2", TaskMsg.GA, (3.2, 9.0, 0.0)))
    assert operator.until("N2", TaskState.STARTED).robot_id == ROBOT
    statuses = heard["/move_base/status"]
    operator.expect(
        lambda: any(each.status == GoalStatus.ACTIVE for each in statuses[-1].status_list),
        "a goal of move_base",
    )
    kill(f"/{ROBOT}/robot")

    operator.expect(
        lambda: statuses[-1].status_list[-1].status == GoalStatus.PREEMPTED, "the goal cancelled"
    )
