# SPDX-License-Identifier: BSD-3-Clause
"""A VDA 5050 master drives a robot that has move_base and an arm, through the real connector."""

import math
import queue
import time

import pytest
import rospy
from std_msgs.msg import Float64

from hive_lab.runner.limits import PATIENCE
from vda5050.mqtt.link import BrokerSettings, Link
from vda5050.mqtt.local_broker import local_broker
from vda5050.protocol.actions import ActionStatus, BlockingType, InstantActions
from vda5050.protocol.codec import decode, encode
from vda5050.protocol.header import Header, timestamp_of
from vda5050.protocol.order import Order
from vda5050.protocol.state import ConnectionState
from vda5050.protocol.topics import Address, Topic, parse_topic
from vda5050.protocol.versions import Version
from vda5050.simulated.testing import action, node, order

VERSION = Version.V2_1
ADDRESS = Address.of(VERSION, "Acme", "robot1")


class Master:
    """Sends orders to one vehicle, and remembers the last of what it tells."""

    def __init__(self, broker):
        self._heard = queue.Queue()
        self.last = {}
        self._link = Link(
            broker,
            "master",
            lambda name, payload: self._heard.put((parse_topic(name)[1], payload)),
        )
        self._link.subscribe([ADDRESS.topic(topic) for topic in Topic])
        self._link.start()

    def close(self):
        self._link.stop()

    def send(self, body):
        topic = Topic.ORDER if isinstance(body, Order) else Topic.INSTANT_ACTIONS
        header = Header(0, timestamp_of(time.time()), VERSION.text, "Acme", "robot1")
        assert self._link.publish(ADDRESS.topic(topic), encode(header, body, VERSION))

    def expect(self, holds, what):
        """Hear until something holds."""
        end = time.monotonic() + PATIENCE
        while not holds(self.last):
            try:
                topic, payload = self._heard.get(timeout=max(end - time.monotonic(), 0.0))
            except queue.Empty:
                pytest.fail(f"not within {PATIENCE:g} s: {what}; heard: {self.last}")
            self.last[topic] = decode(payload, topic, VERSION).body

    def expect_state(self, holds, what):
        self.expect(lambda last: Topic.STATE in last and holds(last[Topic.STATE]), what)
        return self.last[Topic.STATE]


@pytest.fixture(scope="module")
def broker():
    rospy.init_node("vda5050_master")
    port = rospy.get_param("/robot1/vda5050_connector/broker/port")
    with local_broker(port):
        yield BrokerSettings(port=port)


@pytest.fixture(scope="module")
def master(broker):
    master = Master(broker)
    yield master
    master.close()


def test_a_robot_does_an_order_with_a_pick_and_cancels_the_next(master):
    master.expect(lambda last: Topic.FACTSHEET in last, "a factsheet")
    state = master.expect_state(lambda state: state.mobile_robot_position, "a position")
    assert master.last[Topic.CONNECTION].connection_state is ConnectionState.ONLINE
    here = state.mobile_robot_position

    first = node(0, here.x, here.y, map_id="map")
    pick = action("pick", "p1", weight=2.0, loadId="L7")
    last = node(2, 13.6, 10.2, map_id="map", theta=math.pi / 2, actions=[pick])
    master.send(order([first, node(1, 12.8, 9.6, map_id="map"), last]))
    master.expect_state(lambda state: state.last_node_id == "n1", "it passes the first node")
    state = master.expect_state(lambda state: state.loads, "a load")
    assert state.last_node_id == "n2"
    assert state.action("p1").action_status is ActionStatus.FINISHED
    assert (
        math.dist((state.mobile_robot_position.x, state.mobile_robot_position.y), (13.6, 10.2))
        < 0.3
    )

    factor = rospy.Publisher("/simenv/rtf", Float64, queue_size=1, latch=True)
    factor.publish(0.5)  # so that it is on its way still when the master cancels, however late
    far = node(1, 17.0, 5.6, map_id="map")
    master.send(order([node(0, 13.6, 10.2, map_id="map"), far], order_id="o2", speed=0.25))
    master.expect_state(lambda state: state.order_id == "o2" and state.driving, "it drives")
    speeds = []

    def drives(last):
        speeds.append(last[Topic.VISUALIZATION].velocity.vx)
        return sum(speed > 0.1 for speed in speeds) >= 5

    master.expect(drives, "it drives slowly")
    assert max(speeds) < 0.3  # the robot's own top speed is 1 m/s
    master.send(InstantActions((action("cancelOrder", "c1", BlockingType.NONE),)))
    state = master.expect_state(
        lambda state: state.action("c1") and state.action("c1").action_status.ended, "it stops"
    )
    assert state.action("c1").action_status is ActionStatus.FINISHED
    assert state.node_states == ()
    assert state.errors == ()
