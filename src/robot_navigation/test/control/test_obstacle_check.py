# SPDX-License-Identifier: BSD-3-Clause
"""What the laser sees: whose it is, and how far it lets a robot go."""

from __future__ import annotations

import numpy as np
import pytest

from hive_common.grid_map import ClearanceField, Disc
from hive_common.map_file import GridMap
from hive_common.pose import Pose
from robot_description.models import load_model
from robot_navigation.control.obstacle_check import (
    GAP,
    Memory,
    ObstacleCheck,
    Sight,
    discs_around,
    points_seen,
    sort_points,
)
from robot_navigation.planning.path import Way

MODEL = load_model("mir100")
FRONT = 0.445
NOTHING = np.empty((0, 2))
WAY = Way([(0.0, 0.0), (9.0, 0.0)])
HERE = Pose(0.0, 0.0, 0.0)


def room(known: object = NOTHING, unknown: object = NOTHING) -> float:
    sight = Sight(np.array(known, dtype=float), np.array(unknown, dtype=float))
    return ObstacleCheck(MODEL.base, MODEL.laser).room_ahead(WAY, 0.0, HERE, sight)


def test_a_scan_becomes_points_on_the_map() -> None:
    ranges = np.full(720, np.inf)
    ranges[360] = 2.0  # the middle of the field of view is straight ahead

    points = points_seen(MODEL.laser, ranges, Pose(1.0, 1.0, np.pi / 2))

    assert points.round(2).tolist() == [[1.0, 3.0]]


def test_what_is_too_close_or_out_of_range_is_no_point() -> None:
    ranges = np.array([-np.inf, np.inf, np.nan, 0.05, 3.0])

    assert len(points_seen(MODEL.laser, ranges, HERE)) == 0


def test_points_are_known_at_mapped_walls_and_at_robots_that_speak() -> None:
    blocked = np.zeros((100, 100), dtype=bool)
    blocked[:, 60:64] = True
    field = ClearanceField.of(GridMap.of_blocked(blocked, 0.05))
    points = np.array([[2.98, 2.5], [1.0, 1.0], [2.0, 2.5]])

    sight = sort_points(points, field, [Disc(1.0, 1.4, 0.4)])

    assert sight.known.tolist() == [[2.98, 2.5], [1.0, 1.0]]
    assert sight.unknown.tolist() == [[2.0, 2.5]]


def test_without_anything_in_sight_the_end_of_sight_limits_it() -> None:
    assert room() == pytest.approx((3.0 - MODEL.base.circumscribed_radius - GAP) / 2)


def test_two_that_meet_head_on_may_use_half_of_the_distance_each() -> None:
    assert room(unknown=[[2.0, 0.1]]) == pytest.approx((2.0 - FRONT - GAP) / 2, abs=0.1)


def test_all_the_distance_up_to_a_mapped_wall_may_be_used() -> None:
    assert room(known=[[1.5, 0.1]]) == pytest.approx(1.5 - FRONT - GAP / 3, abs=0.12)


def test_what_is_beside_the_way_does_not_matter() -> None:
    assert room(unknown=[[1.5, 0.5], [1.5, -0.5], [-0.6, 0.0]]) == room()


def test_what_touches_the_robot_already_does_not_keep_it_from_leaving() -> None:
    assert room(unknown=[[0.0, 0.3]]) == room()


def test_it_may_not_turn_into_something_beside_it() -> None:
    obstacle_check = ObstacleCheck(MODEL.base, MODEL.laser)

    assert not obstacle_check.may_turn(HERE, Sight(NOTHING, np.array([[0.0, 0.5]])))
    assert obstacle_check.may_turn(HERE, Sight(NOTHING, np.array([[0.0, 0.7]])))


def test_only_points_on_the_way_block_it() -> None:
    sight = Sight(NOTHING, np.array([[1.5, 0.0], [1.5, 2.0]]))

    assert ObstacleCheck(MODEL.base, MODEL.laser).blocking(WAY, 0.0, sight).tolist() == [
        [1.5, 0.0]
    ]


def test_discs_cover_all_points() -> None:
    points = np.random.default_rng(1).uniform(0, 2, (50, 2))
    discs = discs_around(points)

    assert all(
        any(np.hypot(x - disc.x, y - disc.y) <= disc.radius for disc in discs) for x, y in points
    )


def test_what_was_seen_is_forgotten_after_a_time() -> None:
    memory = Memory(lasts=20.0)
    memory.add(1.0, np.array([[1.0, 1.0]]))

    assert len(memory.discs(20.0)) == 1
    assert memory.discs(22.0) == []
