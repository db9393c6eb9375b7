# SPDX-License-Identifier: BSD-3-Clause
"""Paths around zones that no robot may enter."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

pytest.importorskip("ompl")

from hive_common.grid_map import GridMap
from hive_common.pose import Pose
from hive_common.zone import KEEP_OUT, NO_STOPPING, Zone
from hive_navigation.planning.path import Path
from hive_navigation.planning.planner import PlanError
from hive_navigation.planning.zoned_planner import ZonedPlanner

RADIUS = 0.4
ORIGIN = Pose(-1.0, 2.0, 0.0)

LOWER = ((3.5, 2.9), (4.5, 2.9), (4.5, 4.1), (3.5, 4.1))
UPPER = ((3.5, 6.4), (4.5, 6.4), (4.5, 7.6), (3.5, 7.6))
"""The two doors in the wall between the rooms, corners in the map frame [m]."""

WEST, EAST = (2.0, 4.5), (6.0, 4.5)


def two_rooms(*zones: Zone) -> ZonedPlanner:
    """Return a planner for two rooms with two doors in the wall at x 4 between them."""
    blocked = np.zeros((120, 200), dtype=bool)
    blocked[:, 98:102] = True
    blocked[18:42, 98:102] = False
    blocked[88:112, 98:102] = False
    return ZonedPlanner(GridMap.of_blocked(blocked, 0.05, ORIGIN), RADIUS, zones)


def zone(corners: Any, kind: str = NO_STOPPING, *, closed: bool = True) -> Zone:
    return Zone(name="door", kind=kind, corners=corners, closed=closed)


def highest(path: list[tuple[float, float]]) -> float:
    return max(y for _, y in path)


@pytest.mark.parametrize("shut", [zone(LOWER), zone(LOWER, KEEP_OUT, closed=False)])
def test_a_path_leads_around_a_zone_that_is_closed_or_keeps_robots_out(shut: Zone) -> None:
    planner = two_rooms(shut)

    assert highest(planner.plan(WEST, EAST)) > 6.4


def test_a_zone_that_is_open_is_driven_through_again() -> None:
    planner = two_rooms(zone(LOWER))
    planner.use(planner.around([zone(LOWER, closed=False)]))

    assert highest(planner.plan(WEST, EAST)) < 5.0


def test_no_part_of_a_robot_enters_a_zone_beside_its_path() -> None:
    corner = (2.0, 3.8)
    beside = zone(((1.0, 2.0), (2.0, 2.0), corner, (1.0, 3.8)))
    here, there = (0.0, 3.0), (3.0, 4.6)

    def least(planner: ZonedPlanner) -> float:
        path = Path(planner.plan(here, there))
        return math.dist(path.at(path.nearest(corner, 0.0, path.length)), corner)

    assert least(two_rooms()) < RADIUS < least(two_rooms(beside))


def test_a_robot_in_a_zone_that_is_closed_leaves_it() -> None:
    assert two_rooms(zone(LOWER)).plan((4.0, 3.5), EAST)[-1] == EAST


@pytest.mark.parametrize("goal", [EAST, (4.0, 3.5)])
def test_where_only_closed_zones_lead_to_a_goal_they_are_named(goal: tuple[float, float]) -> None:
    planner = two_rooms(zone(LOWER), zone(UPPER))

    with pytest.raises(PlanError, match=r"closed or keeps robots out \(door, door\)") as caught:
        planner.plan(WEST, goal)

    assert not caught.value.lasting


def test_where_no_path_leads_even_without_zones_that_is_said() -> None:
    planner = two_rooms(zone(LOWER))

    with pytest.raises(PlanError, match="is not on the map") as caught:
        planner.plan(WEST, (50.0, 50.0))

    assert caught.value.lasting


def test_a_path_ends_as_near_to_its_goal_as_zones_let_it() -> None:
    planner = two_rooms(zone(LOWER), zone(UPPER))

    assert planner.plan_near(WEST, EAST, 5.0)[-1][0] < 4.0
    with pytest.raises(PlanError, match="closed or keeps robots out"):
        planner.plan_near(WEST, EAST, 1.0)


def test_of_a_zone_that_reaches_over_the_edge_of_the_map_only_what_is_on_it_counts() -> None:
    over = zone(((-5.0, 6.0), (5.0, 6.0), (5.0, 20.0), (-5.0, 20.0)))
    off = zone(((50.0, 50.0), (60.0, 50.0), (60.0, 60.0)))
    planner = two_rooms(over, off)

    assert highest(planner.plan(WEST, EAST)) < 5.0
    with pytest.raises(PlanError, match="closed or keeps robots out"):
        planner.plan(WEST, (2.0, 7.0))
