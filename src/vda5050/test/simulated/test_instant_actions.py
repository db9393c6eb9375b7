# SPDX-License-Identifier: BSD-3-Clause
"""A simulated AGV does instant actions at once, and once only."""

import math

import pytest

from vda5050.protocol.state import ConnectionState
from vda5050.protocol.topics import Topic
from vda5050.protocol.versions import Version
from vda5050.simulated.testing import Rig, action, node, order

FAR = [node(0, 2, 2), node(1, 8, 2)]


def test_cancel_order_stops_it_where_it_is_and_fails_what_was_waiting(each_version):
    rig = each_version
    rig.send(order([node(0, 2, 2), node(1, 8, 2, actions=[action("pick", "p1")])]))
    rig.run_until(lambda: rig.pose.x > 3)
    rig.instantly("cancelOrder", "c1")
    rig.run(0.3)
    assert rig.status("c1") == "RUNNING"
    rig.run_until(lambda: rig.status("c1") == "FINISHED")

    assert not rig.state.driving
    assert rig.pose.x < 6
    assert (rig.state.node_states, rig.state.edge_states) == ((), ())
    assert rig.status("p1") == "FAILED"
    assert rig.state.order_id == "o1"


def test_after_a_cancellation_it_takes_a_new_order_but_no_update(each_version):
    rig = each_version
    rig.send(order(FAR))
    rig.run(1.0)
    rig.instantly("cancelOrder", "c1")
    rig.run_until(lambda: rig.status("c1") == "FINISHED")
    rig.send(order([node(1, 8, 2), node(2, 8, 5)], update=1))
    rig.run(0.3)
    after = "ORDER_UPDATE_FOLLOWING_CANCEL" if rig.version is Version.V3_0 else "orderUpdateError"
    assert rig.errors == [after]

    x, y = rig.pose[:2]
    rig.send(order([node(0, x, y), node(1, 2, 2)], order_id="o2"))
    rig.run_until(lambda: rig.is_idle and rig.state.last_node_id == "n1")
    assert math.dist(rig.pose[:2], (2, 2)) < 0.1


def test_without_an_order_there_is_none_to_cancel(each_version):
    rig = each_version
    rig.instantly("cancelOrder", "c1")
    rig.run(0.3)

    since_3 = rig.version is Version.V3_0
    assert rig.status("c1") == "FAILED"
    assert rig.errors == ["NO_ORDER_TO_CANCEL" if since_3 else "noOrderToCancel"]
    assert rig.state.errors[0].about("actionId") == "c1"


def test_cancel_order_may_name_the_order(rig):
    rig.send(order(FAR))
    rig.instantly("cancelOrder", "c1", orderId="another")
    rig.run(1.0)
    assert rig.status("c1") == "FAILED"
    assert rig.state.driving


def test_a_pause_holds_drive_and_actions_until_it_ends(each_version):
    rig = each_version
    rig.send(order([*FAR[:1], node(1, 5, 2, actions=[action("wait", "w1", duration=3.0)])]))
    rig.run_until(lambda: rig.pose.x > 3)
    rig.instantly("startPause", "i1")
    rig.run_until(lambda: rig.status("i1") == "FINISHED")
    assert rig.state.paused
    here = rig.pose
    rig.run(5.0)
    assert rig.pose == here

    rig.instantly("stopPause", "i2")
    rig.run_until(lambda: rig.status("w1") == "RUNNING")
    rig.instantly("startPause", "i3")
    rig.run(10.0)
    assert rig.status("w1") == "PAUSED"
    rig.instantly("stopPause", "i4")
    rig.run_until(lambda: rig.is_idle)
    assert not rig.state.paused


def test_who_asks_gets_the_state_and_the_factsheet(each_version):
    rig = each_version
    states, sheets = len(rig.all(Topic.STATE)), len(rig.all(Topic.FACTSHEET))
    rig.instantly("stateRequest", "i1")
    rig.run(0.1)
    assert len(rig.all(Topic.STATE)) == states + 1

    rig.instantly("factsheetRequest", "i2")
    rig.run(0.1)
    assert len(rig.all(Topic.FACTSHEET)) == sheets + 1


def test_it_charges_while_it_stands(each_version):
    rig = each_version
    rig.agv.mischief.do("battery 0.5")
    rig.instantly("startCharging", "i1")
    rig.run(30.0)
    assert rig.state.power_supply.charging
    assert rig.state.power_supply.state_of_charge > 50.1

    rig.instantly("stopCharging", "i2")
    rig.run(1.0)
    full = rig.state.power_supply.state_of_charge
    rig.run(30.0)
    assert not rig.state.power_supply.charging
    assert rig.state.power_supply.state_of_charge < full


def test_a_position_is_set_only_near_the_true_one(rig):
    rig.instantly("initPosition", "i1", x=2.1, y=2.0, theta=0.0, mapId="hall", lastNodeId="n7")
    rig.instantly("initPosition", "i2", x=7.0, y=7.0, theta=0.0, mapId="hall", lastNodeId="n8")
    rig.run(0.3)

    assert (rig.status("i1"), rig.status("i2")) == ("FINISHED", "FAILED")
    assert rig.state.last_node_id == "n7"


@pytest.mark.parametrize(
    ("kind", "parameters"),
    [("dance", {}), ("pick", {}), ("initPosition", {"x": "two"}), ("retry", {"actionId": "a"})],
)
def test_what_it_cannot_do_is_refused_with_the_actions_id(each_version, kind, parameters):
    rig = each_version
    rig.instantly(kind, "i1", **parameters)
    rig.run(0.3)

    since_3 = rig.version is Version.V3_0
    assert rig.status("i1") == "FAILED"
    assert rig.errors == ["INVALID_INSTANT_ACTION" if since_3 else "instantActionError"]
    assert rig.state.errors[0].about("actionId") == "i1"


def test_an_instant_action_that_comes_twice_is_done_once(rig):
    rig.send(order(FAR))
    rig.run(1.0)
    rig.instantly("cancelOrder", "c1")
    rig.run_until(lambda: rig.status("c1") == "FINISHED")
    rig.instantly("cancelOrder", "c1")
    rig.run(0.3)

    assert rig.status("c1") == "FINISHED"
    assert rig.errors == []


def test_a_hibernating_agv_tells_only_that_it_hibernates():
    rig = Rig(Version.V3_0)
    rig.instantly("startHibernation", "i1")
    rig.run(0.5)
    assert rig.status("i1") == "FINISHED"
    assert rig.all(Topic.CONNECTION)[-1].connection_state is ConnectionState.HIBERNATING

    states = len(rig.all(Topic.STATE))
    rig.send(order(FAR))
    rig.run(5.0)
    assert len(rig.all(Topic.STATE)) == states
    rig.instantly("stopHibernation", "i2")
    rig.run(0.5)
    assert rig.all(Topic.CONNECTION)[-1].connection_state is ConnectionState.ONLINE
    assert rig.state.order_id == ""
