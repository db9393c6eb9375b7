# SPDX-License-Identifier: BSD-3-Clause
"""Who goes first, and how far the other may go."""

import math

import pytest

from robot_description.right_of_way import Announcement, Right, meetings, no_right

RADIUS = 0.4


def says(name, way, *, since=math.inf, claim=0.0, parked=False):
    right = no_right(name) if math.isinf(since) else Right(since, name, 0, name)
    x, y = way[0]
    return Announcement(name, 0.0, x, y, RADIUS, right, tuple(way), claim, parked)


def test_the_older_goal_goes_first_and_names_break_ties():
    older, younger = Right(1.0, "robot2", 0, "robot2"), Right(2.0, "robot1", 0, "robot1")

    assert older < younger < no_right("robot1")
    assert Right(1.0, "robot1", 0, "robot1") < older


def test_who_moves_aside_for_a_robot_comes_right_behind_it():
    first = Right(1.0, "robot1", 0, "robot1")

    assert first.before("robot3") < first < first.behind("robot2")
    assert first.behind("robot2") < Right(1.1, "robot4", 0, "robot4")


def test_a_robot_stops_before_what_another_claims_whoever_goes_first():
    me = says("robot1", [(0.0, 0.0), (6.0, 0.0)], since=1.0)
    other = says("robot2", [(3.0, 0.0)])
    (met,) = meetings(me, [other])

    assert met.room == pytest.approx(3.0 - 2 * RADIUS - 0.1, abs=0.25)
    assert met.room < 3.0 - 2 * RADIUS


def test_a_younger_robot_waits_before_the_way_of_an_older_one():
    me = says("robot1", [(0.0, 0.0), (6.0, 0.0)], since=2.0)
    crossing = says("robot2", [(4.0, -3.0), (4.0, 3.0)], since=1.0)
    (met,) = meetings(me, [crossing])

    assert met.room < 4.0 - 2 * RADIUS


def test_an_older_robot_does_not_wait_for_the_way_of_a_younger_one():
    me = says("robot1", [(0.0, 0.0), (6.0, 0.0)], since=1.0)
    crossing = says("robot2", [(4.0, -3.0), (4.0, 3.0)], since=2.0)
    (met,) = meetings(me, [crossing])

    assert math.isinf(met.room)


def test_who_stands_on_the_way_of_one_that_goes_first_is_told_so():
    me = says("robot1", [(3.0, 0.0)])
    comes = says("robot2", [(0.0, 0.0), (6.0, 0.0)], since=1.0)
    (met,) = meetings(me, [comes])

    assert met.on_its_way


def test_who_stands_beside_the_way_is_on_nobody_s_way():
    me = says("robot1", [(3.0, 2.0)])
    comes = says("robot2", [(0.0, 0.0), (6.0, 0.0)], since=1.0)
    (met,) = meetings(me, [comes])

    assert not met.on_its_way
