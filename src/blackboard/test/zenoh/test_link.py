# SPDX-License-Identifier: BSD-3-Clause
"""What goes over Zenoh, between sessions on this machine's loopback."""

from __future__ import annotations

import io
import json
import queue
import socket

import pytest

pytest.importorskip("blackboard.msg", reason="the link needs generated messages")

import genpy
import zenoh
from std_msgs.msg import Bool

from blackboard.codec.tables import WIRES, Wire
from blackboard.consensus.log import Position
from blackboard.consensus.messages import AppendEntries, AppendReply
from blackboard.consensus.task_list import TaskList
from blackboard.domain.characteristics import RobotState, RobotStatus
from blackboard.domain.record import TaskUpdate
from blackboard.domain.talker import (
    BB_ACK,
    BB_ENTRIES,
    NEW_TASK,
    ROBOT_STATUS,
    SET_STATE,
    SYNC,
    TASK_STATE,
)
from blackboard.domain.task import TaskState
from blackboard.zenoh import link as link_module
from blackboard.zenoh.delivery import REPEATED
from blackboard.zenoh.link import ZenohLink
from blackboard.zenoh.session import Endpoints, session_config
from hive_common.pose import Pose

UPDATE = TaskUpdate("T1", TaskState.STARTED, "robot1", 0, 1)
ENTRIES = AppendEntries(3, "/blackboard#1", Position(0, 0), (), 0, 1.5)
REPLY = AppendReply("/robot3/robot#1", 3, 7, 1.5)
WITHIN = 20.0  # a busy machine needs no longer [s]


def status(robot, reason=""):
    return RobotStatus(robot, RobotState.IDLE, Pose(1.0, 2.0), 0.5, reason=reason)


class FakeInbox:
    """A talker whose thread is that of the test."""

    spins = True

    def __init__(self):
        self.arrived = queue.Queue()
        self.actions = queue.Queue()
        self.looks = []
        self.receive, self.call = self.arrived.put, self.actions.put

    def node_of(self, name):
        return name

    def after(self, _delay, action):
        self.looks.append(action)

    def next(self):
        """Return the next arrival, with its value."""
        arrival = self.arrived.get(timeout=WITHIN)
        return arrival, WIRES[arrival.topic].from_msg(arrival.read())

    def do_next(self):
        """Do the next action that the link has for the talker's thread."""
        self.actions.get(timeout=WITHIN)()

    def pass_time(self):
        """Do what the link has put off."""
        looks, self.looks = self.looks, []
        for look in looks:
            look()


def free_port():
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        return probe.getsockname()[1]


class Process:
    """One process: its session, its link and its inbox."""

    def __init__(
        self,
        name,
        connect=(),
        topics=(TASK_STATE, ROBOT_STATUS, SYNC, BB_ACK),
        **options,
    ):
        self.address = f"127.0.0.1:{free_port()}"
        ends = Endpoints((f"tcp/{self.address}",), tuple(f"tcp/{each}" for each in connect))
        self.session = zenoh.open(zenoh.Config.from_json5(json.dumps(session_config(ends))))
        self.inbox = FakeInbox()
        self.link = ZenohLink(
            self.session,
            "lab",
            name,
            topics,
            address=self.address,
            date=lambda: 7.0,
            **options,
        )
        self.link.attach(self.inbox)


@pytest.fixture
def start():
    """Start processes; all end with the test."""
    started = []

    def begin(name, connect=(), **options):
        started.append(Process(name, connect, **options))
        return started[-1]

    yield begin
    for each in started:
        each.session.close()


@pytest.fixture
def pair(start, until_heard):
    """Two processes of which the first listens to task states and is ready to hear them."""
    first = start("robot1")
    first.link.listen(TASK_STATE, TASK_STATE)
    second = start("robot2", [first.address])
    until_heard(second.session, "hive/lab/task_state/robot2")
    return first, second


def test_a_message_arrives_with_its_sender_its_stamp_and_all_it_says(pair):
    first, second = pair
    second.link.publish("", TASK_STATE, UPDATE, None)

    arrival, value = first.inbox.next()

    assert (arrival.topic, arrival.name, arrival.sender) == (TASK_STATE, TASK_STATE, "robot2")
    assert value == UPDATE
    assert arrival.read().header.stamp == genpy.Time(7)


def test_a_process_knows_whether_anybody_listens_to_what_it_says(pair):
    _, second = pair

    assert second.link.is_heard(TASK_STATE)
    assert not second.link.is_heard(BB_ACK)
    assert not second.link.is_heard("robot7/set_state")


def test_messages_that_are_not_the_cores_are_carried_where_a_link_is_given_them(
    start, until_heard
):
    zones = Wire(Bool, Bool, lambda msg: msg.data)
    first = start("robot1", topics=(), wires={"zones": zones})
    first.link.listen("zones", "zones")
    second = start("anna", [first.address], topics=("zones",), wires={"zones": zones})
    until_heard(second.session, "hive/lab/zones/anna")
    second.link.publish("", "zones", True, None)

    assert first.inbox.arrived.get(timeout=WITHIN).read() == Bool(True)


def test_messages_of_one_sender_arrive_in_their_order(pair):
    first, second = pair
    sent = [TaskUpdate(f"T{number}", TaskState.STARTED, "robot2", 0, 1) for number in range(300)]
    for each in sent:
        second.link.publish("", TASK_STATE, each, None)

    assert [first.inbox.next()[1] for _ in sent] == sent


def test_a_process_does_not_hear_itself(pair):
    first, second = pair
    second.link.listen(TASK_STATE, TASK_STATE)
    second.link.publish("", TASK_STATE, UPDATE, None)

    assert first.inbox.next()[1] == UPDATE
    assert second.inbox.arrived.empty()


@pytest.fixture
def hearers(start, until_heard):
    """Robots and a program that hear who answers a leader, and the robot that does."""
    first = start("robot1")
    others = {"robot2": start("robot2", [first.address])}
    others["windows"] = start("windows", [first.address], is_member=False)
    for each in (first, *others.values()):
        each.link.listen(BB_ACK, BB_ACK)
    speaker = start("robot3", [each.address for each in (first, *others.values())])
    for name in ("", "/robot1", "/robot2", "/+"):
        until_heard(speaker.session, f"hive/lab/bb_ack/robot3{name}")
    return {"robot1": first, **others}, speaker.link


@pytest.mark.parametrize(
    ("to", "who"),
    [
        (None, {"robot1", "robot2", "windows"}),
        (["/robot1/robot"], {"robot1", "windows"}),
        (["robot2", "/robot2/robot"], {"robot2", "windows"}),
        (["robot1", "/robot2/robot", "/blackboard"], {"robot1", "robot2", "windows"}),
        (["/robot3/robot", "", "*", "+", "**", "robot1#2", "/"], {"windows"}),
        ([], {"windows"}),
    ],
)
def test_a_message_for_some_members_is_heard_by_them_and_by_programs_once(hearers, to, who):
    processes, link = hearers
    last = AppendReply("/robot3/robot#1", 9, 9, 9.0)
    link.publish("robot3", BB_ACK, REPLY, to)
    link.publish("robot3", BB_ACK, last, None)

    for name, each in processes.items():
        expected = [REPLY, last] if name in who else [last]
        found = [each.inbox.next() for _ in expected]
        assert [value for _, value in found] == expected
        assert {(arrival.sender, arrival.to) for arrival, _ in found} == {("robot3", "")}


@pytest.fixture
def agvs(start, until_heard):
    """The links of two robots of one process, and a leader that they hear and that hears them."""
    among = ("agv1", "agv2")
    leader = start("blackboard", topics=(TASK_STATE, BB_ENTRIES))
    leader.link.listen(BB_ACK, BB_ACK)
    first = start("agv1", [leader.address], topics=(BB_ACK,), among=among)
    second = start("agv2", [leader.address, first.address], topics=(BB_ACK,), among=among)
    for each in (first, second):
        for topic in (TASK_STATE, BB_ENTRIES, BB_ACK):
            each.link.listen(topic, topic)
        until_heard(each.session, f"hive/lab/bb_ack/{each.link.names[0]}/blackboard")
    for name in (
        "task_state/blackboard",
        "bb_entries/blackboard/agv1",
        "bb_entries/blackboard/agv2",
    ):
        until_heard(leader.session, f"hive/lab/{name}")
    return first, second, leader


def test_what_is_for_all_is_heard_once_by_the_robots_of_a_process(agvs):
    first, second, leader = agvs
    leader.link.publish("", TASK_STATE, UPDATE, None)
    leader.link.publish("", BB_ENTRIES, ENTRIES, ["/agv2/robot", "/agv1/robot"])

    said = [first.inbox.next() for _ in range(2)]
    (only,) = [second.inbox.next()]
    assert {(arrival.topic, arrival.to) for arrival, _ in said} == {
        (TASK_STATE, ""),
        (BB_ENTRIES, "agv1"),
    }
    assert (only[0].topic, only[0].to) == (BB_ENTRIES, "agv2")


def test_robots_of_a_process_speak_for_themselves_and_say_nothing_to_each_other(agvs):
    first, second, leader = agvs
    second.link.publish("agv2", BB_ACK, REPLY, ["/agv1/robot", "/blackboard"])
    first.link.publish("agv1", BB_ACK, REPLY, ["/blackboard"])
    leader.link.publish("", TASK_STATE, UPDATE, None)

    assert {leader.inbox.next()[0].sender for _ in range(2)} == {"agv1", "agv2"}
    assert first.inbox.next()[0].topic == TASK_STATE  # nothing came before


def test_each_robot_of_a_process_lives_by_a_token_of_its_own(start):
    among = ("agv1", "agv2")
    first = start("agv1", among=among)
    tokens = queue.Queue()
    first.session.liveliness().declare_subscriber(
        "hive/lab/alive/**", lambda sample: tokens.put(str(sample.key_expr)), history=True
    )
    start("agv2", [first.address], among=among)

    assert {tokens.get(timeout=WITHIN).split("/")[3] for _ in among} == set(among)


def test_a_robots_own_topic_is_below_its_name(start, until_heard):
    robot = start("robot1")
    robot.link.listen(SET_STATE, "robot1/set_state")
    operator = start("anna", [robot.address], topics=())
    key, text = "hive/lab/robot1/set_state/anna", io.BytesIO()
    until_heard(operator.session, key)
    WIRES[SET_STATE].encode("defect").serialize(text)
    operator.session.put(key, text.getvalue())

    arrival, said = robot.inbox.next()
    assert (arrival.sender, arrival.name, said) == ("anna", "robot1/set_state", "defect")


def test_what_is_latched_on_ros_is_repeated_for_new_listeners():
    assert {topic for topic, wire in WIRES.items() if wire.latched} <= REPEATED


def test_a_new_listener_gets_the_last_list_and_each_status_of_the_process_itself(start):
    first = start("robot1")
    first.link.publish("", SYNC, TaskList(1, 2, (), "hive1"), None)
    first.link.publish("", SYNC, TaskList(1, 3, (), "hive1"), None)
    first.link.publish("", ROBOT_STATUS, status("robot1", "here"), None)
    first.link.publish("", ROBOT_STATUS, status("robot9", "of another"), None)
    late = start("robot2", [first.address])
    for topic in (SYNC, ROBOT_STATUS):
        late.link.listen(topic, topic)

    for _ in range(4):  # tokens of two that live, and of what the second listens to
        first.inbox.do_next()
    heard = {arrival.topic: value for arrival, value in (late.inbox.next() for _ in range(2))}

    assert heard[SYNC].version == 3
    assert heard[ROBOT_STATUS].reason == "here"


@pytest.mark.parametrize("payload", [b"", b"\x00", b"\xff" * 40, b"x" * 100_000])
def test_bytes_that_are_no_message_are_refused_when_they_are_read(pair, payload):
    first, second = pair
    second.session.put("hive/lab/task_state/robot2", payload)
    arrival = first.inbox.arrived.get(timeout=WITHIN)

    with pytest.raises((ValueError, genpy.DeserializationError)):
        WIRES[TASK_STATE].from_msg(arrival.read())


def test_a_message_that_is_too_large_is_not_read(pair, monkeypatch):
    first, second = pair
    monkeypatch.setattr(link_module, "MAX_SIZE", 10)
    second.link.publish("", TASK_STATE, UPDATE, None)
    arrival = first.inbox.arrived.get(timeout=WITHIN)

    with pytest.raises(ValueError, match="bytes; allowed: at most 10"):
        arrival.read()


def test_a_process_that_speaks_as_another_is_refused(pair):
    first, _ = pair
    reply = AppendReply("/robot1/robot#1", 3, 7, 1.5)

    assert first.link.why_refused(reply, "robot1") == ""
    assert "robot2 speaks as /robot1/robot" in first.link.why_refused(reply, "robot2")


def test_what_may_be_said_is_advertised_at_the_start(start):
    with pytest.raises(KeyError):
        start("robot1", topics=(TASK_STATE,)).link.publish("", NEW_TASK, None, None)


def test_a_process_whose_session_closes_is_proved_dead_by_its_address(start):
    first = start("robot1")
    second = start("robot2", [first.address])
    died = []
    first.link.watch("/robot1/robot", "robot2", lambda: died.append("robot2"))
    first.inbox.do_next()  # its own token
    first.inbox.do_next()  # the other's token
    first.inbox.pass_time()
    assert (died, first.inbox.looks) == ([], [])

    second.session.close()
    first.inbox.do_next()  # the token goes
    while not died:
        first.inbox.pass_time()

    assert died == ["robot2"]
