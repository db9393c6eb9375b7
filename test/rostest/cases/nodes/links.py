# SPDX-License-Identifier: BSD-3-Clause
"""A connection that rospy has lost is made: the news of a publisher came in before "nobody".

And many that are made at once come about at once.
"""

import contextlib
import socket
import sys
import threading

import pytest
import rosgraph
import rospy
from launching import Launches
from rospy.impl.registration import RegManager
from rospy.impl.tcpros_base import init_tcpros_server
from std_msgs.msg import String

from hive_common.ros import links as of_blackboard
from hive_common.ros import links as of_robots
from hive_lab.runner.limits import PATIENCE

SPEAKER = """
import rospy, std_msgs.msg
rospy.init_node("speaker", anonymous=True)
speaker = rospy.Publisher("{topic}", std_msgs.msg.String, latch=True, queue_size=1)
speaker.publish("here")
rospy.spin()
"""


@pytest.fixture
def launches():
    launches = Launches()
    yield launches
    launches.stop()


@pytest.mark.parametrize("links", [of_blackboard, of_robots])
def test_a_publisher_that_rospy_has_overlooked_is_connected(links, launches, monkeypatch):
    rospy.init_node("listener")
    topic, heard, overlooked = f"/{links.__name__.replace('.', '_')}", [], threading.Event()
    believed = RegManager.publisher_update

    def overlook(manager, name, uris):
        if name == topic and uris:
            overlooked.set()
        else:
            believed(manager, name, uris)

    monkeypatch.setattr(RegManager, "publisher_update", overlook)
    came = threading.Event()
    rospy.Subscriber(topic, String, lambda message: (heard.append(message.data), came.set()))
    launches.run(sys.executable, "-c", SPEAKER.format(topic=topic))
    assert overlooked.wait(PATIENCE)
    monkeypatch.undo()
    assert heard == []

    links.connect(links.overlooked())

    assert came.wait(PATIENCE)
    assert heard == ["here"]


@pytest.mark.parametrize("links", [of_blackboard, of_robots])
def test_the_master_is_asked_for_no_address_where_every_publisher_is_heard(
    links, launches, monkeypatch
):
    rospy.init_node("listener")
    topic, came = f"/{links.__name__.replace('.', '_')}_heard", threading.Event()
    rospy.Subscriber(topic, String, lambda _: came.set())
    launches.run(sys.executable, "-c", SPEAKER.format(topic=topic))
    assert came.wait(PATIENCE)
    asked = []
    monkeypatch.setattr(rosgraph.Master, "lookupNode", lambda _, node: asked.append(node))
    links.overlooked()

    assert [node for node in asked if "speaker" in node] == []


@pytest.mark.parametrize("links", [of_blackboard, of_robots])
def test_a_hundred_who_call_a_busy_node_at_once_are_all_let_in(links, monkeypatch):
    rospy.init_node("listener")
    door, goes_on = init_tcpros_server().tcp_ros_server, threading.Event()
    door.server_sock.listen(5)
    monkeypatch.setattr(door, "inbound_handler", lambda *_: goes_on.wait(PATIENCE))
    links.mend_links()

    with contextlib.ExitStack() as callers:
        callers.callback(goes_on.set)
        for _ in range(100):
            callers.enter_context(socket.create_connection(door.get_full_addr(), timeout=PATIENCE))
