# SPDX-License-Identifier: BSD-3-Clause
"""Members of one process, which share a talker, and members of another."""

from __future__ import annotations

import queue
from dataclasses import replace

import pytest

pytest.importorskip("blackboard.msg", reason="the codec needs generated messages")

import genpy

from blackboard.codec.tables import WIRES
from blackboard.consensus.messages import AppendReply
from blackboard.domain.record import TaskUpdate
from blackboard.domain.talker import BB_ACK, SET_STATE, TASK_STATE
from blackboard.domain.task import TaskState
from blackboard.process.backlog import MOST
from blackboard.process.link import Arrival
from blackboard.process.speakers import Speakers
from blackboard.process.talker import ProcessTalker

REPLY = AppendReply("/r1/robot#1", 3, 7, 1.5)
UPDATE = TaskUpdate("T1", TaskState.STARTED, "r1", 0, 1)


class FakeLink:
    """A link that notes what it is asked for, and delivers what a test gives it."""

    names = ("/host",)

    def __init__(self):
        self.sent = []
        self.listens = []
        self.watched = []
        self.inbox = None

    def attach(self, inbox):
        self.inbox = inbox

    def publish(self, robot, topic, value, to):
        self.sent.append((robot, topic, value, to))

    def listen(self, topic, name):
        self.listens.append((topic, name))

    def why_refused(self, _value, sender):
        return f"{sender} is a liar" if sender == "/liar" else ""

    def watch(self, watcher, node, died):
        self.watched.append((watcher, node, died))

    def deliver(self, value, sender, topic=TASK_STATE, name="", to=""):
        """Deliver a value; return how often it was read so far, in a list."""
        reads = []

        def read():
            reads.append(True)
            return WIRES[topic].encode(value)

        self.inbox.receive(Arrival(topic, name or topic, sender, read, to))
        return reads


class FakeRuntime:
    """A process that ends when a test says so."""

    simulated = None

    def __init__(self):
        self.over = False
        self.warnings = []

    def date(self):
        return 1.0

    def warn(self, text):
        self.warnings.append(text)

    def warn_seldom(self, text):
        self.warnings.append(text)

    def is_shutdown(self):
        return self.over


class Host:
    """A process with three members, and what each of them hears on two topics."""

    def __init__(self):
        self.link, self.runtime = FakeLink(), FakeRuntime()
        self.talker = ProcessTalker("/hive/", self.link, self.runtime)
        self.members, self.heard = {}, {}
        for name in ("r1", "r2", "r3"):
            member = self.talker.member(f"/{name}/robot", name, f"/hive/{name}/")
            self.members[name], self.heard[name] = member, []
            for topic in (BB_ACK, TASK_STATE):
                member.subscribe(topic, self.heard[name].append)

    def work_off(self):
        """Do what the talker's queue holds now."""
        self.talker.call(lambda: setattr(self.runtime, "over", True))
        self.talker.spin()


@pytest.fixture
def host():
    return Host()


def test_what_a_member_publishes_reaches_the_others_as_the_same_value(host):
    host.members["r1"].publish(TASK_STATE, UPDATE)
    host.work_off()

    assert all(seen == [UPDATE] and seen[0] is UPDATE for seen in host.heard.values())
    assert host.link.sent == [("r1", TASK_STATE, UPDATE, None)]


def test_a_member_does_not_hear_what_it_says_to_other_members(host):
    host.members["r1"].publish(BB_ACK, REPLY)
    host.work_off()

    assert list(host.heard.values()) == [[], [REPLY], [REPLY]]


@pytest.mark.parametrize("name", ["/r2/robot", "r2"])
def test_a_message_for_a_member_or_its_robot_reaches_no_other(host, name):
    host.members["r1"].publish(BB_ACK, REPLY, to=(name,))
    host.work_off()

    assert list(host.heard.values()) == [[], [REPLY], []]


def test_a_message_from_outside_is_read_once_for_all(host):
    reads = host.link.deliver(UPDATE, "/blackboard")
    host.work_off()

    assert list(host.heard.values()) == [[UPDATE]] * 3
    assert len(reads) == 1


def test_a_message_that_nobody_wants_is_not_read():
    runtime, link = FakeRuntime(), FakeLink()
    talker = ProcessTalker("/", link, runtime)
    talker.member("/r1/robot", "r1", "/r1/").subscribe(TASK_STATE, [].append, lambda: False)
    reads = link.deliver(UPDATE, "/blackboard")
    talker.call(lambda: setattr(runtime, "over", True))
    talker.spin()

    assert reads == []


def test_a_message_from_outside_for_one_robot_reaches_no_other(host):
    host.link.deliver(REPLY, "/blackboard", BB_ACK, to="r2")
    host.link.deliver(UPDATE, "/blackboard", to="r9")
    host.work_off()

    assert list(host.heard.values()) == [[], [REPLY], []]


def test_a_process_that_speaks_as_each_of_its_robots_ignores_what_comes_back(host):
    host.link.names = ("r1", "r2", "r3")
    for name in host.link.names:
        host.link.deliver(UPDATE, name)
    host.work_off()

    assert list(host.heard.values()) == [[]] * 3
    assert host.talker.node_of("/r2/robot") in host.link.names


def test_what_comes_back_from_this_process_itself_is_ignored(host):
    reads = host.link.deliver(UPDATE, "/host")
    host.work_off()

    assert (list(host.heard.values()), reads) == ([[]] * 3, [])


def test_a_message_that_cannot_be_read_is_refused(host):
    def read():
        raise ValueError("it is cut off")

    host.talker.receive(Arrival(TASK_STATE, TASK_STATE, "/blackboard", read))
    host.work_off()

    assert list(host.heard.values()) == [[]] * 3
    assert host.talker.refusals.total == 1
    assert "it is cut off" in host.runtime.warnings[0]


def test_bytes_that_are_no_message_are_refused_with_who_has_sent_them(host):
    def read():
        raise genpy.DeserializationError("unpack requires a buffer of 4 bytes")

    host.talker.receive(Arrival(TASK_STATE, TASK_STATE, "/blackboard", read))
    host.work_off()

    assert "/blackboard sends bytes that are no TaskState" in host.runtime.warnings[0]


def test_of_what_a_process_says_only_so_much_waits_and_others_are_heard_all_the_same(host):
    for _ in range(MOST + 7):
        host.link.deliver(UPDATE, "/flood")
    host.link.deliver(UPDATE, "/blackboard")
    host.work_off()

    assert len(host.heard["r1"]) == MOST + 1
    assert host.talker.refusals.by_topic() == {TASK_STATE: 7}
    assert host.runtime.warnings == [
        "7 messages on task_state were refused so far: /flood says more than is read here"
    ]


def test_an_urgent_message_overtakes_all_that_wait_and_urgent_ones_keep_their_order(host):
    later = replace(REPLY, version=8)
    for value, topic in ((UPDATE, TASK_STATE), (REPLY, BB_ACK), (UPDATE, TASK_STATE)):
        host.link.deliver(value, "/r9", topic)
    host.link.deliver(later, "/r9", BB_ACK)
    host.work_off()

    assert host.heard["r1"] == [REPLY, later, UPDATE, UPDATE]


def test_an_urgent_message_is_not_waited_for_longer_than_any_other(host, monkeypatch):
    def get(waiting, timeout):
        assert not waiting.empty(), f"it would wait for {timeout} s"
        return waiting.queue.popleft()

    monkeypatch.setattr(queue.Queue, "get", get)
    host.members["r1"].subscribe(BB_ACK, lambda _: setattr(host.runtime, "over", True))
    host.link.deliver(REPLY, "/r9", BB_ACK)
    host.talker.spin()

    assert host.heard["r1"] == [REPLY]


def test_an_urgent_message_that_waits_is_heard_before_a_timer_that_is_due(host):
    host.talker.after(-1.0, lambda: host.heard["r1"].append("the timer"))
    host.link.deliver(REPLY, "/r9", BB_ACK)
    host.link.deliver(UPDATE, "/r9")
    host.work_off()

    assert host.heard["r1"] == [REPLY, "the timer", UPDATE]


def test_timers_get_their_turn_while_urgent_messages_keep_coming(host):
    later = replace(REPLY, version=8)
    more = iter([later])
    host.members["r1"].subscribe(
        BB_ACK, lambda _: [host.link.deliver(each, "/r9", BB_ACK) for each in more]
    )
    host.talker.after(-1.0, lambda: host.heard["r1"].append("the timer"))
    host.link.deliver(REPLY, "/r9", BB_ACK)
    host.work_off()

    assert host.heard["r1"] == [REPLY, "the timer", later]


def test_a_message_that_the_link_refuses_reaches_nobody(host):
    host.link.deliver(UPDATE, "/liar")
    host.work_off()

    assert list(host.heard.values()) == [[]] * 3
    assert host.talker.refusals.total == 1
    assert "/liar is a liar" in host.runtime.warnings[0]


def test_a_topic_is_listened_to_once_and_a_robots_own_one_in_its_namespace(host):
    for name in ("r1", "r2"):
        host.members[name].subscribe(SET_STATE, host.heard[name].append)

    assert host.link.listens == [
        (BB_ACK, BB_ACK),
        (TASK_STATE, TASK_STATE),
        (SET_STATE, "r1/set_state"),
        (SET_STATE, "r2/set_state"),
    ]


def test_a_subscription_that_was_cancelled_hears_nothing(host):
    seen = []
    host.members["r1"].subscribe(TASK_STATE, seen.append).cancel()
    host.link.deliver(UPDATE, "/blackboard")
    host.work_off()

    assert seen == []
    assert host.heard["r1"] == [UPDATE]


def test_the_process_of_a_member_that_was_heard_is_watched(host):
    host.link.deliver(AppendReply("/r9/robot#1", 3, 7, 1.5), "/host9", BB_ACK)
    host.work_off()
    host.members["r1"].watch("/r9/robot", print)

    assert host.link.watched == [("/r1/robot", "/host9", print)]


def test_the_process_of_a_member_is_known_once_the_member_was_heard():
    speakers = Speakers()
    assert speakers.node_of("/r1/robot") == ""

    speakers.why_refused(REPLY, "/robot_host_2", 0.0)

    assert speakers.node_of("/r1/robot") == "/robot_host_2"
