# SPDX-License-Identifier: BSD-3-Clause
"""A `move_base` robot does what any master wants of it."""

import attrs
import pytest

from hive_common.pose import Pose
from robot_description.models import load_model
from vda5050.connector.connector import Connector, ConnectorSettings
from vda5050.connector.testing import FakeArm, FakeNavigation
from vda5050.protocol.actions import ActionStatus, BlockingType, InstantActions
from vda5050.protocol.codec import decode, encode
from vda5050.protocol.header import Header, timestamp_of
from vda5050.protocol.order import Order
from vda5050.protocol.state import ErrorLevel
from vda5050.protocol.topics import Address, Topic, parse_topic
from vda5050.protocol.versions import Version
from vda5050.simulated.testing import MAP, action, node, order
from vda5050.vehicle.channel import Channel


class Rig:
    """One robot with a fake navigation, and the master that drives it."""

    def __init__(self, version):
        self.version, self.now = version, 0.0
        self.address = Address.of(version, "Acme", "robot1")
        self.heard, self.headers = [], []
        self.navigation, self.arm = FakeNavigation(Pose(0, 0)), FakeArm()
        self.connector = Connector(
            ConnectorSettings(version=version, map_id=MAP),
            load_model("fetch"),
            self.navigation,
            self.arm,
            Channel(self.address, version, self._receive, lambda: self.now),
        )
        self.connector.endpoint.report.connected()
        self.run(0.2)

    def _receive(self, name, payload, _qos, _retain):
        _, topic = parse_topic(name)
        message = decode(payload, topic, self.version)
        self.heard.append((topic, message.body))
        self.headers.append((topic, message.header))

    def send(self, body):
        topic = Topic.ORDER if isinstance(body, Order) else Topic.INSTANT_ACTIONS
        header = Header(0, timestamp_of(0.0), self.version.text, "Acme", "robot1")
        self.connector.hear(self.address.topic(topic), encode(header, body, self.version))

    def instantly(self, kind, action_id, **parameters):
        self.send(InstantActions((action(kind, action_id, BlockingType.NONE, **parameters),)))

    def run(self, seconds):
        for _ in range(round(seconds / 0.1)):
            self.navigation.step(0.1)
            self.connector.step(self.now)
            self.now += 0.1

    def all(self, topic):
        return [body for kind, body in self.heard if kind is topic]

    @property
    def state(self):
        return self.all(Topic.STATE)[-1]

    def status(self, action_id):
        return self.state.action(action_id).action_status


@pytest.fixture(params=list(Version), ids=lambda version: version.value)
def rig(request):
    return Rig(request.param)


def test_a_master_learns_what_the_robot_is_and_where(rig):
    assert rig.all(Topic.FACTSHEET)[0].type_specification.series_name == "fetch"
    assert rig.all(Topic.FACTSHEET)[0].can("pick")
    assert rig.state.mobile_robot_position.localized
    assert rig.all(Topic.VISUALIZATION)


def test_the_released_nodes_become_goals_one_after_the_other(rig):
    rig.send(order([node(0, 0, 0), node(1, 3, 0), node(2, 3, 3), node(3, 9, 9, released=False)]))
    rig.run(10.0)

    assert [(goal.x, goal.y) for goal in rig.navigation.goals] == [(3, 0), (3, 3)]
    assert rig.navigation.goals[1].yaw == pytest.approx(1.5708, abs=1e-3)
    assert rig.state.last_node_id == "n2"
    assert [each.node_id for each in rig.state.node_states] == ["n3"]


def test_on_its_way_it_gets_the_next_goal_before_it_stops(rig):
    rig.send(order([node(0, 0, 0), node(1, 3, 0), node(2, 6, 0)]))
    standing = 0
    for _ in range(55):
        rig.run(0.1)
        standing += rig.navigation.velocity.vx == 0

    assert standing <= 1
    assert len(rig.navigation.goals) == 2


def test_a_base_that_grows_goes_on_to_the_new_nodes(rig):
    rig.send(order([node(0, 0, 0), node(1, 4, 0), node(2, 8, 0, released=False)]))
    rig.run(1.0)
    rig.send(order([node(1, 4, 0), node(2, 8, 0)], update=1))
    rig.run(12.0)

    assert rig.state.last_node_id == "n2"
    assert rig.navigation.pose.x == 8


def test_a_goal_that_fails_is_tried_again_and_then_told(rig):
    rig.navigation.blocked = "no path"
    rig.send(order([node(0, 0, 0), node(1, 3, 0)]))
    rig.run(2.0)

    assert len(rig.navigation.goals) == 3
    [error] = rig.state.errors
    assert error.error_description == "no path"
    assert error.about("nodeId") == "n1"
    assert not rig.state.driving


def test_after_a_failure_a_master_cancels_and_gives_another_order(rig):
    rig.navigation.blocked = "no path"
    rig.send(order([node(0, 0, 0), node(1, 3, 0)]))
    rig.run(2.0)
    rig.instantly("cancelOrder", "c1")
    rig.run(0.3)
    assert rig.status("c1") is ActionStatus.FINISHED

    rig.navigation.blocked = ""
    rig.send(order([node(0, 0, 0), node(1, 0, 2)], order_id="o2"))
    rig.run(5.0)
    assert rig.state.last_node_id == "n1"
    assert rig.state.errors == ()


def test_a_cancelled_order_cancels_the_goal(rig):
    rig.send(order([node(0, 0, 0), node(1, 9, 0)]))
    rig.run(2.0)
    rig.instantly("cancelOrder", "c1")
    rig.run(1.0)

    assert rig.status("c1") is ActionStatus.FINISHED
    assert rig.navigation.pose.x < 3
    assert rig.state.node_states == ()


def test_a_pause_takes_the_goal_away_and_its_end_gives_it_back(rig):
    rig.send(order([node(0, 0, 0), node(1, 9, 0)]))
    rig.run(2.0)
    rig.instantly("startPause", "i1")
    rig.run(5.0)
    assert rig.state.paused
    assert rig.navigation.pose.x < 3
    rig.instantly("stopPause", "i2")
    rig.run(10.0)
    assert rig.state.last_node_id == "n1"


def test_it_keeps_the_speed_limit_of_its_edge_and_has_none_afterwards(rig):
    rig.send(order([node(0, 0, 0), node(1, 3, 0)], speed=0.3))
    rig.run(5.0)
    assert rig.navigation.pose.x == pytest.approx(1.5, abs=0.1)
    assert rig.state.errors == ()
    rig.run(7.0)
    assert rig.state.last_node_id == "n1"
    assert rig.navigation.limit is None


def test_it_brakes_for_the_limit_of_the_next_edge_before_it_gets_there(rig):
    fast = order([node(0, 0, 0), node(1, 4, 0), node(2, 8, 0)])
    slow = attrs.evolve(fast.edges[1], maximum_speed=0.2)
    rig.send(attrs.evolve(fast, edges=(fast.edges[0], slow)))
    rig.run(2.0)
    assert rig.navigation.limit is None
    rig.run(1.5)
    assert (rig.navigation.limit, rig.state.last_node_id) == (0.2, "n0")


def test_it_tells_of_an_edge_whose_limit_it_cannot_keep(rig):
    rig.navigation.heeds_limits = False
    rig.send(order([node(0, 0, 0), node(1, 3, 0)], speed=0.3))
    rig.run(1.5)
    [error] = rig.state.errors
    assert error.error_level is ErrorLevel.WARNING
    assert error.about("edgeId") == "e1"
    assert "0.3 m/s" in error.error_description

    rig.run(5.0)
    assert rig.state.last_node_id == "n1"
    assert rig.state.errors == ()


def test_a_limit_above_its_top_speed_is_none(rig):
    rig.navigation.heeds_limits = False
    rig.send(order([node(0, 0, 0), node(1, 3, 0)], speed=9.0))
    rig.run(1.5)

    assert rig.state.errors == ()


def test_pick_and_drop_are_orders_to_its_arm(rig):
    pick = action("pick", "p1", loadId="L7", weight=4.0)
    rig.send(
        order(
            [
                node(0, 0, 0, actions=[pick]),
                node(1, 3, 0, actions=[action("drop", "d1", loadId="L7")]),
            ]
        )
    )
    rig.run(1.0)
    assert rig.status("p1") is ActionStatus.RUNNING
    rig.arm.end(done=True)
    rig.run(0.2)
    assert [each.load_id for each in rig.state.loads] == ["L7"]
    rig.run(5.0)
    rig.arm.end(done=True)
    rig.run(0.2)

    assert rig.status("d1") is ActionStatus.FINISHED
    assert rig.state.loads == ()
    assert rig.arm.orders == [(True, "p1", 4.0), (False, "p1", 0.0)]


def test_an_arm_that_fails_says_why(rig):
    rig.send(order([node(0, 0, 0, actions=[action("pick", "p1")])]))
    rig.run(0.5)
    rig.arm.end(done=False, text="nothing is there")
    rig.run(0.2)

    assert rig.status("p1") is ActionStatus.FAILED
    assert rig.state.action("p1").action_result == "nothing is there"
    assert rig.state.loads == ()


@pytest.mark.parametrize("weight", [7.0, -1.0, "heavy"])
def test_a_load_that_its_arm_cannot_lift_is_refused_with_the_order(rig, weight):
    rig.send(order([node(0, 0, 0, actions=[action("pick", "p1", weight=weight)])]))
    rig.run(0.3)

    assert rig.state.order_id == ""
    assert len(rig.state.errors) == 1


def test_a_position_that_a_person_gives_goes_to_the_localization(rig):
    rig.instantly("initPosition", "i1", x=5.0, y=6.0, theta=0.5, mapId=MAP, lastNodeId="n5")
    rig.run(0.3)

    assert rig.navigation.pose == Pose(5.0, 6.0, 0.5)
    assert rig.state.last_node_id == "n5"


def test_headers_count_up_on_each_topic(rig):
    rig.run(5.0)
    for topic in (Topic.STATE, Topic.VISUALIZATION):
        numbers = [header.header_id for kind, header in rig.headers if kind is topic]
        assert numbers == list(range(len(numbers)))
        assert len(numbers) > 3
