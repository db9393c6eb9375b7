# SPDX-License-Identifier: BSD-3-Clause
"""A simulated AGV has the faults that it is asked for."""

import pytest

from vda5050.errors import FaultError
from vda5050.protocol.state import EmergencyStop, OperatingMode
from vda5050.protocol.topics import Topic
from vda5050.simulated.testing import action, node, order

FAR = [node(0, 2, 2), node(1, 8, 2, actions=[action("pick", "p1")])]


@pytest.mark.parametrize("mode", ["MANUAL", "SERVICE", "TEACH_IN"])
def test_in_the_hands_of_a_person_it_drops_its_order_and_takes_none(each_version, mode):
    rig = each_version
    rig.send(order(FAR))
    rig.run(2.0)
    rig.agv.mischief.do(f"mode {mode}")
    rig.run(3.0)
    assert rig.state.operating_mode is OperatingMode[mode]
    assert rig.state.node_states == ()
    assert rig.status("p1") == "FAILED"
    assert not rig.state.driving
    assert (rig.state.last_node_id == "n0") is (mode == "MANUAL")

    x, y = rig.pose[:2]
    rig.send(order([node(0, x, y), node(1, 2, 2)], order_id="o2"))
    rig.run(1.0)
    assert len(rig.errors) == 1
    rig.agv.mischief.do("mode AUTOMATIC")
    rig.send(order([node(0, x, y), node(1, 2, 2)], order_id="o3"))
    rig.run_until(lambda: rig.state.last_node_id == "n1")
    assert rig.errors == []


def test_intervened_it_keeps_its_order_and_goes_on_later(rig):
    rig.send(order(FAR))
    rig.run(2.0)
    rig.agv.mischief.do("mode INTERVENED")
    rig.run(5.0)
    assert rig.speed == 0
    assert rig.state.order_id == "o1"
    rig.agv.mischief.do("mode AUTOMATIC")
    rig.run_until(lambda: rig.status("p1") == "FINISHED")


@pytest.mark.parametrize(("level", "goes_on"), [("WARNING", True), ("FATAL", False)])
def test_only_a_fatal_error_stops_it(rig, level, goes_on):
    rig.send(order(FAR))
    rig.run(1.0)
    rig.agv.mischief.do(f"error batteryHot {level}")
    rig.run(15.0)
    assert rig.errors == ["batteryHot"]
    assert (rig.state.last_node_id == "n1") is goes_on

    rig.agv.mischief.do("clear batteryHot")
    rig.run_until(lambda: rig.is_idle)
    assert rig.errors == []


def test_stuck_it_says_which_node_it_cannot_reach(rig):
    rig.send(order(FAR))
    rig.run(1.0)
    rig.agv.mischief.do("stuck on")
    rig.run(3.0)
    assert rig.errors == ["nodeUnreachable"]
    assert rig.state.errors[0].about("nodeId") == "n1"
    assert rig.speed == 0

    rig.agv.mischief.do("stuck off")
    rig.run_until(lambda: rig.is_idle)
    assert rig.errors == []


def test_an_emergency_stop_holds_it_until_it_is_released(rig):
    rig.send(order(FAR))
    rig.run(1.0)
    rig.agv.mischief.do("stop MANUAL")
    rig.run(5.0)
    assert rig.state.safety_state.active_emergency_stop is EmergencyStop.MANUAL
    assert rig.speed == 0
    rig.agv.mischief.do("stop NONE")
    rig.run_until(lambda: rig.is_idle)


def test_late_messages_come_late_and_in_their_order(rig):
    rig.agv.mischief.do("delay 2")
    rig.send(order(FAR))
    rig.run(1.0)
    assert rig.state.order_id == ""
    rig.run(1.5)
    assert rig.state.order_id == "o1"
    rig.agv.mischief.do("delay 0")
    rig.run(5.0)
    distances = [s.mobile_robot_position.x for s in rig.all(Topic.STATE)]
    assert distances == sorted(distances)


def test_a_liar_tells_of_an_order_that_nobody_gave(rig):
    rig.agv.mischief.do("lie on")
    rig.send(order(FAR))
    rig.run(1.0)
    assert rig.state.order_id == "nobodys-order"


@pytest.mark.parametrize("line", ["", "explode", "mode", "mode HAPPY", "battery 2", "mute maybe"])
def test_a_fault_that_is_none_is_refused_with_an_example(rig, line):
    with pytest.raises(FaultError, match=r"allowed: .*`"):
        rig.agv.mischief.do(line)
