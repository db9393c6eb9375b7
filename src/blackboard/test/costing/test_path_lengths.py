# SPDX-License-Identifier: BSD-3-Clause
"""Path lengths on floors that can be measured with a ruler."""

import math
from collections import deque

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from blackboard.costing.euclidean_lengths import EuclideanLengths
from blackboard.costing.grid_path_lengths import GridPathLengths
from hive_common.grid_map import GridMap
from hive_common.pose import Pose, compose
from hive_common.turned_map import TurnedMap

WALL = 0.1  # thickness [m]


def floor(width, height, resolution=0.05):
    """Return an empty floor with its lower left corner at (0, 0) [m]."""
    shape = (round(height / resolution), round(width / resolution))
    return GridMap.of_blocked(np.zeros(shape, dtype=bool), resolution)


def block(grid, left, bottom, right, top):
    """Put up a wall between two corners [m]."""
    scale = 1.0 / grid.resolution
    rows = slice(round(bottom * scale), round(top * scale))
    columns = slice(round(left * scale), round(right * scale))
    grid.blocked[rows, columns] = True


def two_rooms(width, height, door):
    """Return a floor that a wall cuts in two, with a door in its middle [m]."""
    grid = floor(width, height)
    middle = width / 2
    block(grid, middle, 0.0, middle + WALL, (height - door) / 2)
    block(grid, middle, (height + door) / 2, middle + WALL, height)
    return grid


OPEN = GridPathLengths(floor(13.0, 13.0), 0.3)
INSIDE = st.builds(Pose, st.floats(1.0, 12.0), st.floats(1.0, 12.0))


@settings(max_examples=15)
@given(INSIDE, INSIDE)
def test_in_the_open_the_path_is_the_straight_line_within_3_percent(start, goal):
    straight = start.distance_to(goal)
    cell = 0.1  # of the coarse grid: both ends lie somewhere in their cells

    assert straight <= OPEN.length(start, goal) <= 1.03 * straight + 2 * cell


@settings(max_examples=10)
@given(INSIDE, INSIDE)
def test_the_path_back_is_as_long(start, goal):
    there, back = OPEN.length(start, goal), OPEN.length(goal, start)

    assert there == pytest.approx(back, rel=1e-9)


@pytest.mark.parametrize("yaw", [0.5, math.pi / 2, -2.0])
def test_on_a_map_that_is_turned_paths_are_as_long_as_on_the_same_map_upright(yaw):
    floor_plan = two_rooms(10.0, 8.0, 1.2)
    cells = GridMap.of_blocked(floor_plan.blocked, floor_plan.resolution).cells
    origin = Pose(-4.0, 7.0, yaw)
    grid = TurnedMap(cells, floor_plan.resolution, origin).upright()
    start, goal = Pose(1.0, 1.0), Pose(9.0, 1.0)

    length = GridPathLengths(grid, 0.3).length(compose(origin, start), compose(origin, goal))

    assert length == pytest.approx(GridPathLengths(floor_plan, 0.3).length(start, goal), rel=0.05)


def test_the_path_back_is_as_long_when_nothing_was_asked_before():
    grid = two_rooms(10.0, 8.0, 1.2)
    start, goal = Pose(1.0, 1.0), Pose(9.0, 7.0)

    there, back = (
        GridPathLengths(grid, 0.3).length(start, goal),
        GridPathLengths(grid, 0.3).length(goal, start),
    )

    assert there == pytest.approx(back, rel=1e-9)


def test_a_place_is_no_distance_from_itself():
    assert OPEN.length(Pose(3.0, 3.0), Pose(3.0, 3.0)) == 0.0


@pytest.mark.parametrize("side", [10.0, 16.0])  # on the map's own cells, and on coarse ones
def test_around_a_wall_the_path_bends_at_its_end(side):
    grid = floor(side, side)
    block(grid, 5.0, 0.0, 5.1, 7.0)
    start, goal = Pose(2.0, 2.0), Pose(8.1, 2.0)

    # A round robot of 0.3 m passes the corners (5, 7) and (5.1, 7) on an arc around them.
    corner = Pose(5.05, 7.3)
    bend = start.distance_to(corner) + corner.distance_to(goal)
    assert GridPathLengths(grid, 0.3).length(start, goal) == pytest.approx(bend, rel=0.04)


@pytest.mark.parametrize(
    ("size", "radius"), [((8.0, 6.0), 0.05), ((8.0, 6.0), 0.3), ((20.0, 12.0), 0.3)]
)
def test_through_a_wall_there_is_no_path(size, radius):
    grid = two_rooms(*size, door=0.0)
    left, right = Pose(size[0] / 4, size[1] / 2), Pose(size[0] * 3 / 4, size[1] / 2)

    assert GridPathLengths(grid, radius).length(left, right) == math.inf


@pytest.mark.parametrize(
    ("size", "radius"),
    [
        ((8.0, 6.0), 0.2),  # small enough for the map's own cells
        ((20.0, 12.0), 0.3),  # two of them to a coarse cell
        ((20.0, 12.0), 0.45),
        ((60.0, 40.0), 0.2),  # four of them
    ],
)
def test_a_door_is_open_for_a_robot_that_fits_and_closed_for_one_that_does_not(size, radius):
    left, right = Pose(size[0] / 4, size[1] / 2), Pose(size[0] * 3 / 4, size[1] / 2)
    wide, narrow = (two_rooms(*size, 2 * radius + margin) for margin in (0.1, -0.1))

    length = GridPathLengths(wide, radius).length(left, right)

    assert length == pytest.approx(size[0] / 2, rel=0.03)
    assert GridPathLengths(narrow, radius).length(left, right) == math.inf


def test_a_door_that_is_one_cell_too_narrow_is_closed_on_a_large_map_as_well():
    grid = two_rooms(60.0, 40.0, door=0.35)

    assert GridPathLengths(grid, 0.2).length(Pose(15.0, 20.0), Pose(45.0, 20.0)) == math.inf


def test_a_wall_across_the_cells_holds_as_well():
    grid = floor(20.0, 20.0)
    for cell in range(400):
        grid.blocked[cell, max(0, 398 - cell) : 401 - cell] = True

    assert GridPathLengths(grid, 0.3).length(Pose(5.0, 5.0), Pose(15.0, 15.0)) == math.inf


MAPS = st.lists(st.lists(st.booleans(), min_size=6, max_size=6), min_size=6, max_size=6)
CORNERS = st.tuples(st.integers(0, 5), st.integers(0, 5))


def reachable(blocked, start, goal):
    """Return whether a walk from cell to cell, over sides only, leads to a goal."""
    seen, edge = {start}, deque([start])
    while edge:
        row, column = edge.popleft()
        for cell in ((row + 1, column), (row - 1, column), (row, column + 1), (row, column - 1)):
            inside = 0 <= cell[0] < 6 and 0 <= cell[1] < 6
            if inside and not blocked[cell] and cell not in seen:
                seen.add(cell)
                edge.append(cell)
    return goal in seen


@given(MAPS, CORNERS, CORNERS)
def test_on_any_map_there_is_a_path_exactly_where_one_can_walk(cells, start, goal):
    blocked = np.array(cells)
    blocked[start] = blocked[goal] = False
    path_lengths = GridPathLengths(GridMap.of_blocked(blocked, 1.0))

    length = path_lengths.length(
        Pose(start[1] + 0.5, start[0] + 0.5), Pose(goal[1] + 0.5, goal[0] + 0.5)
    )

    assert math.isfinite(length) == reachable(blocked, start, goal)


@pytest.mark.parametrize(("clearance", "found"), [(0.2, True), (0.1, False)])
def test_a_pose_a_little_too_near_to_a_wall_counts_as_free_and_one_in_it_does_not(
    clearance, found
):
    grid = floor(8.0, 6.0)
    block(grid, 4.0, 0.0, 4.1, 6.0)

    length = GridPathLengths(grid, 0.3).length(Pose(4.0 - clearance, 3.0), Pose(1.0, 3.0))

    assert math.isfinite(length) == found


def test_outside_the_map_there_is_no_path():
    assert OPEN.length(Pose(1.0, 1.0), Pose(14.0, 1.0)) == math.inf
    assert OPEN.length(Pose(-1.0, 1.0), Pose(1.0, 1.0)) == math.inf


def test_nobody_can_stand_outside_the_map_or_in_a_wall():
    grid = floor(8.0, 6.0)
    block(grid, 4.0, 0.0, 4.1, 6.0)
    path_lengths = GridPathLengths(grid)

    assert "reaches from (0.00, 0.00) to (8.00, 6.00) m" in path_lengths.refusal(Pose(8.5, 1.0))
    assert "choose a free place" in path_lengths.refusal(Pose(4.05, 3.0))
    assert not path_lengths.refusal(Pose(3.95, 3.0))


def test_a_map_may_begin_anywhere():
    grid = GridMap.of_blocked(np.zeros((40, 40), dtype=bool), 0.1, Pose(-2.0, -3.0))
    path_lengths = GridPathLengths(grid, 0.2)

    assert not path_lengths.refusal(Pose(-1.9, -2.9))
    assert "from (-2.00, -3.00) to (2.00, 1.00)" in path_lengths.refusal(Pose(2.1, 0.0))
    assert path_lengths.length(Pose(-1.5, -2.5), Pose(1.5, -2.5)) == pytest.approx(3.0, rel=0.03)


def test_another_map_counts_from_then_on():
    path_lengths = GridPathLengths(two_rooms(8.0, 6.0, 1.2), 0.3)
    left, right = Pose(2.0, 3.0), Pose(6.0, 3.0)
    before = path_lengths.length(left, right)

    path_lengths.use(two_rooms(8.0, 6.0, 0.0))

    assert math.isfinite(before)
    assert path_lengths.length(left, right) == math.inf


def test_many_goals_do_not_wear_out_the_answers():
    path_lengths = GridPathLengths(floor(1.6, 1.6), 0.3)
    here = Pose(0.8, 0.8)
    goals = [Pose(0.4 + 0.05 * (i % 16), 0.4 + 0.05 * (i // 16)) for i in range(250)]
    first = [path_lengths.length(here, goal) for goal in goals]

    assert [path_lengths.length(here, goal) for goal in goals] == pytest.approx(first)


def test_as_the_crow_flies_there_are_no_walls():
    assert EuclideanLengths().length(Pose(0.0, 0.0), Pose(3.0, 4.0)) == 5.0
    assert not EuclideanLengths().refusal(Pose(1e9, 0.0))
