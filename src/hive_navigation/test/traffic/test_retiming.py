# SPDX-License-Identifier: BSD-3-Clause
"""A plan's times follow what has happened; its order stays."""

import math
from dataclasses import replace

import pytest

from hive_navigation.mapf.path_search import Motion
from hive_navigation.mapf.route import PlanNumber, Wait, marks
from hive_navigation.traffic.committed import Drive
from hive_navigation.traffic.retiming import STAYS, Course, retime

MOTION = Motion(0.4, 1.0, 1.0, math.pi)
EAST = [(0.0, 0.0), (1.0, 0.0), (2.0, 0.0)]
NORTH = [(1.0, -1.0), (1.0, 0.0), (1.0, 1.0)]


def course(points, ready=0.0, heading=0.0, begin=0.0, waits=()):
    """Return a course that was planned to begin at some time [s], at 1 m/s."""
    arrives = tuple(begin + k for k in range(len(points)))
    drive = Drive(
        PlanNumber(1, 1),
        0.0,
        marks(0, points),
        tuple(points),
        tuple(range(len(points))),
        arrives,
        (*arrives[:-1], math.inf),
        complete=True,
        goal=points[-1],
        waits=tuple(waits),
    )
    return Course(drive, ready, heading, MOTION)


def test_a_robot_that_is_late_gets_everywhere_later():
    times = retime({"a": course(EAST, ready=2.5)}, {})

    assert times["a"].arrives == pytest.approx((2.5, 3.5, 4.5))
    assert times["a"].leaves == pytest.approx((2.5, 3.5, math.inf))


def test_it_does_not_wait_any_more_when_nobody_is_before_it():
    waited = course(EAST)
    rest = replace(waited.rest, arrives=(0.0, 9.0, 10.0), leaves=(8.0, 9.0, math.inf))

    assert retime({"a": waited._replace(rest=rest)}, {})["a"].arrives[-1] == pytest.approx(2.0)


def test_a_robot_turns_before_it_drives():
    times = retime({"a": course(NORTH, heading=0.0)}, {})

    # A quarter turn takes half a second, and stopping for it v/a.
    assert times["a"].leaves[0] == pytest.approx(1.5)


def test_one_late_robot_delays_those_that_it_goes_before():
    second = course(NORTH, heading=math.pi / 2, begin=3.0, waits=[Wait(0, "a", 2000)])
    times = retime({"a": course(EAST, ready=5.0), "b": second}, {})

    assert times["b"].leaves[0] == pytest.approx(7.0)


def test_a_robot_waits_until_one_at_its_goal_has_had_time_to_leave():
    second = course(NORTH, heading=math.pi / 2, begin=9.0, waits=[Wait(0, "a", 3000)])
    times = retime({"a": course(EAST), "b": second}, {})

    assert times["b"].leaves[0] == pytest.approx(2.0 + STAYS)


def test_it_waits_for_others_as_long_as_they_take_to_make_way_and_not_for_strangers():
    waits = [Wait(0, "other", 1000), Wait(0, "stranger", 1000)]
    times = retime({"b": course(EAST, waits=waits)}, {"other": 4.0})

    assert times["b"].leaves[0] == pytest.approx(4.0)


def test_a_course_that_is_cut_between_two_points_goes_straight_on():
    drive = course(EAST).rest
    left = drive.cut(1500)

    assert left.points == ((1.5, 0.0), (2.0, 0.0))
    assert left.marks == (1500, 2000)
    assert left.arrives == pytest.approx((1.5, 2.0))
    assert drive.cut(1000).points == drive.points[1:]
    assert drive.cut(9000).points == drive.points[2:]
    assert drive.after(1500).marks == (1000, 2000)
