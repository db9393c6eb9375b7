# SPDX-License-Identifier: BSD-3-Clause
"""What a relay carries between the ROS of its machine and Zenoh, on this machine's loopback.

Two machines, `a` and `b`, whose hives have these namespaces, so that one fake ROS stands for both.
"""

from __future__ import annotations

import queue
import socket
from collections import defaultdict

import pytest

pytest.importorskip("robot_description.msg", reason="needs generated messages")

import genpy
import rospy
from robot_description.msg import Traffic, TrafficState, ZoneCommand
from zenoh.handlers import Callback

from blackboard.ros import relay as relay_module
from blackboard.ros.relay import RELAYED, Relay
from blackboard.zenoh import link as link_module
from blackboard.zenoh.link import serialized
from blackboard.zenoh.opening import open_session
from blackboard.zenoh.session import Endpoints, Own, session_config

WITHIN = 20.0  # a busy machine needs no longer [s]
NOW, STAMPED = 70, 7
"""The time here, and of what somebody else has said [s]."""

CLOSED = "closed"
"""Says in a message that its topic has closed."""

RELAY = "/a/robot"
"""The node of machine a's relay."""


class FakeRos:
    """The publishers and subscribers of both machines, by topic."""

    def __init__(self):
        self.published = defaultdict(queue.Queue)
        self.headers, self.kinds, self.subscribers = {}, {}, {}
        self.ends = iter(())  # what rospy says next when it is asked whether it is shut down

    def advertise(self, name, kind, *, headers, **_):
        self.headers[name], self.kinds[name] = headers, kind
        return Publisher(self.published[name])

    def subscribe(self, name, kind, hear, **_):
        self.subscribers[name] = kind, hear

    def say(self, name, message, caller="/move_base", **header):
        """Have a node publish a message, which ROS hands over with what its connection says."""
        kind, hear = self.subscribers[name]
        heard = kind().deserialize(serialized(message))
        object.__setattr__(heard, "_connection_header", {"callerid": caller, **header})
        hear(heard)

    def next(self, name):
        """Return the next message that a relay publishes on a topic."""
        return self.published[name].get(timeout=WITHIN)


class FakeTime:
    """The clock of this machine, which stands still."""

    @staticmethod
    def now():
        return genpy.Time(NOW)


class Publisher:
    def __init__(self, published):
        self._published = published

    def publish(self, message):
        if getattr(message, "waits_for", "") == CLOSED:
            raise rospy.ROSException("publish() to a closed topic")
        self._published.put(message)


class Machine:
    """The session and the relay of one machine, and what the relay has refused."""

    def __init__(self, ends, name, namespace, wait):
        self.wait = wait
        self.session = open_session(session_config(ends))
        self.refused = queue.Queue()
        self.relay = Relay(
            self.session, Own("lab", name), namespace, lambda *what: self.refused.put(what)
        )

    def until_heard(self, topic):
        """Wait until this session knows that the other listens to a topic."""
        self.wait(self.session, f"hive/lab/{topic}/probe")


@pytest.fixture
def ros(monkeypatch):
    fake = FakeRos()
    monkeypatch.setattr(rospy, "Publisher", fake.advertise)
    monkeypatch.setattr(rospy, "Subscriber", fake.subscribe)
    monkeypatch.setattr(rospy, "get_name", lambda: RELAY)
    monkeypatch.setattr(rospy, "is_shutdown", lambda: next(fake.ends, False))
    monkeypatch.setattr(rospy, "Time", FakeTime)
    return fake


@pytest.fixture
def machines(ros, until_heard):
    """Machines a and b, connected; they carry nothing yet."""
    assert ros.subscribers == {}
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        end = f"tcp/127.0.0.1:{probe.getsockname()[1]}"
    a = Machine(Endpoints(listen=(end,)), "robot1", "/a/", until_heard)
    b = Machine(Endpoints(connect=(end,)), "robot2", "/b/", until_heard)
    yield a, b
    for each in (b, a):
        each.session.close()


@pytest.fixture
def out(machines):
    """Machines of which the first takes `traffic` and `traffic_state` out to the second."""
    a, b = machines
    for topic, kind in (("traffic", Traffic), ("traffic_state", TrafficState)):
        b.relay.bring_in(topic, kind)
        a.relay.bring_in(topic, kind)
        a.relay.take_out(topic, kind)
        a.until_heard(topic)
        b.until_heard(topic)
    return a, b


def state(epoch, seq=0):
    made = TrafficState(epoch=epoch, closed=["door"])
    made.header.seq = seq
    made.header.stamp.secs = STAMPED
    return made


def test_a_message_goes_out_on_one_machine_and_in_on_the_other_with_all_it_says(ros, out):
    assert len(out) == 2
    said = Traffic(name="robot1", since=float("inf"), radius=0.5)
    said.header.stamp.secs = NOW
    ros.say("/a/traffic", said)

    assert ros.next("/b/traffic") == said


@pytest.mark.usefixtures("out")
def test_a_robot_s_announcement_is_stamped_by_the_clock_of_the_machine_that_hears_it(ros):
    for secs in (NOW - 5, NOW + 5):
        said = Traffic(name="robot1")
        said.header.stamp.secs = secs
        ros.say("/a/traffic", said)

        assert ros.next("/b/traffic").header.stamp == genpy.Time(NOW)


@pytest.mark.usefixtures("out")
def test_what_tells_times_of_its_sender_s_clock_keeps_its_stamp(ros):
    ros.say("/a/traffic_state", state(epoch=1))

    assert ros.next("/b/traffic_state").header.stamp == genpy.Time(STAMPED)


def test_it_speaks_in_the_name_of_its_own_process_to_others_only(ros, machines):
    a, b = machines
    heard, own = queue.Queue(), queue.Queue()
    for machine, found in ((a, own), (b, heard)):
        machine.session.declare_subscriber("hive/lab/**", Callback(found.put, indirect=False))
    a.relay.take_out("traffic", Traffic)
    a.until_heard("traffic")
    ros.say("/a/traffic", Traffic(name="robot1"))

    assert str(heard.get(timeout=WITHIN).key_expr) == "hive/lab/traffic/robot1"
    assert own.empty()


@pytest.mark.usefixtures("out")
def test_its_publishers_have_the_topics_type_and_tell_that_they_are_a_relays(ros):
    assert ros.kinds["/b/traffic"] is Traffic
    assert ros.kinds["/b/traffic_state"] is TrafficState
    assert all(RELAYED in header for header in ros.headers.values())


@pytest.mark.usefixtures("out")
def test_it_hears_topics_in_their_type_because_a_process_gets_each_in_one(ros):
    kinds = {name: kind for name, (kind, _) in ros.subscribers.items()}

    assert kinds == {"/a/traffic": Traffic, "/a/traffic_state": TrafficState}


@pytest.mark.usefixtures("out")
def test_what_another_relay_has_published_is_not_taken_out(ros):
    ros.say("/a/traffic_state", state(1), caller="/a/gateway", relayed="1")
    ros.say("/a/traffic_state", state(2), caller="/a/traffic_planner")

    assert ros.next("/b/traffic_state").epoch == 2


@pytest.mark.usefixtures("out")
def test_what_the_process_of_the_relay_says_itself_is_taken_out(ros):
    ros.say("/a/traffic_state", state(1), caller=RELAY, relayed="1")

    assert ros.next("/b/traffic_state") == state(1)


def test_what_the_relay_has_brought_in_is_not_taken_out_again(ros, out):
    _, b = out
    b.session.put("hive/lab/traffic_state/robot2", serialized(state(1)))
    brought = ros.next("/a/traffic_state")
    brought.header.seq = 33  # rospy numbers what it publishes
    ros.say("/a/traffic_state", brought, caller=RELAY, relayed="1")
    ros.say("/a/traffic_state", state(2, seq=34), caller=RELAY, relayed="1")

    assert ros.next("/b/traffic_state").epoch == 2


def test_a_relay_does_not_bring_in_what_it_takes_out_itself(ros, out):
    _, b = out
    ros.say("/a/traffic_state", state(1))
    assert ros.next("/b/traffic_state").epoch == 1
    b.session.put("hive/lab/traffic_state/robot2", serialized(state(2)))

    assert ros.next("/a/traffic_state").epoch == 2


@pytest.mark.parametrize("payload", [b"", b"\xff" * 40, b"\x00" * 19])
def test_bytes_that_are_no_message_are_refused_with_their_topic_and_a_reason(ros, out, payload):
    a, b = out
    a.session.put("hive/lab/traffic/robot1", payload)
    topic, reason = b.refused.get(timeout=WITHIN)
    ros.say("/a/traffic", Traffic(name="robot1"))

    assert topic == "traffic"
    assert reason
    assert ros.next("/b/traffic").name == "robot1"
    assert b.refused.empty()


def test_a_message_that_is_too_long_is_refused(ros, out, monkeypatch):
    _, b = out
    monkeypatch.setattr(link_module, "MAX_SIZE", 10)
    ros.say("/a/traffic", Traffic(name="robot1"))
    topic, reason = b.refused.get(timeout=WITHIN)

    assert topic == "traffic"
    assert "allowed: at most 10" in reason
    assert ros.published["/b/traffic"].empty()


def test_a_key_that_is_deleted_is_no_message(ros, out):
    a, b = out
    a.session.delete("hive/lab/traffic/robot1")
    a.session.put("hive/lab/traffic/robot1", serialized(Traffic(name="robot1")))

    assert ros.next("/b/traffic").name == "robot1"
    assert b.refused.empty()


@pytest.mark.usefixtures("out")
def test_nothing_is_published_once_the_node_is_shut_down(ros):
    ros.ends = iter([True])
    for other in ("too late", "robot2"):
        ros.say("/a/traffic", Traffic(name="robot1", waits_for=other))

    assert ros.next("/b/traffic").waits_for == "robot2"


@pytest.mark.usefixtures("out")
@pytest.mark.parametrize("ends", [True, False])
def test_a_topic_that_has_closed_is_an_error_unless_the_node_is_being_shut_down(
    ros, monkeypatch, caplog, ends
):
    monkeypatch.setattr(relay_module, "is_shutting_down", lambda: ends)
    for word in (CLOSED, "robot2"):
        ros.say("/a/traffic", Traffic(name="robot1", waits_for=word))

    assert ros.next("/b/traffic").waits_for == "robot2"
    assert ("closed topic" in caplog.text) is not ends


def test_messages_without_a_header_are_carried_too(ros, machines):
    a, b = machines
    b.relay.bring_in("zone_command", ZoneCommand)
    a.relay.take_out("zone_command", ZoneCommand)
    a.until_heard("zone_command")
    ros.say("/a/zone_command", ZoneCommand("door", True), caller="/operator")

    assert ros.next("/b/zone_command") == ZoneCommand("door", True)


def test_what_is_for_a_display_is_heard_from_the_robot_itself_only(machines):
    a, b = machines
    heard = queue.Queue()
    take = lambda *said: heard.put(said)  # noqa: E731  (a callback)
    a.relay.hear("robot2/plan", Traffic, "robot2", take)
    teller = b.relay.advertise("robot2/plan", for_display=True)
    b.wait(b.session, "hive/lab/robot2/plan/robot2")
    b.session.put("hive/lab/robot2/plan/robot3", serialized(Traffic(name="robot3")))
    teller.put(serialized(Traffic(name="robot2")))

    assert heard.get(timeout=WITHIN) == (Traffic(name="robot2"), "robot2")
    assert heard.empty()


def test_a_message_that_is_not_taken_is_refused_with_the_reason(machines):
    a, b = machines

    def take(msg, _sender):
        raise ValueError(f"{msg.name} is no pose")

    a.relay.hear("robot2/amcl_pose", Traffic, "robot2", take)
    teller = b.relay.advertise("robot2/amcl_pose", for_display=True)
    b.wait(b.session, "hive/lab/robot2/amcl_pose/robot2")
    teller.put(serialized(Traffic(name="x")))

    assert a.refused.get(timeout=WITHIN) == ("robot2/amcl_pose", "x is no pose")


def test_hives_of_other_names_hear_nothing(ros, machines):
    a, b = machines
    hall = Relay(b.session, Own("hall", "robot2"), "/hall/", lambda *_: None)
    hall.bring_in("traffic", Traffic)
    b.relay.bring_in("traffic", Traffic)
    a.relay.take_out("traffic", Traffic)
    a.until_heard("traffic")
    ros.say("/a/traffic", Traffic(name="robot1"))

    assert ros.next("/b/traffic").name == "robot1"
    assert ros.published["/hall/traffic"].empty()


def test_what_other_robots_of_its_machine_announce_is_left_to_their_own_relays(ros, out):
    for name in ("agv1", "robot1"):
        ros.say("/a/traffic", Traffic(name=name))

    assert ros.next("/b/traffic").name == "robot1"
    assert out[1].refused.empty()


def test_what_robots_of_its_own_process_say_is_not_brought_in(ros, machines):
    a, b = machines
    both = Relay(b.session, Own("lab", "robot2"), "/b/", print, ours=("robot2", "agv1"))
    both.bring_in("traffic", Traffic)
    a.until_heard("traffic")
    for name in ("agv1", "robot1"):
        a.session.put(f"hive/lab/traffic/{name}", serialized(Traffic(name=name)))

    assert ros.next("/b/traffic").name == "robot1"


def test_a_robot_that_announces_where_another_one_drives_is_refused(ros, out):
    a, b = out
    for name in ("robot2", "r" * 500, "robot1"):
        a.session.put("hive/lab/traffic/robot1", serialized(Traffic(name=name)))

    assert ros.next("/b/traffic").name == "robot1"
    refused = [b.refused.get(timeout=WITHIN) for _ in range(2)]
    assert [topic for topic, _ in refused] == ["traffic", "traffic"]
    assert "robot1 announces where 'robot2' drives" in refused[0][1]
    assert len(refused[1][1]) < 200
