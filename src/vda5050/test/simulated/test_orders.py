# SPDX-License-Identifier: BSD-3-Clause
"""A simulated AGV takes, extends, refuses and drives orders as the standard says."""

from __future__ import annotations

import math

import pytest
from shapely.geometry import LineString, Point

from vda5050.protocol.state import ConnectionState
from vda5050.protocol.topics import Topic
from vda5050.protocol.versions import Version
from vda5050.simulated.testing import action, node, order

TYPES = {
    "malformed": ("VALIDATION_FAILURE", "validationError"),
    "outdated": ("OUTDATED_ORDER_UPDATE", "orderUpdateError"),
    "no continuation": ("NO_ROUTE_TO_TARGET", "orderUpdateError"),
    "after cancel": ("ORDER_UPDATE_FOLLOWING_CANCEL", "orderUpdateError"),
    "other order": ("OTHER_ORDER_ACTIVE", "orderError"),
    "start": ("START_NODE_OUT_OF_RANGE", "noRouteError"),
    "map": ("UNKNOWN_MAP_ID", "orderError"),
    "action": ("INVALID_ORDER_ACTION", "orderError"),
}


def error_type(rig, what):
    return TYPES[what][0 if rig.version is Version.V3_0 else 1]


def test_an_agv_that_finds_its_broker_tells_that_it_is_online_what_it_is_and_how_it_is(
    each_version,
):
    rig = each_version
    [connection] = rig.all(Topic.CONNECTION)

    assert connection.connection_state is ConnectionState.ONLINE
    assert rig.all(Topic.FACTSHEET)[0].type_specification.maximum_load_mass == 100.0
    assert rig.state.order_id == ""
    assert rig.state.power_supply.state_of_charge == pytest.approx(100.0, abs=0.1)
    assert (Topic.CONNECTION, True) in [(topic, kept) for topic, _, kept in rig.heard]


def test_it_drives_over_the_nodes_of_an_order_and_reports_each(each_version):
    rig = each_version
    rig.send(order([node(0, 2, 2), node(1, 5, 2), node(2, 5, 6, theta=math.pi / 2)]))
    rig.run_until(lambda: rig.state.driving)
    rig.run_until(lambda: rig.is_idle)

    reached = [state.last_node_id for state in rig.all(Topic.STATE)]
    assert [each for i, each in enumerate(reached) if i == 0 or each != reached[i - 1]] == [
        "",
        "n0",
        "n1",
        "n2",
    ]
    assert math.dist(rig.pose[:2], (5, 6)) < 0.1
    assert rig.pose.yaw == pytest.approx(math.pi / 2, abs=0.06)
    assert rig.simulation.collisions == 0


def test_it_leaves_no_edge_by_more_than_a_hand(rig):
    corners = [(2, 2), (7, 2), (7, 7), (3, 5)]
    rig.send(order([node(i, x, y) for i, (x, y) in enumerate(corners)]))
    way = LineString(corners)
    beside = []

    def note():
        beside.append(way.distance(Point(rig.pose[:2])))
        return rig.is_idle and rig.state.last_node_id == "n3"

    rig.run_until(note)
    assert max(beside) < 0.12


def test_it_passes_nodes_of_a_straight_way_without_stopping(rig):
    rig.send(order([node(0, 2, 2), *(node(i, 2 + i, 2) for i in range(1, 6))]))
    rig.run_until(lambda: rig.state.last_node_id == "n1")
    speeds = []

    def note():
        speeds.append(rig.speed)
        return rig.state.last_node_id == "n4"

    rig.run_until(note)
    assert min(speeds) > 0.7


def test_it_keeps_to_the_speed_of_an_edge(rig):
    rig.send(order([node(0, 2, 2), node(1, 7, 2)], speed=0.4))
    rig.run(5.0)

    assert rig.speed == pytest.approx(0.4)


def test_it_stops_at_the_end_of_its_base_and_asks_for_more_before(rig):
    way = [node(0, 2, 2), node(1, 5, 2), node(2, 8, 2, released=False)]
    rig.send(order(way))
    rig.run_until(lambda: rig.state.new_base_request)
    assert rig.pose.x < 5

    rig.run(10.0)
    assert rig.pose.x == pytest.approx(5.0, abs=0.1)
    assert [each.node_id for each in rig.state.node_states] == ["n2"]


def test_an_update_extends_the_base_without_a_stop(rig):
    rig.send(order([node(0, 2, 2), node(1, 6, 2), node(2, 8, 2, released=False)]))
    rig.run_until(lambda: rig.state.new_base_request)
    rig.send(order([node(1, 6, 2), node(2, 8, 2)], update=1))
    speeds = []

    def note():
        speeds.append(rig.speed)
        return rig.pose.x > 6.5

    rig.run_until(note)
    assert min(speeds) > 0.8
    assert rig.state.order_update_id == 1
    rig.run_until(lambda: rig.is_idle)
    assert rig.pose.x == pytest.approx(8.0, abs=0.1)


def test_an_update_may_change_the_horizon_and_its_actions(rig):
    aside = [action("wait", "w1", duration=1)]
    way = [node(0, 2, 2), node(1, 4, 2), node(2, 7, 2, released=False, actions=aside)]
    rig.send(order(way))
    rig.run(0.5)
    assert rig.status("w1") == "WAITING"

    rig.send(order([node(1, 4, 2), node(2, 4, 5, name="other")], update=1))
    rig.run_until(lambda: rig.is_idle)
    assert rig.status("w1") is None
    assert rig.state.last_node_id == "other"


def test_the_same_order_again_changes_nothing(each_version):
    rig = each_version
    given = order([node(0, 2, 2), node(1, 4, 2)])
    rig.send(given)
    rig.run_until(lambda: rig.is_idle and rig.state.last_node_id == "n1")
    rig.send(given)
    rig.run(1.0)

    assert rig.errors == []
    assert rig.state.node_states == ()


@pytest.mark.parametrize(
    ("what", "given"),
    [
        ("malformed", order([node(0, 2, 2), node(2, 4, 2)])),
        ("malformed", order([node(0, 2, 2, released=False)])),
        ("malformed", order([node(0, 2, 2), node(1, 3, 2, released=False), node(2, 4, 2)])),
        ("start", order([node(0, 6, 6), node(1, 4, 2)])),
        ("action", order([node(0, 2, 2, actions=[action("dance")])])),
        ("action", order([node(0, 2, 2, actions=[action("pick", weight=1000)])])),
    ],
)
def test_an_impossible_order_is_refused_with_a_typed_error_that_names_it(
    each_version, what, given
):
    rig = each_version
    rig.send(given)
    rig.run(0.5)

    [error] = rig.state.errors
    assert error.error_type == error_type(rig, what)
    assert (error.about("orderId"), error.about("topic")) == ("o1", "order")
    assert rig.state.order_id == ""
    assert rig.pose == (2.0, 2.0, 0.0)


def test_bytes_that_are_no_order_are_refused(each_version):
    rig = each_version
    rig.send_bytes(Topic.ORDER, b'{"orderId": 7}')
    rig.run(0.5)

    assert rig.errors == [error_type(rig, "malformed")]


def test_an_order_on_an_unknown_map_is_refused(each_version):
    rig = each_version
    rig.send(order([node(0, 2, 2), node(1, 4, 2, map_id="attic")]))
    rig.run(0.5)

    assert rig.errors == [error_type(rig, "map")]


def test_another_order_has_to_wait_until_the_first_is_done(each_version):
    rig = each_version
    rig.send(order([node(0, 2, 2), node(1, 5, 2)]))
    rig.run(1.0)
    rig.send(order([node(0, 2, 2), node(1, 2, 5)], order_id="o2"))
    rig.run(0.5)
    assert rig.errors == [error_type(rig, "other order")]
    assert rig.state.order_id == "o1"

    rig.run_until(lambda: rig.is_idle)
    rig.send(order([node(0, 5, 2), node(1, 5, 5)], order_id="o3"))
    rig.run(0.5)
    assert rig.errors == []
    assert rig.state.order_id == "o3"


def test_an_old_update_and_one_from_elsewhere_are_refused(each_version):
    rig = each_version
    rig.send(order([node(0, 2, 2), node(1, 4, 2)]))
    rig.send(order([node(1, 4, 2), node(2, 6, 2)], update=2))
    rig.send(order([node(1, 4, 2), node(2, 4, 6)], update=1))
    rig.run(0.3)
    assert rig.errors == [error_type(rig, "outdated")]

    rig.send(order([node(1, 4, 2), node(2, 4, 6)], update=3))
    rig.run(0.3)
    assert rig.errors == [error_type(rig, "no continuation")]
    assert rig.state.order_update_id == 2


def test_cut_off_it_drives_on_to_the_end_of_its_base(rig):
    rig.send(order([node(0, 2, 2), node(1, 6, 2), node(2, 8, 2, released=False)]))
    rig.run(1.0)
    rig.agv.mischief.do("mute on")
    rig.agv.mischief.do("deaf on")
    rig.run(15.0)

    assert rig.pose.x == pytest.approx(6.0, abs=0.1)
