# SPDX-License-Identifier: BSD-3-Clause
"""What robots and the traffic planner tell each other, as messages."""

import io
import math
from dataclasses import replace

import pytest

pytest.importorskip("robot_description.msg", reason="conversions need generated messages")

import rospy
from geometry_msgs.msg import Point32
from robot_description.msg import Routes, Traffic

from hive_navigation.mapf.route import NO_PLAN, PlanNumber, Route, Wait
from hive_navigation.ros.conversions import (
    AHEAD,
    routes_from_msg,
    routes_to_msg,
    traffic_from_msg,
    traffic_to_msg,
)
from hive_navigation.traffic.right_of_way import (
    UNKNOWN_LIMITS,
    Announcement,
    Limits,
    Right,
    no_right,
)

STANDS = Announcement(
    name="robot1",
    time=12.5,
    x=1.0,
    y=2.0,
    radius=0.5,
    right=no_right("robot1"),
    path=((1.0, 2.0),),
    claim=0.0,
    stationary=False,
)
DRIVES = replace(
    STANDS,
    right=Right(3.0, "robot2", 1, "robot1"),
    path=((1.0, 2.0), (4.0, 2.5)),
    claim=0.75,
    yaw=-1.5,
    goal=(4.1, 2.3),
    limits=Limits(1.5, 0.5, 2.0),
    plan=PlanNumber(4, 17),
    passed=9,
    waits_for="robot3",
    obstacles=((2.0, 2.5, 0.25),),
)
ROUTE = Route(
    robot="robot1",
    plan=PlanNumber(4, 17),
    goal=(4.1, 2.3),
    first=9,
    places=((1.0, 2.0), (4.0, 2.5)),
    waits=(Wait(10, "robot3", 5), Wait(10, "robot4", 0)),
    complete=True,
)


NOW = 1e6  # when everything comes [s]


def sent(message):
    """Return a message as it arrives."""
    data = io.BytesIO()
    message.serialize(data)
    return type(message)().deserialize(data.getvalue())


def told(**changed):
    """Return the message of a robot that drives, with some fields changed."""
    message = traffic_to_msg(DRIVES, "map")
    for name, value in changed.items():
        setattr(message, name, value)
    return message


@pytest.mark.parametrize("announcement", [STANDS, DRIVES], ids=["stands", "drives"])
def test_an_announcement_arrives_as_it_was_sent(announcement):
    assert traffic_from_msg(sent(traffic_to_msg(announcement, "map")), NOW) == announcement


def test_a_program_that_knows_only_the_first_fields_is_a_robot_without_goal_and_route():
    message = Traffic(name="forklift", radius=0.8, parked=True)
    message.way = told().way
    heard = traffic_from_msg(sent(message), NOW)

    assert (heard.goal, heard.plan, heard.waits_for) == (None, NO_PLAN, "")
    assert heard.limits == UNKNOWN_LIMITS


@pytest.mark.parametrize(
    ("changed", "named"),
    [
        ({"way": []}, "a way"),
        ({"radius": 0.0}, "a radius above 0"),
        ({"claim": -0.1}, "a claim from 0"),
        ({"radius": 11.0}, "a radius above 0 and at most 10 m"),
        ({"claim": 1e9}, "a claim from 0 to 10000 m"),
        ({"way": [Point32(0.0, 0.0, 0.0), Point32(2e5, 0.0, 0.0)]}, "within 100 km"),
        ({"way": [Point32(0.0, 0.0, 0.0), Point32(2e4, 0.0, 0.0)]}, "at most 10 km long"),
        ({"yaw": math.nan}, "yaw"),
        ({"max_speed": -1.0}, "max_speed"),
        ({"yaw_rate": math.inf}, "yaw_rate"),
        ({"acceleration": 0.0}, "acceleration"),
    ],
)
def test_traffic_with_wrong_numbers_is_refused_in_one_line_that_names_robot_and_field(
    changed, named
):
    with pytest.raises(ValueError, match=named) as error:
        traffic_from_msg(sent(told(**changed)), NOW)

    assert "'robot1'" in str(error.value)
    assert "\n" not in str(error.value)


def test_a_goal_that_is_not_finite_is_refused():
    message = told()
    message.goal.x = math.nan

    with pytest.raises(ValueError, match="goal"):
        traffic_from_msg(sent(message), NOW)


def test_an_obstacle_that_is_not_finite_is_refused():
    message = told()
    message.obstacles[0].z = math.inf

    with pytest.raises(ValueError, match="obstacles"):
        traffic_from_msg(sent(message), NOW)


def test_routes_of_an_epoch_that_no_planner_has_are_refused():
    message = routes_to_msg(PlanNumber(2**31, 1), [ROUTE], 12.5, "map")

    with pytest.raises(ValueError, match="epoch is above 2147483647"):
        routes_from_msg(sent(message))


def test_what_is_dated_ahead_counts_as_of_now():
    message = told()
    message.header.stamp = rospy.Time(4_000_000)

    assert traffic_from_msg(sent(message), NOW).time == NOW + AHEAD


def test_routes_arrive_as_they_were_sent():
    plan, routes = routes_from_msg(sent(routes_to_msg(ROUTE.plan, [ROUTE], 12.5, "map")))

    assert plan == ROUTE.plan
    assert routes == (ROUTE,)


def test_the_route_of_a_robot_without_a_goal_has_none():
    aside = replace(ROUTE, goal=None)
    _, routes = routes_from_msg(sent(routes_to_msg(ROUTE.plan, [aside], 12.5, "map")))

    assert routes == (aside,)


def test_a_plan_for_nobody_arrives_without_routes():
    assert routes_from_msg(sent(Routes(epoch=4, number=17))) == (PlanNumber(4, 17), ())


def test_a_route_without_places_arrives_as_one():
    alone = replace(ROUTE, places=(), waits=())

    assert routes_from_msg(routes_to_msg(ROUTE.plan, [alone], 12.5, "map"))[1][0].places == ()


@pytest.mark.parametrize("places", [((math.nan, 2.0),), ((1.0, math.inf),)])
def test_a_route_without_usable_places_is_refused_with_plan_and_robot(places):
    message = routes_to_msg(ROUTE.plan, [replace(ROUTE, places=places)], 12.5, "map")

    with pytest.raises(ValueError, match=r"plan 4/17 .* 'robot1'"):
        routes_from_msg(sent(message))


def test_a_route_whose_goal_is_not_finite_is_refused():
    message = routes_to_msg(ROUTE.plan, [replace(ROUTE, goal=(math.inf, 0.0))], 12.5, "map")

    with pytest.raises(ValueError, match="goal"):
        routes_from_msg(sent(message))
