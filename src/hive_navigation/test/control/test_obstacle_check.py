# SPDX-License-Identifier: BSD-3-Clause
"""Visible obstacles: which are known, and how far a robot may go."""

from __future__ import annotations

import numpy as np
import pytest

from hive_common.grid_map import GridMap
from hive_common.pose import Pose
from hive_navigation.control.obstacle_check import (
    GAP,
    ObstacleCheck,
    ObstacleMemory,
    VisibleObstacles,
    discs_around,
    points_seen,
    sort_points,
)
from hive_navigation.planning.clearance import ClearanceField, Disc
from hive_navigation.planning.path import Path
from robot_description.models import load_model
from robot_description.scan import Scan

MODEL = load_model("mir100")
FRONT = 0.445
NOTHING = np.empty((0, 2))
PATH = Path([(0.0, 0.0), (9.0, 0.0)])
HERE = Pose(0.0, 0.0, 0.0)


def room(known: object = NOTHING, unknown: object = NOTHING) -> float:
    obstacles = VisibleObstacles(np.array(known, dtype=float), np.array(unknown, dtype=float))
    return ObstacleCheck(MODEL.base, MODEL.laser).room_ahead(PATH, 0.0, HERE, obstacles)


def test_a_scan_becomes_points_on_the_map() -> None:
    ranges = np.full(720, np.inf)
    ranges[360] = 2.0  # the middle of the field of view is straight ahead

    points = points_seen(MODEL.laser, Scan.of(MODEL.laser, ranges), Pose(1.0, 1.0, np.pi / 2))

    assert points.round(2).tolist() == [[1.0, 3.0]]


def test_ranges_too_close_or_out_of_range_are_no_points() -> None:
    ranges = np.array([-np.inf, np.inf, np.nan, 0.05, 3.0])

    assert len(points_seen(MODEL.laser, Scan.of(MODEL.laser, ranges), HERE)) == 0


def test_points_on_mapped_walls_and_on_robots_that_announce_themselves_are_known() -> None:
    blocked = np.zeros((100, 100), dtype=bool)
    blocked[:, 60:64] = True
    field = ClearanceField.of(GridMap.of_blocked(blocked, 0.05))
    points = np.array([[2.98, 2.5], [1.0, 1.0], [2.0, 2.5]])

    obstacles = sort_points(points, field, [Disc(1.0, 1.4, 0.4)])

    assert obstacles.known.tolist() == [[2.98, 2.5], [1.0, 1.0]]
    assert obstacles.unknown.tolist() == [[2.0, 2.5]]


def test_without_visible_obstacles_the_range_of_the_laser_limits_the_room() -> None:
    assert room() == pytest.approx((3.0 - MODEL.base.circumscribed_radius - GAP) / 2)


def test_half_of_the_distance_to_an_unknown_obstacle_may_be_used() -> None:
    assert room(unknown=[[2.0, 0.1]]) == pytest.approx((2.0 - FRONT - GAP) / 2, abs=0.1)


def test_all_the_distance_up_to_a_mapped_wall_may_be_used() -> None:
    assert room(known=[[1.5, 0.1]]) == pytest.approx(1.5 - FRONT - GAP / 3, abs=0.12)


def test_what_is_beside_the_path_does_not_matter() -> None:
    assert room(unknown=[[1.5, 0.5], [1.5, -0.5], [-0.6, 0.0]]) == room()


def test_what_touches_the_robot_already_does_not_keep_it_from_leaving() -> None:
    assert room(unknown=[[0.0, 0.3]]) == room()


def test_it_may_not_turn_into_something_beside_it() -> None:
    obstacle_check = ObstacleCheck(MODEL.base, MODEL.laser)

    assert not obstacle_check.may_turn(HERE, VisibleObstacles(NOTHING, np.array([[0.0, 0.5]])))
    assert obstacle_check.may_turn(HERE, VisibleObstacles(NOTHING, np.array([[0.0, 0.7]])))


def test_only_points_on_the_path_block_it() -> None:
    obstacles = VisibleObstacles(NOTHING, np.array([[1.5, 0.0], [1.5, 2.0]]))

    assert ObstacleCheck(MODEL.base, MODEL.laser).blocking(PATH, 0.0, obstacles).tolist() == [
        [1.5, 0.0]
    ]


def test_discs_cover_all_points() -> None:
    points = np.random.default_rng(1).uniform(0, 2, (50, 2))
    discs = discs_around(points)

    assert all(
        any(np.hypot(x - disc.x, y - disc.y) <= disc.radius for disc in discs) for x, y in points
    )


def test_an_obstacle_is_forgotten_after_a_time() -> None:
    memory = ObstacleMemory()
    memory.add(1.0, np.array([[1.0, 1.0]]))

    assert len(memory.discs(20.0)) == 1
    assert memory.discs(22.0) == []
