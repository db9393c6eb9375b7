# SPDX-License-Identifier: BSD-3-Clause
"""Robots enter a zone with a limit in their planned order, and no more than it allows."""

import math

import pytest

from hive_common.zone import Zone
from hive_navigation.mapf.route import PlanNumber, marks
from hive_navigation.traffic.committed import Drive
from hive_navigation.traffic.zone_order import zone_waits

CORNERS = ((1.5, 0.0), (4.5, 0.0), (4.5, 9.0), (1.5, 9.0))


def zone(robots):
    return Zone(name="door", kind="at-most", corners=CORNERS, robots=robots)


def drive(y, begin, xs=range(7)):
    """Return a course along a row, a metre a second from some time on [s]."""
    points = [(float(x), y) for x in xs]
    arrives = tuple(begin + k for k in range(len(points)))
    leaves = (*arrives[:-1], math.inf)
    plan = PlanNumber(1, 1)
    return Drive(
        plan,
        0.0,
        marks(0, points),
        tuple(points),
        tuple(range(len(points))),
        arrives,
        leaves,
        complete=True,
        goal=points[-1],
    )


def test_who_would_be_too_many_waits_before_the_zone_until_one_has_left():
    drives = [drive(1.0, 0.0), drive(3.0, 1.0), drive(5.0, 2.0)]

    assert zone_waits(drives, [zone(1)]) == [(1, 1, 0, 4), (2, 1, 0, 4), (2, 1, 1, 4)]
    assert zone_waits(drives, [zone(2)]) == [(2, 1, 0, 4)]
    assert zone_waits(drives, [zone(3)]) == []


def test_one_that_is_inside_goes_before_all_and_waits_for_nobody():
    inside = drive(1.0, 5.0, xs=range(3, 7))

    assert zone_waits([drive(3.0, 0.0), inside], [zone(1)]) == [(0, 1, 1, 1)]


def test_one_that_stays_inside_is_waited_for_until_it_goes_on():
    stays = drive(1.0, 0.0, xs=range(4))

    assert zone_waits([stays, drive(3.0, 9.0)], [zone(1)]) == [(1, 1, 0, 3)]


@pytest.mark.parametrize("kind", ["keep-out", "no-stopping", "parking"])
def test_zones_without_a_limit_hold_nobody(kind):
    other = Zone(name="other", kind=kind, corners=CORNERS)

    assert zone_waits([drive(1.0, 0.0), drive(3.0, 0.5)], [other]) == []
