# SPDX-License-Identifier: BSD-3-Clause
"""How what the traffic planner tells becomes what bids reckon with."""

import math

import pytest

pytest.importorskip("robot_description.msg")

import rospy
from geometry_msgs.msg import Point32
from robot_description.msg import SlowPlace, TrafficState

from blackboard.costing.traffic_conditions import DELAYS_PERIOD
from blackboard.costing.traffic_conditions import SlowPlace as Slow
from blackboard.ros.traffic_told import TrafficTold

DOOR = {"name": "door", "kind": "at-most", "robots": 1, "corners": [[0, 0], [1, 0], [1, 1]]}


class Wire:
    """Stands for ROS: the parameter, the topic, the clock; and what was passed on."""

    def __init__(self, monkeypatch, zones):
        self.now = 100.0
        self.used = []
        monkeypatch.setattr(rospy, "get_param", lambda _name, _default: zones)
        monkeypatch.setattr(rospy, "Subscriber", self.subscribe)
        self.told = TrafficTold("/", lambda: self.now, self.used.append)

    def subscribe(self, topic, _message, callback, **_):
        assert topic == "/traffic_state"
        self.say = lambda **fields: callback(TrafficState(**fields))


@pytest.fixture
def wire(monkeypatch):
    return Wire(monkeypatch, [DOOR])


def slow(delay):
    return [SlowPlace(place=Point32(2.04, 3.0, 0.0), delay=delay)]


def test_zones_are_known_from_the_start_and_close_at_once(wire):
    assert [zone.closed for zone in wire.told.conditions.zones] == [False]

    wire.say(epoch=1000, closed=["door"])
    wire.now += 1.0
    wire.say(epoch=1000, closed=[])

    assert [[zone.closed for zone in each.zones] for each in wire.used] == [[True], [False]]


def test_what_stays_as_it_is_is_not_passed_on(wire):
    wire.say(epoch=1000, closed=[])
    wire.now += DELAYS_PERIOD
    wire.say(epoch=1000, closed=[])

    assert wire.used == []


def test_delays_count_in_steps_at_the_middle_of_their_square_and_now_and_then_only(wire):
    wire.say(epoch=1000, slowest=slow(4.4))
    wire.now += DELAYS_PERIOD / 2
    wire.say(epoch=1000, slowest=slow(9.0))
    wire.now += DELAYS_PERIOD / 2
    wire.say(epoch=1000, slowest=slow(1.4))

    assert [each.slow for each in wire.used] == [(Slow(3.0, 3.0, 3.0),), ()]


@pytest.mark.parametrize(
    ("x", "delay"), [(math.nan, 9.0), (math.inf, 9.0), (1e30, 9.0), (2.0, math.inf), (2.0, 1e30)]
)
def test_a_slow_place_with_which_one_cannot_calculate_is_left_out(wire, x, delay):
    odd = SlowPlace(place=Point32(x, 3.0, 0.0), delay=delay)
    wire.say(epoch=1000, slowest=[odd, *slow(9.0)])

    assert [each.slow for each in wire.used] == [(Slow(3.0, 3.0, 9.0),)]


def test_a_planner_that_was_replaced_is_not_heard_any_more(wire):
    wire.say(epoch=2001, closed=["door"])
    wire.say(epoch=1001, closed=[])

    assert [zone.closed for zone in wire.told.conditions.zones] == [True]


def test_zones_that_are_not_allowed_count_for_nothing(monkeypatch):
    assert Wire(monkeypatch, [{"name": "door"}]).told.conditions.zones == ()
