# SPDX-License-Identifier: BSD-3-Clause
"""The coordinator leads a robot along straight lines, from where it stands."""

import itertools
import math
from dataclasses import replace

import numpy as np
import pytest

from hive_common.grid_map import GridMap
from hive_navigation.mapf.roadmap_builder import build_roadmap
from hive_navigation.planning.clearance import ClearanceField
from hive_navigation.traffic.coordinator import Coordinator
from hive_navigation.traffic.right_of_way import Announcement, no_right

EAST, WEST = (7.31, 5.02), (2.17, 5.33)


@pytest.fixture
def coordinator():
    blocked = np.zeros((200, 200), dtype=bool)
    blocked[:4] = blocked[-4:] = blocked[:, :4] = blocked[:, -4:] = True
    field = ClearanceField.of(GridMap.of_blocked(blocked, 0.05))
    return Coordinator(field, build_roadmap(field, [0.4]))


def at(x, y, goal, time=0.0):
    right = no_right("a")
    return Announcement("a", time, x, y, 0.4, right, ((x, y),), 0.0, stationary=False, goal=goal)


def test_a_route_turns_at_each_of_its_places(coordinator):
    coordinator.hear(at(2.0, 2.0, EAST))

    (route,) = coordinator.step(0.0)

    headings = [math.atan2(d - b, c - a) for (a, b), (c, d) in itertools.pairwise(route.places)]
    assert route.complete
    assert route.places[-1] == pytest.approx(EAST)
    assert all(abs(one - other) > math.radians(0.1) for one, other in itertools.pairwise(headings))


def test_a_robot_with_a_new_goal_begins_where_it_stands_though_it_came_to_the_last_from_there(
    coordinator,
):
    coordinator.hear(at(*WEST, EAST))
    (there,) = coordinator.step(0.0)
    length = sum(math.dist(*leg) for leg in itertools.pairwise(there.places))
    stopped = replace(
        at(EAST[0] - 0.04, EAST[1], WEST, time=9.0), plan=there.plan, passed=round(1000 * length)
    )
    coordinator.hear(stopped)

    (back,) = coordinator.step(9.0)

    assert back.complete
    assert back.places[0] == pytest.approx((EAST[0] - 0.04, EAST[1]))
    assert back.places[-1] == pytest.approx(WEST)
