# SPDX-License-Identifier: BSD-3-Clause
"""Case 1 of the report's test plan: starting the system and the packages that it needs.

First the whole of it, then each launch file by itself in the order in which a person would start
them by hand, so that a second system stands in the end.
"""

import contextlib
import time
from pathlib import Path

import pytest
import rosgraph
import rospkg
import rospy
import yaml
from blackboard.msg import TaskMsg, TaskState
from hive_operator import ROBOTS, Operator, task
from launching import Launches, pid_of, wait_until_empty

MASTER = rosgraph.Master("/plan_start")

ROBOT_TOPICS = {
    "set_state": "std_msgs/String",
    "ground_truth": "nav_msgs/Odometry",
    "cmd_vel": "geometry_msgs/Twist",
    "odom": "nav_msgs/Odometry",
    "scan": "sensor_msgs/LaserScan",
    "amcl_pose": "geometry_msgs/PoseWithCovarianceStamped",
    "move_base/goal": "move_base_msgs/MoveBaseActionGoal",
    "move_base/result": "move_base_msgs/MoveBaseActionResult",
    "move_base/status": "actionlib_msgs/GoalStatusArray",
    "move_base_simple/goal": "geometry_msgs/PoseStamped",
}
ARM_TOPICS = {
    "pick/goal": "blackboard/PickActionGoal",
    "pick/result": "blackboard/PickActionResult",
}
HIVE_TOPICS = {
    "/new_task": "blackboard/TaskMsg",
    "/task_bc": "blackboard/TaskMsgArray",
    "/task_cost": "blackboard/TaskCostArray",
    "/task_assign": "blackboard/TaskMsg",
    "/task_state": "blackboard/TaskState",
    "/task_cancel": "std_msgs/String",
    "/bb_backup": "blackboard/BbBackup",
    "/bb_sync": "blackboard/BbSynch",
    "/robot_status": "blackboard/RobotStatus",
}
WORLD_TOPICS = {
    "/simenv/collisions": "std_msgs/UInt32",
    "/clock": "rosgraph_msgs/Clock",
    "/tf": "tf2_msgs/TFMessage",
}
MAP = {"/map": "nav_msgs/OccupancyGrid"}
ROBOT_NODES = ("robot", "move_base", "fake_localization", "robot_state_publisher")
LAB = {"rviz": "false", "gui": "false", "processes": "each"}


@pytest.fixture(scope="module", autouse=True)
def node():
    rospy.init_node("operator")


@pytest.fixture(autouse=True)
def own_journal(tmp_path):
    """Give each hive a disk of its own, so that it does not resume the one before."""
    rospy.set_param("/journal", str(tmp_path))


@pytest.fixture(scope="module")
def launches():
    launches = Launches()
    yield launches
    launches.stop()


def of(robot, topics):
    """Return topics in a robot's namespace."""
    return {f"/{robot}/{name}": kind for name, kind in topics.items()}


def nodes_of_the_lab():
    """Return the names of all nodes that fleet_manager.launch starts for the lab."""
    nodes = [f"/{robot}/{node}" for robot in ROBOTS for node in ROBOT_NODES]
    return ["/simulator", "/map_server", "/blackboard", *nodes]


def missing(topics):
    """Return the topics without their type: `name: type that is there`."""
    publishers, subscribers, _ = MASTER.getSystemState()
    used = {name for name, _ in [*publishers, *subscribers]}  # the master keeps types for ever
    there = {name: kind for name, kind in MASTER.getTopicTypes() if name in used}
    return {name: there.get(name, "-") for name, kind in topics.items() if there.get(name) != kind}


def silent(nodes):
    """Return the nodes that do not answer."""
    return [node for node in nodes if not answers(node)]


def answers(node):
    with contextlib.suppress(OSError, rosgraph.MasterException):
        return pid_of(node) > 0
    return False


@pytest.mark.plan(
    "1a",
    "Starting the system",
    "every node answers, every topic is there with its type, and every robot tells its state; how "
    "long that takes is measured by `hive bench start`",
)
def test_the_system_is_up_with_every_node_and_topic(launches, observed):
    begun = time.monotonic()
    launches.start("fleet_manager", "fleet_manager.launch", **LAB)
    topics = HIVE_TOPICS | WORLD_TOPICS | MAP
    for robot in ROBOTS:
        topics |= of(robot, ROBOT_TOPICS)
    for robot in ("robot3", "robot4"):
        topics |= of(robot, ARM_TOPICS)
    nodes = nodes_of_the_lab()
    nodes_after = wait_until_empty(lambda: silent(nodes), begun)
    topics_after = wait_until_empty(lambda: missing(topics), begun)
    operator = Operator()
    operator.expect(
        lambda: set(ROBOTS) <= set(operator.robots),
        "a status of every robot",
        lambda: sorted(operator.robots),
    )
    after = time.monotonic() - begun
    observed(
        f"{len(nodes)} nodes after {nodes_after:.0f} s, {len(topics)} topics after "
        f"{topics_after:.0f} s, a status of every robot after {after:.0f} s"
    )

    assert silent(nodes) == []
    assert missing(topics) == {}
    assert set(operator.robots) == set(ROBOTS)


def file_of(package, *parts):
    """Return the content of a package's yaml file."""
    path = Path(rospkg.RosPack().get_path(package)).joinpath(*parts)
    return yaml.safe_load(path.read_text(encoding="utf-8"))


@pytest.mark.plan(
    "1b",
    "Every parameter file is read",
    "each value of each file is on the parameter server; those that the fleet file sets come from "
    "there; Ctrl-C ends every node",
)
def test_every_parameter_file_is_read(launches, observed):
    fleet = file_of("fleet_manager", "fleets", "lab.yaml")
    robots = {robot["name"]: robot["model"] for robot in fleet.pop("robots")}
    read = {"/blackboard": file_of("blackboard", "config", "blackboard.yaml") | of_fleet(fleet)}
    read["/blackboard"] |= {name: fleet[name] for name in ("decision", "traffic")}
    read["/blackboard"].pop("cost_model")
    for name, model in robots.items():
        read[f"/{name}/robot"] = file_of("blackboard", "config", "robot.yaml") | of_fleet(fleet)
        read[f"/{name}/robot"].pop("bid_timeout")
        read[f"/{name}/move_base"] = file_of("hive_navigation", "config", "move_base.yaml")
        read[f"/{name}/characteristics"] = file_of("robot_description", "models", f"{model}.yaml")
    expected = {f"{node}/{key}": value for node, f in read.items() for key, value in f.items()}
    wrong = {
        name: rospy.get_param(name, None)
        for name, value in expected.items()
        if rospy.get_param(name, None) != value
    }
    begun = time.monotonic()
    launches.stop()
    stopped_after = time.monotonic() - begun
    left = [node for node in nodes_of_the_lab() if answers(node)]
    observed(
        f"{len(expected)} parameters of {len(read)} nodes and robots; stopped after "
        f"{stopped_after:.0f} s"
    )

    assert wrong == {}
    assert left == []


def of_fleet(fleet):
    """Return the settings of a fleet file."""
    return {key: fleet[key] for key in ("cost_model", "distance", "bid_timeout")}


ROBOT1 = {"name": "robot1"}
MIR = {**ROBOT1, "model": "mir100"}
BY_HAND = {
    "simenv/simulator": ({"rtf": 4}, ["/simulator"], WORLD_TOPICS),
    "simenv/map_server": ({}, ["/map_server"], MAP),
    "robot_description/description": (
        MIR,
        ["/robot1/robot_state_publisher"],
        {"/tf_static": "tf2_msgs/TFMessage"},
    ),
    "simenv/spawn": (
        {**MIR, "x": 2.6, "y": 2.0},
        [],
        of("robot1", {name: ROBOT_TOPICS[name] for name in ("odom", "scan", "ground_truth")}),
    ),
    "hive_navigation/navigation": (
        ROBOT1,
        ["/robot1/move_base", "/robot1/fake_localization"],
        of("robot1", {name: kind for name, kind in ROBOT_TOPICS.items() if name != "set_state"}),
    ),
    "blackboard/blackboard": ({}, ["/blackboard"], HIVE_TOPICS),
    "blackboard/robot": (ROBOT1, ["/robot1/robot"], of("robot1", ROBOT_TOPICS)),
    "fleet_manager/robot": (
        {"name": "robot2", "model": "ld60", "x": 2.6, "y": 4.0},
        [f"/robot2/{node}" for node in ROBOT_NODES],
        of("robot2", ROBOT_TOPICS),
    ),
}
"""Launch files in the order of starting by hand: arguments, nodes and topics that come up."""


@pytest.mark.plan(
    "1c",
    "Each launch file by itself",
    "what it starts is up, on top of those before it",
)
@pytest.mark.parametrize("file", BY_HAND)
def test_each_launch_file_brings_up_what_it_promises(launches, file, observed):
    arguments, nodes, topics = BY_HAND[file]
    package, name = file.split("/")
    begun = time.monotonic()
    launches.start(package, f"{name}.launch", **arguments)
    after = wait_until_empty(lambda: [*silent(nodes), *missing(topics).items()], begun)
    observed(f"{file}.launch: {after:.0f} s")

    assert silent(nodes) == []
    assert missing(topics) == {}


@pytest.mark.plan(
    "1d",
    "A system that was started by hand works",
    "a task is done by one of its two robots",
)
@pytest.mark.usefixtures("launches")
def test_what_was_started_by_hand_does_a_task(observed):
    operator = Operator(robots=("robot1", "robot2"))
    operator.expect(lambda: len(operator.robots) == 2, "a status of both robots")
    operator.post(task("P1", TaskMsg.GA, (4.0, 3.0, 0.0)))
    end = operator.follow("P1")
    observed(f"done by {end.robot_id}")

    assert end.state == TaskState.DONE
