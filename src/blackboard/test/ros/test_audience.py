# SPDX-License-Identifier: BSD-3-Clause
"""Which of a publisher's connections get a message; the test stands in for rospy."""

from threading import Lock

import pytest

pytest.importorskip("rospy", reason="needs ROS")

from blackboard.ros.rospy_patches.audience import Audience

NODES = {"robot1": "/robot1/robot", "robot2": "/robot2/robot"}
WINDOW = "/task_view"


class Link:
    """A connection: the name at its other end, and what was written to it."""

    def __init__(self, node):
        self.endpoint_id = self.callerid_pub = node
        self.written = []
        self.closed = self.broken = False

    def write_data(self, data):
        if self.broken:
            raise OSError
        self.written.append(data)

    def close(self):
        self.closed = True


class Topic:
    """A publisher or a subscriber, as far as an audience looks into it."""

    def __init__(self, *nodes):
        self.impl = self
        self.connections = [Link(node) for node in nodes]
        self._lock = Lock()
        self.acquire, self.release = self._lock.acquire, self._lock.release

    def publish(self, message, connection_override=None):
        each = self.connections if connection_override is None else [connection_override]
        for link in each:
            link.write_data(message)

    def heard_by(self):
        return [link.endpoint_id for link in self.connections if link.written]


@pytest.fixture
def audience():
    """The audience of a voter beside two robots that vote, with a window."""
    audience = Audience(lambda robot: NODES.get(robot, ""))
    audience.speaks = Topic(*NODES.values())
    audience.listens = Topic(*NODES.values(), "/talks/nonsense")
    return audience


@pytest.fixture
def publisher():
    """A publisher that all subscribe to."""
    return Topic(*NODES.values(), WINDOW, "/talks/nonsense")


@pytest.mark.parametrize("name", ["robot1", "/robot1/robot"])
def test_a_message_goes_to_the_member_it_concerns_and_to_all_that_are_not_members(
    audience, publisher, name
):
    audience.tell(publisher, "news", (name,))

    assert publisher.heard_by() == ["/robot1/robot", WINDOW, "/talks/nonsense"]


def test_a_message_that_concerns_no_member_goes_to_the_others(audience, publisher):
    audience.tell(publisher, "news", ())

    assert publisher.heard_by() == [WINDOW, "/talks/nonsense"]


def test_an_empty_name_is_ignored(audience, publisher):
    audience.tell(publisher, "news", ("/robot1/robot", ""))

    assert publisher.heard_by() == ["/robot1/robot", WINDOW, "/talks/nonsense"]


def test_a_message_to_a_robot_whose_node_is_unknown_goes_to_all(audience, publisher):
    audience.tell(publisher, "news", ("robot9",))

    assert len(publisher.heard_by()) == 4


def test_a_member_that_is_not_known_as_one_yet_gets_everything(audience, publisher):
    audience.listens.connections[1].callerid_pub = "unknown"  # until it has said its name
    audience.tell(publisher, "first", ("robot1",))
    early = publisher.heard_by()
    audience.listens.connections[1].callerid_pub = "/robot2/robot"
    audience.tell(publisher, "second", ("robot1",))

    assert "/robot2/robot" in early
    assert publisher.connections[1].written == ["first"]


def test_a_member_that_joins_later_is_found(audience, publisher):
    audience.tell(publisher, "first", ("robot1",))
    for topic in (audience.speaks, audience.listens):
        topic.connections = [*topic.connections, Link("/robot3/robot")]
    publisher.connections = [*publisher.connections, Link("/robot3/robot")]
    audience.tell(publisher, "second", ("robot1",))

    assert publisher.connections[-1].written == []


def test_a_broken_connection_is_closed_and_the_others_get_the_message(audience, publisher):
    publisher.connections[0].broken = True
    audience.tell(publisher, "news", ("robot1",))

    assert publisher.connections[0].closed
    assert WINDOW in publisher.heard_by()


def test_a_node_that_is_not_a_member_publishes_everything_to_all(publisher):
    Audience(lambda _: "").tell(publisher, "news", ("/robot1/robot",))

    assert len(publisher.heard_by()) == 4
