# SPDX-License-Identifier: BSD-3-Clause
"""Robots that share a process do tasks, and look from outside like robots that do not."""

import itertools
import os
import signal
import time
from pathlib import Path

import pytest
import rosgraph
import rospy
import tf2_ros
import yaml
from blackboard.msg import TaskMsg
from hive_operator import Operator, task

from hive_lab.runner.limits import PATIENCE

ROBOTS = ("robot1", "robot3")
ALONE = yaml.safe_load(
    (Path(__file__).resolve().parents[1] / "interfaces.yaml").read_text(encoding="utf-8")
)["fleet"]
"""What is recorded of the default fleet, each node of which has a process."""

OF_ONE_NODE = {"joint_states", "tf2_frames", "launch_arguments"}
"""Of robot_state_publisher, of each tf listener, and of robot.launch."""


@pytest.fixture(scope="module")
def operator():
    """The operator's program, once both robots were heard."""
    rospy.init_node("operator")
    operator = Operator(robots=ROBOTS)
    operator.expect(
        lambda: set(ROBOTS) <= set(operator.robots),
        "a status of both robots",
        lambda: sorted(operator.robots),
    )
    return operator


def of_robots(known):
    """Return the names in the robots' namespaces, without what only nodes of their own have."""
    spaces = tuple(f"/{robot}/" for robot in ROBOTS)
    mine = {name: what for name, what in known.items() if name.startswith(spaces)}
    return {n: what for n, what in mine.items() if n.split("/")[-1] not in OF_ONE_NODE}


def test_tasks_for_wheels_and_for_an_arm_are_done_by_those_that_have_them(operator):
    operator.post(task("P1", TaskMsg.GA, (5.5, 4.0, 1.57)))
    operator.post(task("P2", TaskMsg.GPAB, (12.0, 5.6, 0.0), (14.0, 5.4, 0.0), payload=0.3))

    assert operator.follow("P2").robot_id == "robot3"
    assert operator.follow("P1").robot_id in ROBOTS
    assert operator.collisions == 0


@pytest.mark.usefixtures("operator")
def test_the_robots_topics_and_services_are_those_of_nodes_of_their_own():
    master = rosgraph.Master("/operator")
    publishers, subscribers, services = master.getSystemState()
    kinds = dict(master.getTopicTypes())
    there = {name: kinds.get(name) for name, _ in (*publishers, *subscribers)}

    topics = of_robots(ALONE["topics"])
    assert set(of_robots(there)) == set(topics)
    typed = {n: known["type"].split()[0] for n, known in topics.items() if there[n] != "*"}
    assert {name: there[name] for name in typed} == typed
    assert set(of_robots(dict(services))) == set(of_robots(ALONE["services"]))


@pytest.mark.usefixtures("operator")
def test_the_robots_parameters_are_those_of_nodes_of_their_own():
    names = of_robots(dict.fromkeys(rospy.get_param_names()))

    recorded = of_robots(ALONE["parameters"])
    assert set(names) == set(recorded)
    # What robots have learned depends on what they did.
    settings = {n: value for n, value in recorded.items() if "/learned/" not in n}
    plain = {n: value for n, value in settings.items() if not n.endswith("robot_description")}
    assert {name: rospy.get_param(name) for name in plain} == plain


@pytest.mark.usefixtures("operator")
def test_every_link_of_the_robots_has_its_place_on_the_map():
    buffer = tf2_ros.Buffer()
    tf2_ros.TransformListener(buffer)
    for frame in ("robot1/laser", "robot3/gripper"):
        buffer.lookup_transform("map", frame, rospy.Time(0), rospy.Duration(int(3 * PATIENCE)))


@pytest.mark.usefixtures("operator")
def test_the_robots_share_one_process():
    publishers = rosgraph.Master("/operator").getSystemState()[0]

    speakers = {node for name, nodes in publishers for node in nodes if name.endswith("cmd_vel")}
    assert speakers == {"/robot_host_1"}


def searches():
    """Return the ids of the processes under this master that search for plans."""
    master = f"ROS_MASTER_URI={os.environ['ROS_MASTER_URI']}".encode()
    found = set()
    for process in Path("/proc").glob("[0-9]*"):
        try:
            words = (process / "cmdline").read_bytes().split(b"\0")
            if b"blackboard.auction.search.worker" not in words:
                continue
            if master in (process / "environ").read_bytes().split(b"\0"):
                found.add(int(process.name))
        except OSError:  # it has ended meanwhile
            continue
    return found


def test_a_burst_is_planned_in_a_process_that_is_started_again_when_it_was_killed(operator):
    (search,) = searches()
    os.kill(search, signal.SIGKILL)
    numbers = itertools.count(1)
    # On a busy machine the tasks of a burst may be given away one by one, without a search.
    end = time.monotonic() + PATIENCE
    while not searches() - {search}:
        assert time.monotonic() < end, "no search was started again"
        burst = [f"B{next(numbers)}" for _ in range(3)]
        for place, name in enumerate(burst):
            operator.post(task(name, TaskMsg.GA, (4.0 + place, 4.0, 0.0)))
        assert {operator.follow(name).robot_id for name in burst} <= set(ROBOTS)
    assert operator.collisions == 0
