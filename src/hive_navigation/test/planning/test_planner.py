# SPDX-License-Identifier: BSD-3-Clause
"""The planner: short free paths, detours around obstacles, and why there is no path."""

from __future__ import annotations

import math
from functools import lru_cache
from itertools import pairwise

import numpy as np
import pytest

pytest.importorskip("ompl")

from hive_common.grid_map import GridMap
from hive_common.pose import Pose, compose, inverse
from hive_common.turned_map import TurnedMap
from hive_lab.bench.shortest_paths import path_length
from hive_navigation.planning.clearance import Disc
from hive_navigation.planning.ompl_planner import OmplPlanner
from hive_navigation.planning.planner import PlanError

RADIUS = 0.4


@lru_cache
def two_rooms() -> OmplPlanner:
    """Return a planner for two rooms of 5 m x 6 m with doors at y 1.5 (1.2 m) and 5.0 (1.2 m).

    A closed cell of 1 m x 1 m stands in the upper left corner.
    """
    blocked = np.zeros((120, 200), dtype=bool)
    blocked[:, 98:102] = True
    blocked[18:42, 98:102] = False
    blocked[88:112, 98:102] = False
    blocked[98:100, 0:22] = True
    blocked[98:120, 20:22] = True
    return OmplPlanner(GridMap.of_blocked(blocked, 0.05), RADIUS)


def test_a_free_path_is_straight() -> None:
    assert two_rooms().plan((1.0, 1.0), (4.0, 2.0)) == [(1.0, 1.0), (4.0, 2.0)]


def test_a_path_leads_through_the_nearer_door_and_keeps_clear_of_the_walls() -> None:
    planner = two_rooms()
    path = planner.plan((3.0, 2.5), (7.0, 2.5))

    assert all(planner.field.line_is_clear(a, b, planner.need) for a, b in pairwise(path))
    # The upper door post stands at y 2.1, so the path must come down to y 1.62 and up again.
    assert path_length(path) < 1.05 * 2 * math.hypot(2.0, 0.88)


@pytest.mark.parametrize("yaw", [0.5, math.pi / 2, -2.0])
def test_on_a_map_that_is_turned_a_path_leads_through_the_same_door(yaw: float) -> None:
    straight = two_rooms().plan((3.0, 2.5), (7.0, 2.5))
    grid = two_rooms().field.grid
    origin = Pose(-4.0, 7.0, yaw)
    planner = OmplPlanner(TurnedMap(grid.cells, grid.resolution, origin).upright(), RADIUS)

    (start, goal) = (compose(origin, Pose(x, 2.5)) for x in (3.0, 7.0))
    path = planner.plan((start.x, start.y), (goal.x, goal.y))

    assert all(planner.field.line_is_clear(a, b, planner.need) for a, b in pairwise(path))
    assert path_length(path) == pytest.approx(path_length(straight), rel=0.05)
    there = inverse(origin)
    assert max(compose(there, Pose(x, y)).y for x, y in path) < 3.0


def test_the_same_question_gets_the_same_answer() -> None:
    planner = two_rooms()
    first = planner.plan((1.0, 3.5), (9.0, 3.5))
    planner.plan((9.0, 1.0), (1.0, 1.0))

    assert planner.plan((1.0, 3.5), (9.0, 3.5)) == first


def test_a_path_takes_the_other_door_if_one_is_blocked() -> None:
    path = two_rooms().plan((3.0, 1.5), (7.0, 1.5), [Disc(5.0, 1.5, 0.3)])

    assert max(y for _, y in path) > 4.0


def test_a_path_leads_around_an_obstacle_in_an_open_room() -> None:
    planner = two_rooms()
    disc = Disc(2.5, 2.0, 0.3)
    path = planner.plan((1.0, 2.0), (4.0, 2.0), [disc])
    field = planner.field.with_discs([disc])

    assert all(field.line_is_clear(a, b, planner.need) for a, b in pairwise(path))
    assert path_length(path) < 1.2 * 3.0


def test_a_goal_in_a_wall_is_rejected_with_the_clearance_needed() -> None:
    reason = r"goal \(5.00, 3.00\) is in a wall.*needs 0.45 m"

    with pytest.raises(PlanError, match=reason) as raised:
        two_rooms().plan((1.0, 1.0), (5.0, 3.0))
    assert raised.value.lasting


@pytest.mark.parametrize("goal", [(30.0, 1.0), (math.nan, 1.0), (1.0, -math.inf)])
def test_a_goal_off_the_map_is_rejected_with_its_bounds(goal: tuple[float, float]) -> None:
    with pytest.raises(PlanError, match=r"not on the map.*\(10.00, 6.00\)"):
        two_rooms().plan((1.0, 1.0), goal)


def test_a_goal_that_the_map_cuts_off_is_a_lasting_error() -> None:
    with pytest.raises(PlanError, match=r"no path .* on this map") as raised:
        two_rooms().plan((1.0, 1.0), (0.5, 5.5))
    assert raised.value.lasting


def test_a_goal_that_only_unmapped_obstacles_cut_off_is_a_passing_error() -> None:
    discs = [Disc(5.0, 1.5, 0.4), Disc(5.0, 5.0, 0.4)]

    with pytest.raises(PlanError, match=r"around the obstacles that are not on the map") as raised:
        two_rooms().plan((3.0, 3.0), (7.0, 3.0), discs)
    assert not raised.value.lasting


def test_a_robot_that_stands_too_close_to_a_wall_gets_a_path_from_there() -> None:
    path = two_rooms().plan((0.35, 3.0), (4.0, 3.0))

    assert path[0] == (0.35, 3.0)
    assert path[-1] == (4.0, 3.0)


def test_a_path_near_a_goal_that_the_map_cuts_off_ends_at_the_nearest_place_on_this_side() -> None:
    start, cut_off = (1.0, 1.0), (0.5, 5.5)

    end = two_rooms().plan_near(start, cut_off, tolerance=2.0)[-1]

    assert 0.9 < math.dist(end, cut_off) < 1.4
    assert end[1] < 4.9 - RADIUS or end[0] > 1.1 + RADIUS
    with pytest.raises(PlanError, match="no path"):
        two_rooms().plan_near(start, cut_off, tolerance=0.5)
