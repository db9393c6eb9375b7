# SPDX-License-Identifier: BSD-3-Clause
"""The independent check of paths on a grid, and the roadmap that a grid becomes."""

import numpy as np
import pytest

from hive_lab.mapf.grid_file import Grid
from hive_lab.mapf.grid_paths import mistakes, steps_to, sum_of_costs
from hive_lab.mapf.grid_roadmap import roadmap_of

SQUARE = Grid(np.ones((2, 2), dtype=bool))  # cells 0 1 / 2 3
RING = Grid(np.array([[1, 1, 1], [1, 0, 1]], dtype=bool))  # cells 0 1 2 / 3 - 4


@pytest.mark.parametrize(
    ("paths", "wrong"),
    [
        ([[0, 1], [2, 3]], []),
        ([[0, 1], [1, 3]], []),
        ([[0, 1, 2, 3], [1, 3, 0, 2]], []),
        ([[0, 1], [1, 1]], ["step 1: robots [0, 1] are in cell (1, 0)"]),
        ([[0, 1], [1, 0]], ["step 1: robots 0 and 1 change places"]),
        ([[0], [3]], ["step 1: robot 0 jumps to cell (1, 1)"]),
        ([[0], [4]], ["a robot is in a cell that is not free"]),
        ([[2, 2], [2, 0]], ["step 0: robots [0, 1] are in cell (0, 1)"]),
    ],
)
def test_the_check_finds_robots_that_meet_swap_or_jump(paths, wrong):
    assert list(mistakes(SQUARE, np.array(paths))) == wrong


def test_the_costs_of_a_robot_end_when_it_stays_at_its_goal():
    paths = np.array([[0, 1, 2], [1, 1, 3], [0, 1, 3], [2, 1, 3]])

    assert sum_of_costs(paths) == 3 + 0 + 1


def test_steps_go_around_what_is_blocked():
    assert steps_to(RING, [3]).tolist() == [[1.0, 2.0, 3.0, 0.0, 4.0]]


def test_a_grid_becomes_a_roadmap_with_its_lanes_in_the_order_of_their_origins():
    roadmap = roadmap_of(RING, parking=np.array([4]))

    assert roadmap.places.tolist() == [[0, 0], [1, 0], [2, 0], [0, 1], [2, 1]]
    assert roadmap.lanes.tolist() == [
        [0, 1], [0, 3], [1, 0], [1, 2], [2, 1], [2, 4], [3, 0], [4, 2],
    ]  # fmt: skip
    assert roadmap.begins.tolist() == [0, 2, 4, 6, 7, 8]
    assert roadmap.lengths.tolist() == [1.0] * 8
    assert roadmap.may_park.tolist() == [False, False, False, False, True]
