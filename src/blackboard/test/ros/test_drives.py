# SPDX-License-Identifier: BSD-3-Clause
"""What other machines are told of where a robot is and drives, with fakes of ROS and the relay."""

import itertools

import pytest

pytest.importorskip("robot_description.msg", reason="needs generated messages")

import genpy
import rospy
from geometry_msgs.msg import PoseStamped, PoseWithCovarianceStamped
from nav_msgs.msg import Path

from blackboard.ros import drives
from blackboard.ros.drives import MOST_POINTS, DriveTeller, Newest, thinned
from blackboard.zenoh.link import serialized
from hive_common.ros.names import RobotNames

ROBOT = RobotNames("/lab/", "robot1")


def pose(x=1.0, stamp=5):
    made = PoseWithCovarianceStamped()
    made.header.stamp.secs, made.header.seq, made.header.frame_id = stamp, stamp, "map"
    made.pose.pose.position.x, made.pose.pose.orientation.w = x, 1.0
    return made


def path(count):
    made = Path()
    made.header.frame_id = "map"
    for number in range(count):
        made.poses.append(PoseStamped())
        made.poses[-1].pose.position.x = float(number)
    return made


def xs(payload):
    return [each.pose.position.x for each in Path().deserialize(payload).poses]


class FakeMachine:
    """A robot's ROS, its clock, and what its relay has told others."""

    def __init__(self):
        self.parameters, self.subscribers, self.kinds = {}, {}, {}
        self.told, self.refused = [], []
        self.now, self.ends = 100.0, False

    def subscribe(self, name, kind, hear, **_):
        self.subscribers[name], self.kinds[name] = hear, kind

    def every(self, period, look, *, reset):
        assert reset
        self.period, self._look = period.to_sec(), look

    def advertise(self, topic, *, for_display):
        assert for_display
        return Publisher(topic, self.told)

    def says(self, name, message):
        payload = message if isinstance(message, bytes) else serialized(message)
        self.subscribers[name](self.kinds[name]().deserialize(payload))

    def looks(self, after=0.0):
        """Let time pass until the teller looks, and return what it tells then."""
        self.now += after
        self.told.clear()
        self._look(None)
        return list(self.told)


class Publisher:
    def __init__(self, topic, told):
        self._topic, self._told = topic, told

    def put(self, payload):
        self._told.append((self._topic, payload))


@pytest.fixture
def machine(monkeypatch):
    fake = FakeMachine()
    monkeypatch.setattr(rospy, "Subscriber", fake.subscribe)
    monkeypatch.setattr(rospy, "Timer", fake.every)
    monkeypatch.setattr(rospy, "get_param", fake.parameters.get)
    monkeypatch.setattr(rospy, "is_shutdown", lambda: fake.ends)
    monkeypatch.setattr(drives, "machine_time", lambda: fake.now)
    return fake


@pytest.fixture
def teller(machine):
    return DriveTeller(machine, ROBOT, lambda *what: machine.refused.append(what))


@pytest.mark.usefixtures("teller")
def test_pose_and_path_are_told_as_topics_of_the_robot_wherever_ros_has_them(machine):
    machine.says("/lab/robot1/amcl_pose", pose())
    machine.says("/lab/robot1/move_base/plan", path(3))

    assert dict(machine.looks()) == {
        "robot1/amcl_pose": serialized(pose()),
        "robot1/plan": serialized(path(3)),
    }


@pytest.mark.parametrize(
    ("given", "name"),
    [
        ("move_base/NavfnROS/plan", "/lab/robot1/move_base/NavfnROS/plan"),
        ("/move_base/plan", "/move_base/plan"),
    ],
)
def test_the_path_is_heard_where_the_robot_s_parameter_says(machine, given, name):
    machine.parameters["/lab/robot1/plan_topic"] = given
    DriveTeller(machine, ROBOT, None)

    assert set(machine.subscribers) == {"/lab/robot1/amcl_pose", name}


@pytest.mark.usefixtures("teller")
def test_the_pose_is_heard_in_its_type_because_the_robot_s_process_hears_it_too(machine):
    assert machine.kinds["/lab/robot1/amcl_pose"] is PoseWithCovarianceStamped


@pytest.mark.usefixtures("teller")
def test_nothing_is_told_before_anything_is_heard(machine):
    assert machine.looks() == []
    assert machine.period == 0.2


@pytest.mark.usefixtures("teller")
def test_nothing_is_told_once_the_node_is_shut_down(machine):
    machine.says("/lab/robot1/amcl_pose", pose())
    machine.ends = True

    assert machine.looks() == []


@pytest.mark.usefixtures("teller")
def test_a_path_that_is_no_path_is_refused_and_the_pose_is_told_all_the_same(machine):
    machine.says("/lab/robot1/move_base/plan", b"\xff" * 40)
    machine.says("/lab/robot1/amcl_pose", pose())

    assert [topic for topic, _ in machine.looks()] == ["robot1/amcl_pose"]
    ((topic, reason),) = machine.refused
    assert topic == "plan"
    assert reason


@pytest.mark.usefixtures("teller")
def test_a_robot_that_drives_tells_its_pose_at_each_look_and_its_path_once_a_second(machine):
    told = []
    for number in range(10):
        machine.says("/lab/robot1/amcl_pose", pose(float(number)))
        machine.says("/lab/robot1/move_base/plan", path(number + 2))
        told += [topic for topic, _ in machine.looks(after=0.2)]

    assert told.count("robot1/amcl_pose") == 10
    assert told.count("robot1/plan") == 2


def test_of_many_messages_the_newest_is_told_and_not_too_often():
    newest = Newest(period=0.2, again=2.0)
    newest.hear(serialized(pose(1.0)))
    assert newest.take(10.0) == serialized(pose(1.0))

    newest.hear(serialized(pose(2.0)))
    newest.hear(serialized(pose(3.0)))
    assert newest.take(10.1) == b""
    assert newest.take(10.25) == serialized(pose(3.0))


def test_what_differs_by_its_stamp_only_is_told_again_after_a_while():
    newest = Newest(period=0.2, again=2.0)
    newest.hear(serialized(pose(stamp=5)))
    newest.take(10.0)

    newest.hear(serialized(pose(stamp=6)))
    assert newest.take(11.9) == b""
    assert newest.take(12.0) == serialized(pose(stamp=6))
    assert newest.take(13.9) == b""
    assert newest.take(14.0) == serialized(pose(stamp=6))


@pytest.mark.parametrize("count", [0, 1, MOST_POINTS])
def test_a_short_path_is_told_whole(count):
    assert thinned(serialized(path(count))) == serialized(path(count))


@pytest.mark.parametrize("count", [MOST_POINTS + 1, 10_000])
def test_a_long_path_is_told_by_some_of_its_poses_from_the_first_to_the_last(count):
    told = xs(thinned(serialized(path(count))))

    assert len(told) == MOST_POINTS
    assert (told[0], told[-1]) == (0.0, count - 1.0)
    steps = {after - before for before, after in itertools.pairwise(told)}
    assert 0 not in steps
    assert max(steps) - min(steps) <= 1


def test_bytes_that_are_no_path_are_no_path():
    with pytest.raises((ValueError, genpy.DeserializationError)):
        thinned(b"\xff" * 40)
