# SPDX-License-Identifier: BSD-3-Clause
"""What goes to ROS and what comes from there."""

from __future__ import annotations

import pytest

pytest.importorskip("blackboard.msg", reason="the link needs generated messages")

import rospy

from blackboard.codec.tables import WIRES
from blackboard.domain.record import TaskUpdate
from blackboard.domain.talker import BB_ACK, SET_STATE, TASK_STATE
from blackboard.domain.task import TaskState
from blackboard.ros.link import RosLink

UPDATE = TaskUpdate("T1", TaskState.STARTED, "r1", 0, 1)


class FakePublisher:
    """A publisher with a number of subscribers, which notes what all publishers send."""

    subscribers = 0
    sent = None

    def __init__(self, *_args, **_options):
        self.impl = None

    def get_num_connections(self):
        return self.subscribers

    def publish(self, message):
        self.sent.append(message)


class FakeInbox:
    """A talker whose thread does not run yet."""

    spins = False

    def __init__(self):
        self.received = []
        self.receive = self.received.append

    def node_of(self, name):
        return name

    def every(self, _period, _action):
        raise AssertionError("nothing is watched on these topics")


@pytest.fixture
def callbacks(monkeypatch):
    """The callbacks of subscribers, by topic; the rest of rospy is silent."""
    found = {}
    monkeypatch.setattr(FakePublisher, "subscribers", 0)
    monkeypatch.setattr(FakePublisher, "sent", [])
    monkeypatch.setattr(rospy, "get_time", lambda: 1.0)
    monkeypatch.setattr(rospy, "Publisher", FakePublisher)
    monkeypatch.setattr(
        rospy, "Subscriber", lambda name, _kind, hear, **_: found.__setitem__(name, hear)
    )
    monkeypatch.setattr(rospy, "get_name", lambda: "/host")
    return found


@pytest.fixture
def inbox():
    return FakeInbox()


@pytest.fixture
def link(callbacks, inbox):
    assert callbacks == {}
    made = RosLink("/hive/", [BB_ACK, TASK_STATE], ())
    made.attach(inbox)
    return made


class Unread:
    """A message that has come in."""

    def __init__(self, message, sender):
        self._message = message
        self._connection_header = {"callerid": sender}

    def read(self):
        return self._message


def test_a_message_is_encoded_only_if_somebody_has_subscribed(link):
    link.publish("robot1", TASK_STATE, UPDATE, None)
    FakePublisher.subscribers = 1
    link.publish("robot1", TASK_STATE, UPDATE, None)

    assert [message.task_id for message in FakePublisher.sent] == ["T1"]
    assert FakePublisher.sent[0].header.stamp.to_sec() == 1.0


def test_what_comes_from_ros_arrives_with_its_sender(link, callbacks, inbox):
    link.listen(TASK_STATE, TASK_STATE)
    message = WIRES[TASK_STATE].encode(UPDATE)
    callbacks["/hive/task_state"](Unread(message, "/blackboard"))

    (arrival,) = inbox.received
    assert (arrival.topic, arrival.name, arrival.sender) == (TASK_STATE, TASK_STATE, "/blackboard")
    assert arrival.read() is message


def test_a_topic_of_a_robot_is_below_the_hive(link, callbacks):
    link.listen(SET_STATE, "r1/set_state")

    assert list(callbacks) == ["/hive/r1/set_state"]
