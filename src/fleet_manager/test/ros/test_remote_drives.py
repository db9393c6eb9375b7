# SPDX-License-Identifier: BSD-3-Clause
"""What a machine shows of robots with other ROS masters, with a fake ROS and a fake relay."""

import math
from types import SimpleNamespace

import pytest

pytest.importorskip("robot_description.msg", reason="needs generated messages")

import rosgraph
import rospy
import tf2_ros
from geometry_msgs.msg import PoseWithCovarianceStamped
from nav_msgs.msg import Path

from fleet_manager.ros.remote_drives import RemoteDrives
from robot_description.urdf import robot_urdf


class FakeRos:
    """A ROS master with nodes and parameters, and what is published on it."""

    def __init__(self):
        self.nodes, self.parameters, self.lines = set(), {}, []
        self.publishers, self.frames, self.links = {}, [], []
        self.now = 7.0

    def advertise(self, name, kind, *, latch, queue_size):
        sent = []
        self.publishers[name] = SimpleNamespace(
            kind=kind, latch=latch, queue_size=queue_size, sent=sent, publish=sent.append
        )
        return self.publishers[name]

    def master(self, _caller):
        return self

    def lookupNode(self, name):  # noqa: N802  (as rosgraph has it)
        if name not in self.nodes:
            raise rosgraph.MasterError(f"unknown node [{name}]")
        return "http://127.0.0.1:4711/"

    def sent(self, name):
        return self.publishers[name].sent

    def ends_of_links(self):
        return {each.child_frame_id for each in self.links[-1]}


class FakeRelay:
    """A relay by which robots of other machines speak."""

    def __init__(self):
        self.takers, self.kinds = {}, {}

    def hear(self, topic, kind, sender, take):
        self.takers[topic, sender], self.kinds[topic] = take, kind

    def says(self, robot, topic, msg):
        self.takers[f"{robot}/{topic}", robot](msg, robot)


@pytest.fixture
def ros(monkeypatch):
    fake = FakeRos()
    monkeypatch.setattr(rospy, "Publisher", fake.advertise)
    monkeypatch.setattr(rospy, "get_name", lambda: "/lab/hive_gateway")
    monkeypatch.setattr(rospy, "get_param", fake.parameters.get)
    monkeypatch.setattr(rospy, "has_param", fake.parameters.__contains__)
    monkeypatch.setattr(rospy, "logwarn", fake.lines.append)
    monkeypatch.setattr(rospy.Time, "now", lambda: rospy.Time.from_sec(fake.now))
    monkeypatch.setattr(rosgraph, "Master", fake.master)
    for kind, sent in (("Transform", fake.frames), ("StaticTransform", fake.links)):
        told = SimpleNamespace(sendTransform=sent.append)
        monkeypatch.setattr(tf2_ros, f"{kind}Broadcaster", lambda told=told: told)
    return fake


@pytest.fixture
def relay():
    return FakeRelay()


@pytest.fixture
def drives(ros, relay):
    assert ros.publishers == {}
    return RemoteDrives(relay, "/lab/")


def pose(x, y, w=1.0, z=0.0):
    made = PoseWithCovarianceStamped()
    made.header.stamp.secs = 3
    made.pose.pose.position.x, made.pose.pose.position.y = x, y
    made.pose.pose.orientation.w, made.pose.pose.orientation.z = w, z
    return made


def test_a_robot_s_pose_and_path_are_published_under_its_name(ros, relay, drives):
    for robot in ("robot1", "robot2"):
        drives.show(robot)
    way = Path()
    relay.says("robot1", "amcl_pose", pose(1.0, 2.0))
    relay.says("robot2", "plan", way)

    assert ros.sent("/lab/robot1/amcl_pose") == [pose(1.0, 2.0)]
    assert ros.sent("/lab/robot2/move_base/plan") == [way]
    assert ros.sent("/lab/robot2/amcl_pose") == ros.sent("/lab/robot1/move_base/plan") == []
    assert {name: each.kind for name, each in ros.publishers.items() if "robot1" in name} == {
        "/lab/robot1/amcl_pose": PoseWithCovarianceStamped,
        "/lab/robot1/move_base/plan": Path,
    }
    assert relay.kinds["robot1/amcl_pose"] is PoseWithCovarianceStamped
    assert relay.kinds["robot1/plan"] is Path


def test_windows_that_open_later_get_the_last_pose_and_path(ros, drives):
    drives.show("robot1")

    assert len(ros.publishers) == 2
    assert all(each.latch for each in ros.publishers.values())


def test_the_path_is_shown_where_this_machine_looks_for_it(ros, drives):
    ros.parameters["/lab/robot1/plan_topic"] = "planner/plan"
    drives.show("robot1")

    assert "/lab/robot1/planner/plan" in ros.publishers


def test_a_pose_is_also_a_frame_dated_by_this_machine(ros, relay, drives):
    drives.show("robot1")
    for now in (7.0, 9.0):
        ros.now = now
        relay.says("robot1", "amcl_pose", pose(1.0, 2.0, w=0.6, z=0.8))

    first, second = ros.frames
    assert (first.header.frame_id, first.child_frame_id) == ("map", "robot1/base_footprint")
    assert (first.transform.translation.x, first.transform.translation.y) == (1.0, 2.0)
    assert (first.transform.rotation.w, first.transform.rotation.z) == (0.6, 0.8)
    assert [each.header.stamp.to_sec() for each in (first, second)] == [7.0, 9.0]


@pytest.mark.parametrize("odd", [pose(math.nan, 0.0), pose(0.0, math.inf), pose(0.0, 0.0, w=0.0)])
def test_what_is_no_pose_is_refused_and_not_shown(ros, relay, drives, odd):
    drives.show("robot1")
    with pytest.raises(ValueError, match=r"position|orientation"):
        relay.says("robot1", "amcl_pose", odd)

    assert ros.sent("/lab/robot1/amcl_pose") == ros.frames == []


def test_a_robot_of_this_machine_is_left_alone(ros, relay, drives):
    ros.nodes.add("/lab/robot1/robot")
    ros.parameters["/lab/agv1/robot"] = {"stands_by": False}  # of a process with several robots
    for robot in ("robot1", "robot2", "agv1"):
        drives.show(robot)

    assert {topic for topic, _ in relay.takers} == {"robot2/amcl_pose", "robot2/plan"}
    assert not [name for name in ros.publishers if "robot2" not in name]


@pytest.mark.parametrize("asked", ["lookupNode", "has_param"])
def test_a_master_that_does_not_answer_ends_nothing_and_is_named(
    ros, relay, drives, monkeypatch, asked
):
    def refuse(_name):
        raise ConnectionRefusedError(111, "Connection refused")

    monkeypatch.setattr(ros if asked == "lookupNode" else rospy, asked, refuse)
    drives.show("robot1")

    assert relay.takers == {}
    (line,) = ros.lines
    assert line.startswith("it is not shown where robot1 is")
    assert line.endswith("start hive_gateway again")


def test_the_links_of_all_robots_with_a_description_are_told(ros, drives):
    for robot in ("robot1", "robot2"):
        ros.parameters[f"/lab/{robot}/robot_description"] = robot_urdf("mir100", f"{robot}/")
    for robot in ("robot1", "robot2", "robot3"):
        drives.show(robot)

    assert len(ros.links) == 2  # the topic is latched: the last message tells all
    assert {f"robot{number}/base_link" for number in (1, 2)} <= ros.ends_of_links()


def test_a_description_that_is_none_is_named_and_the_robot_is_shown(ros, relay, drives):
    ros.parameters["/lab/robot1/robot_description"] = "<robot"
    drives.show("robot1")

    assert ("robot1/amcl_pose", "robot1") in relay.takers
    (line,) = ros.lines
    assert "RViz will not show the body of robot1" in line
