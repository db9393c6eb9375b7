# SPDX-License-Identifier: BSD-3-Clause
"""What a gateway shows of a hive on ROS, and what it tells the hive, with a fake of both."""

from dataclasses import replace
from types import SimpleNamespace

import pytest

pytest.importorskip("blackboard.msg", reason="needs generated messages")

import rospy
from std_msgs.msg import String

from blackboard.codec.tables import WIRES
from blackboard.domain.characteristics import RobotState, RobotStatus
from blackboard.domain.record import TaskUpdate
from blackboard.domain.talker import (
    NEW_TASK,
    ROBOT_STATUS,
    SET_STATE,
    SYNC,
    TASK_CANCEL,
    TASK_STATE,
)
from blackboard.domain.task import Task, TaskState, TaskType
from fleet_manager.ros import gateway_node
from fleet_manager.ros.gateway_node import ASKED, SHOWN, Gateway
from hive_common.pose import Pose

GO = Task("T1", TaskType.GA, (Pose(6.0, 0.0),), priority=3, posted=5.0)
UPDATE = TaskUpdate("T1", TaskState.STARTED, "robot1", 0, 1)


def status(robot, state=RobotState.IDLE, reason=""):
    return RobotStatus(robot, state, Pose(1.0, 2.0), 0.5, reason=reason)


class FakePublisher:
    """A publisher of rospy that notes what it sends."""

    def __init__(self, _name, kind, listener=None, latch=False, **_):
        self.kind, self.listener, self.latch = kind, listener, latch
        self.sent, self.headers = [], {}
        self.publish = self.sent.append
        self.impl = SimpleNamespace(publock=FakeLock(), add_headers=self.headers.update)


class FakeLock:
    def __enter__(self):
        return self

    def __exit__(self, *_):
        pass


class FakeHive:
    """The talker and the link of the gateway's process."""

    def __init__(self):
        self.handlers, self.posted, self.told, self.refused = {}, [], [], []
        self.members, self.taken = [], []

    def member(self, name):
        self.members.append(name)
        return SimpleNamespace(subscribe=self.handlers.__setitem__, publish=self._post)

    def _post(self, topic, value):
        self.posted.append((topic, value))

    def publish_to_robot(self, robot, topic, value):
        self.told.append((robot, topic, value))

    def refuse(self, topic, reason):
        self.refused.append((topic, reason))

    def take(self, topic, handle):
        """Have a callback called in the talker's thread, which here is that of the test."""
        self.taken.append(topic)
        return handle

    def says(self, topic, value):
        self.handlers[topic](value)


class FakeRos:
    """Publishers and subscribers by topic."""

    def __init__(self):
        self.publishers, self.callbacks = {}, {}
        self.subscribed = []

    def advertise(self, name, *args, **options):
        self.publishers[name] = FakePublisher(name, *args, **options)
        return self.publishers[name]

    def subscribe(self, name, kind, hear, **_):
        self.subscribed.append((name, kind))
        self.callbacks[name] = hear

    def sent(self, topic):
        return self.publishers[f"/lab/{topic}"].sent

    def of_robots(self):
        """Return the topics of robots to which the gateway listens."""
        return [name for name, _ in self.subscribed if name.endswith("/set_state")]


@pytest.fixture
def ros(monkeypatch):
    fake = FakeRos()
    monkeypatch.setattr(rospy, "Publisher", fake.advertise)
    monkeypatch.setattr(rospy, "Subscriber", fake.subscribe)
    monkeypatch.setattr(rospy, "get_name", lambda: "/lab/hive_gateway")
    monkeypatch.setattr(rospy, "get_time", lambda: 7.0)
    return fake


@pytest.fixture
def hive(ros):
    """The hive of a gateway that has started."""
    assert ros.publishers == {}
    fake = FakeHive()
    Gateway(fake, fake, "/lab/").start()
    return fake


def test_every_topic_of_the_hive_is_shown_or_asked_on_its_own_name_and_type(ros, hive):
    assert {*SHOWN, *ASKED, SET_STATE} == set(WIRES)
    assert not set(SHOWN) & {*ASKED, SET_STATE}
    assert set(hive.handlers) == set(SHOWN)
    assert {name: each.kind for name, each in ros.publishers.items()} == {
        f"/lab/{topic}": WIRES[topic].message for topic in SHOWN
    }
    assert ros.subscribed == [(f"/lab/{topic}", WIRES[topic].message) for topic in ASKED]
    assert hive.members == ["/lab/hive_gateway"]


def test_a_topic_that_is_latched_in_the_hive_is_latched_here(ros, hive):
    assert [topic for topic in hive.handlers if ros.publishers[f"/lab/{topic}"].latch] == [SYNC]


def test_what_the_hive_says_is_published_on_the_same_topic_only(ros, hive):
    hive.says(TASK_STATE, UPDATE)

    (msg,) = ros.sent(TASK_STATE)
    assert WIRES[TASK_STATE].from_msg(msg) == UPDATE
    assert msg.header.stamp.to_sec() == 7.0
    assert [topic for topic in SHOWN if ros.sent(topic)] == [TASK_STATE]


def test_a_new_robot_is_listened_for_once(ros, hive):
    for name in ("robot1", "robot2", "robot1"):
        hive.says(ROBOT_STATUS, status(name))

    assert ros.of_robots() == ["/lab/robot1/set_state", "/lab/robot2/set_state"]
    assert [msg.robot_id for msg in ros.sent(ROBOT_STATUS)] == ["robot1", "robot2", "robot1"]


def test_each_robot_is_shown_once_where_it_is(ros):
    fake, shown = FakeHive(), []
    Gateway(fake, fake, "/lab/", SimpleNamespace(show=shown.append)).start()
    for name in ("robot1", "robot2", "robot1", "robot-3"):
        fake.says(ROBOT_STATUS, status(name))
    fake.says(ROBOT_STATUS, status("robot4", RobotState.OFFLINE))

    assert shown == ["robot1", "robot2"]
    assert len(ros.of_robots()) == 2


def test_what_a_robot_is_told_reaches_that_robot(ros, hive):
    for name in ("robot1", "robot2"):
        hive.says(ROBOT_STATUS, status(name))

    ros.callbacks["/lab/robot1/set_state"](String("defect"))
    ros.callbacks["/lab/robot2/set_state"](String("active"))

    assert hive.told == [("robot1", SET_STATE, "defect"), ("robot2", SET_STATE, "active")]
    assert hive.posted == []


def test_a_robot_that_the_leader_alone_tells_of_is_shown_and_met_once_it_speaks(ros, hive):
    hive.says(ROBOT_STATUS, status("robot1", RobotState.OFFLINE))
    assert ros.of_robots() == []
    assert len(ros.sent(ROBOT_STATUS)) == 1

    hive.says(ROBOT_STATUS, status("robot1", RobotState.CHARGING))
    assert ros.of_robots() == ["/lab/robot1/set_state"]


@pytest.mark.parametrize("name", ["robot-1", "7up", "a/b", "", "a b", "~robot"])
def test_a_robot_whose_name_ros_does_not_allow_is_shown_and_not_listened_for(ros, hive, name):
    hive.says(ROBOT_STATUS, status(name))

    assert ros.of_robots() == []
    assert [msg.robot_id for msg in ros.sent(ROBOT_STATUS)] == [name]


def test_a_new_subscriber_gets_the_last_status_of_every_robot_that_was_met(ros, hive):
    for each in (
        status("robot1", reason="old"),
        status("robot2"),
        status("robot3", RobotState.OFFLINE),
        status("robot1", RobotState.OFFLINE, reason="gone"),
    ):
        hive.says(ROBOT_STATUS, each)
    publisher, told = ros.publishers["/lab/robot_status"], []
    publisher.listener.peer_subscribe("/lab/robot_status", None, told.append)

    assert [(msg.robot_id, msg.reason) for msg in told] == [("robot1", "gone"), ("robot2", "")]
    assert publisher.headers == {"robots": "robot1 robot2"}


def test_a_task_that_is_posted_is_passed_on(ros, hive):
    ros.callbacks["/lab/new_task"](WIRES[NEW_TASK].to_msg(GO, 0.0))

    assert hive.posted == [(NEW_TASK, GO)]
    assert hive.refused == []


def test_a_task_that_is_cancelled_is_passed_on(ros, hive):
    ros.callbacks["/lab/task_cancel"](String("T1"))

    assert hive.posted == [(TASK_CANCEL, "T1")]


def test_a_task_that_cannot_be_done_is_passed_on_because_the_blackboard_answers_why(ros, hive):
    odd = replace(GO, type=77, priority=99)
    ros.callbacks["/lab/new_task"](WIRES[NEW_TASK].to_msg(odd, 0.0))

    assert hive.posted == [(NEW_TASK, odd)]
    assert hive.refused == []


@pytest.mark.parametrize("topic", [NEW_TASK, TASK_CANCEL])
def test_a_malformed_message_is_refused_with_its_reason_and_not_passed_on(ros, monkeypatch, topic):
    def read(_msg):
        raise ValueError("priority is no number")

    wires = {**WIRES, topic: WIRES[topic]._replace(from_msg=read)}
    monkeypatch.setattr(gateway_node, "WIRES", wires)
    hive = FakeHive()
    Gateway(hive, hive, "/lab/").start()
    ros.callbacks[f"/lab/{topic}"](WIRES[topic].message())

    assert hive.refused == [(topic, "priority is no number")]
    assert hive.posted == []


def test_what_comes_from_ros_is_handled_in_the_thread_of_the_talker(hive):
    hive.says(ROBOT_STATUS, status("robot1"))

    assert hive.taken == [*ASKED, SET_STATE]
