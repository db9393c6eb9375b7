# SPDX-License-Identifier: BSD-3-Clause
"""Path lengths in traffic: closed zones, one-way zones, and places where robots lose time."""

import math

import numpy as np
import pytest

from blackboard.costing.grid_path_lengths import GridPathLengths
from blackboard.costing.traffic_conditions import SlowPlace, TrafficConditions
from hive_common.grid_map import GridMap
from hive_common.pose import Pose
from hive_common.zone import AT_MOST, KEEP_OUT, ONE_WAY, SLOW, Zone

START, GOAL = Pose(2.0, 5.0), Pose(10.0, 5.0)
APART = 8.0  # [m]
RADIUS = 0.3
ACROSS = ((5.0, 3.0), (7.0, 3.0), (7.0, 7.0), (5.0, 7.0))  # in the middle between the two
UP = math.pi / 2


def hall():
    """Return an empty hall."""
    return GridMap.of_blocked(np.zeros((200, 240), dtype=bool), 0.05)


def lengths(*zones, slow=()):
    return GridPathLengths(hall(), RADIUS, TrafficConditions(zones, tuple(slow)))


def zone(kind, **figures):
    return Zone(name="middle", kind=kind, corners=ACROSS, **figures)


def around(left, low, right):
    """Return the length of the way from START to GOAL along the lower side of a box."""
    return math.dist(START[:2], (left, low)) + (right - left) + math.dist((right, low), GOAL[:2])


def test_a_zone_that_limits_no_path_changes_nothing():
    assert lengths(zone(AT_MOST, robots=1)).length_and_delay(START, GOAL) == pytest.approx(
        (APART, 0.0), abs=0.1
    )


@pytest.mark.parametrize("shut", [zone(KEEP_OUT), zone(AT_MOST, robots=1, closed=True)])
def test_a_closed_zone_is_gone_around_with_room_for_the_robot(shut):
    there = around(5.0, 3.0 - RADIUS, 7.0)

    assert lengths(shut).length(START, GOAL) == pytest.approx(there, rel=0.05)


def test_there_is_no_path_into_a_closed_zone():
    assert math.isinf(lengths(zone(KEEP_OUT)).length(START, Pose(6.0, 5.0)))


def test_a_one_way_zone_is_gone_around_on_the_way_back_only():
    found = lengths(zone(ONE_WAY, direction=0.0))

    assert found.length(START, GOAL) == pytest.approx(APART, abs=0.1)
    assert found.length(GOAL, START) == pytest.approx(around(5.0, 3.0, 7.0), rel=0.05)
    assert found.length(START, GOAL) == pytest.approx(APART, abs=0.1)


def test_a_one_way_zone_may_be_crossed():
    found = lengths(zone(ONE_WAY, direction=UP))

    assert found.length(START, GOAL) == pytest.approx(APART, abs=0.1)


def test_who_passes_a_slow_place_loses_its_delay_and_drives_no_farther():
    found = lengths(slow=[SlowPlace(6.0, 5.0, 0.3)])

    assert found.length_and_delay(START, GOAL) == pytest.approx((APART, 0.3), abs=0.1)


def test_a_very_slow_place_is_gone_around():
    length, delay = lengths(slow=[SlowPlace(6.0, 5.0, 60.0)]).length_and_delay(START, GOAL)

    assert APART + 0.1 < length < APART + 0.6
    assert delay < 0.2


def test_a_slow_zone_across_the_whole_hall_costs_time():
    corners = ((5.0, 0.0), (7.0, 0.0), (7.0, 10.0), (5.0, 10.0))
    slow = Zone(name="slow", kind=SLOW, speed=0.2, corners=corners)

    assert lengths(slow).length_and_delay(START, GOAL) == pytest.approx((APART, 8.0), abs=0.5)


def test_other_conditions_count_from_then_on():
    grid = hall()
    found = GridPathLengths(grid, RADIUS)
    before = found.length(START, GOAL)
    found.use(grid, TrafficConditions((zone(KEEP_OUT),)))
    meanwhile = found.length(START, GOAL)
    found.use(grid, TrafficConditions((zone(KEEP_OUT),), (SlowPlace(2.0, 5.0, 4.0),)))
    delayed = found.length_and_delay(START, GOAL)
    found.use(grid)

    assert before == found.length(START, GOAL) == pytest.approx(APART, abs=0.1)
    assert meanwhile > before + 0.5
    assert delayed == pytest.approx((meanwhile, 2.0), abs=0.4)
