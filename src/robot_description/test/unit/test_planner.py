# SPDX-License-Identifier: BSD-3-Clause
"""The planner on a small map: a room, a wall with one door, and things that are not on the map."""

import itertools
import math

import numpy as np
import pytest

from robot_description.grid_map import ClearanceField, Disc, GridMap
from robot_description.ompl_planner import OmplPlanner
from robot_description.planner import PlanError

RADIUS = 0.3
WEST, EAST = (2.0, 3.0), (8.0, 3.0)


def room():
    """Return 10 m x 6 m of floor with a wall at x = 5 m that has a door from y = 4 to 5 m."""
    blocked = np.zeros((120, 200), dtype=bool)
    blocked[[0, -1]] = blocked[:, [0, -1]] = True
    blocked[:80, 100:102] = blocked[100:, 100:102] = True
    return GridMap(blocked, 0.05, (0.0, 0.0))


@pytest.fixture(scope="module")
def planner():
    return OmplPlanner(room(), RADIUS)


def length(way):
    return sum(math.dist(a, b) for a, b in itertools.pairwise(way))


def test_where_nothing_is_between_the_way_is_straight(planner):
    assert planner.plan((1.0, 1.0), (4.0, 3.0)) == [(1.0, 1.0), (4.0, 3.0)]


def test_a_way_leads_through_the_door_and_keeps_its_distance(planner):
    way = planner.plan(WEST, EAST)
    field = ClearanceField.of(room())
    steps = np.linspace(0.0, 1.0, 200)[:, None]
    along = [np.array(a) + steps * (np.array(b) - np.array(a)) for a, b in itertools.pairwise(way)]

    assert way[0] == WEST
    assert way[-1] == EAST
    assert field.at_points(np.vstack(along)).min() >= RADIUS
    shortest = math.dist(WEST, (5.0, 4.3)) + math.dist((5.0, 4.3), EAST)
    assert length(way) < 1.05 * shortest


def test_the_same_question_has_the_same_answer(planner):
    assert planner.plan(WEST, EAST) == planner.plan(WEST, EAST)


def test_what_stands_in_the_open_is_driven_around(planner):
    way = planner.plan((1.0, 2.0), (4.0, 2.0), [Disc(2.5, 2.0, 0.2)])

    assert length(way) > 3.0
    assert all(math.dist(point, (2.5, 2.0)) >= 0.2 + RADIUS for point in way)


def test_a_door_that_is_taken_is_no_way_for_now(planner):
    with pytest.raises(PlanError, match="past what stands in the way") as refused:
        planner.plan(WEST, EAST, [Disc(5.05, 4.5, 0.4)])

    assert not refused.value.lasting


@pytest.mark.parametrize(
    ("goal", "said"),
    [((5.02, 2.0), "in a wall"), ((4.9, 2.0), "too close"), ((12.0, 3.0), "not on the map")],
)
def test_a_goal_where_nobody_can_stand_is_refused_for_good(planner, goal, said):
    with pytest.raises(PlanError, match=said) as refused:
        planner.plan(WEST, goal)

    assert refused.value.lasting


def test_a_robot_that_is_too_wide_for_the_door_has_no_way():
    with pytest.raises(PlanError, match="no way from") as refused:
        OmplPlanner(room(), 0.55).plan(WEST, EAST)

    assert refused.value.lasting
