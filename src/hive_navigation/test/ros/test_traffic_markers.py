# SPDX-License-Identifier: BSD-3-Clause
"""RViz shows lanes on which robots fit, reservations, who waits for whom, and zones."""

from __future__ import annotations

import numpy as np
import pytest

pytest.importorskip("robot_description.msg", reason="markers need ROS")

from std_msgs.msg import Header
from visualization_msgs.msg import Marker

from hive_common.zone import Zone
from hive_navigation.mapf.roadmap import assembled
from hive_navigation.mapf.route import PlanNumber, Route
from hive_navigation.ros.traffic_markers import SHUT, WAITS, lanes_marker, traffic_markers
from hive_navigation.ros.traffic_report import Waiting
from hive_navigation.traffic.right_of_way import Announcement, no_right

PLAN = PlanNumber(3, 1)
SQUARE = ((0.0, 0.0), (1.0, 0.0), (1.0, 1.0))


def robot(name, x, plan=PLAN):
    here = (x, 0.0)
    return Announcement(
        name,
        0.0,
        *here,
        0.4,
        no_right(name),
        (here,),
        0.0,
        stationary=False,
        plan=plan,
        passed=1400,
    )


def shown(robots=(), waits=(), zones=(), routes=None):
    found = traffic_markers(
        routes or {}, {each.name: each for each in robots}, waits, zones, Header()
    )
    assert found.markers[0].action == Marker.DELETEALL
    return found.markers[1:]


def corners(marker):
    return [(point.x, point.y) for point in marker.points]


def test_only_lanes_on_which_a_robot_fits_are_drawn_and_each_once():
    places = np.array([(0.0, 0.0), (1.0, 0.0), (2.0, 0.0)])
    roadmap = assembled(places, np.ones(3), np.array([(0, 1), (1, 2)]), np.array([1.0, 0.3]), 1.0)

    assert corners(lanes_marker(roadmap, 0.4, Header())) == [(0.0, 0.0), (1.0, 0.0)]


def test_a_route_is_reserved_from_where_the_robot_is_on():
    places = tuple((float(x), 0.0) for x in range(4))
    route = Route("robot1", PLAN, None, 0, places, (), complete=True)
    (marker,) = shown([robot("robot1", 1.4)], routes={"robot1": route})

    assert corners(marker) == [(1.4, 0.0), (2.0, 0.0), (3.0, 0.0)]
    assert marker.scale.x == pytest.approx(0.8)


def test_of_a_robot_that_follows_another_planner_nothing_is_reserved():
    route = Route("robot1", PLAN, None, 0, SQUARE, (), complete=True)

    assert shown([robot("robot1", 0.0, PlanNumber(2, 9))], routes={"robot1": route}) == []


def test_a_red_arrow_leads_from_who_waits_to_whom_it_waits_for():
    waits = [Waiting("robot1", "robot2", 1.0, 0.0, 0.0), Waiting("robot1", "gone", 1.0, 0.0, 0.0)]
    (arrow,) = shown([robot("robot2", 5.0)], waits)

    assert (arrow.type, arrow.color) == (Marker.ARROW, WAITS)
    assert corners(arrow) == [(1.0, 0.0), (5.0, 0.0)]


def test_zones_are_outlined_and_closed_ones_are_red():
    zones = [
        Zone(name=name, kind="keep-out", corners=SQUARE, closed=closed)
        for name, closed in (("door", False), ("hall", True))
    ]
    door, hall = shown(zones=zones)

    assert corners(door) == [*SQUARE, SQUARE[0]]
    assert hall.color == SHUT != door.color
