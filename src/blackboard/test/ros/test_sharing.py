# SPDX-License-Identifier: BSD-3-Clause
"""Members of one process, which share a talker, and members of another."""

import pytest

pytest.importorskip("blackboard.msg", reason="the talker needs generated messages")

import rospy

from blackboard.codec.tables import WIRES
from blackboard.consensus.messages import AppendReply
from blackboard.domain.record import TaskUpdate
from blackboard.domain.talker import BB_ACK, TASK_STATE
from blackboard.domain.task import TaskState
from blackboard.ros.talker import RosTalker, Speakers

REPLY = AppendReply("/r1/robot#1", 3, 7, 1.5)
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


@pytest.fixture
def heard(monkeypatch):
    """The callbacks of subscribers, by topic; the rest of rospy is silent."""
    callbacks = {}
    monkeypatch.setattr(FakePublisher, "subscribers", 0)
    monkeypatch.setattr(FakePublisher, "sent", [])
    monkeypatch.setattr(rospy, "get_time", lambda: 1.0)
    monkeypatch.setattr(rospy, "Publisher", FakePublisher)
    monkeypatch.setattr(
        rospy, "Subscriber", lambda name, _kind, hear, **_: callbacks.__setitem__(name, hear)
    )
    monkeypatch.setattr(rospy, "get_param", lambda _name, default=None: default)
    monkeypatch.setattr(rospy, "get_name", lambda: "/host")
    monkeypatch.setattr(rospy, "on_shutdown", lambda _action: None)
    return callbacks


@pytest.fixture
def talker(heard):
    assert heard == {}
    return RosTalker("/", [BB_ACK, TASK_STATE])


@pytest.fixture
def members(talker):
    """Three members with what each of them hears on two topics."""
    found = {}
    for name in ("r1", "r2", "r3"):
        member = talker.member(f"/{name}/robot", name, f"/{name}/")
        found[name] = (member, [])
        for topic in (BB_ACK, TASK_STATE):
            member.subscribe(topic, found[name][1].append)
    return found


def work_off(talker):
    """Do what the talker's queue holds now."""
    done = []
    talker.call(lambda: done.append(True))
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(rospy, "is_shutdown", lambda: bool(done))
        talker.spin()


def test_what_a_member_publishes_reaches_the_others_as_the_same_value(talker, members):
    members["r1"][0].publish(TASK_STATE, UPDATE)
    work_off(talker)

    assert all(seen == [UPDATE] and seen[0] is UPDATE for _, seen in members.values())


def test_a_member_does_not_hear_what_it_says_to_other_members(talker, members):
    members["r1"][0].publish(BB_ACK, REPLY)
    work_off(talker)

    assert [seen for _, seen in members.values()] == [[], [REPLY], [REPLY]]


@pytest.mark.parametrize("name", ["/r2/robot", "r2"])
def test_a_message_for_a_member_or_its_robot_reaches_no_other(talker, members, name):
    members["r1"][0].publish(BB_ACK, REPLY, to=(name,))
    work_off(talker)

    assert [seen for _, seen in members.values()] == [[], [REPLY], []]


def test_a_message_is_encoded_only_for_nodes_outside(members):
    member = members["r1"][0]
    member.publish(TASK_STATE, UPDATE)
    FakePublisher.subscribers = 1
    member.publish(TASK_STATE, UPDATE)

    assert [message.task_id for message in FakePublisher.sent] == ["T1"]


class Unread:
    """A message that has come in, and how often it was decoded."""

    def __init__(self, message, sender):
        self._message = message
        self._connection_header = {"callerid": sender}
        self.reads = 0

    def read(self):
        self.reads += 1
        return self._message


def test_a_message_from_outside_is_decoded_once_for_all(talker, members, heard):
    message = Unread(WIRES[TASK_STATE].encode(UPDATE), "/blackboard")
    heard["/task_state"](message)
    work_off(talker)

    assert [seen for _, seen in members.values()] == [[UPDATE]] * 3
    assert message.reads == 1


def test_what_comes_back_from_this_process_itself_is_ignored(talker, members, heard):
    message = Unread(None, "/host")
    heard["/task_state"](message)
    work_off(talker)

    assert [seen for _, seen in members.values()] == [[]] * 3


def test_the_process_of_a_member_is_known_once_the_member_was_heard():
    speakers = Speakers()
    assert speakers.node_of("/r1/robot") == ""

    speakers.why_refused(REPLY, "/robot_host_2", 0.0)

    assert speakers.node_of("/r1/robot") == "/robot_host_2"
