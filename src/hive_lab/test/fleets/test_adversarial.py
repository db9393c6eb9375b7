# SPDX-License-Identifier: BSD-3-Clause
"""The hard layouts are small, can be solved, and are the same for the same seed."""

from __future__ import annotations

import numpy as np
import pytest

pytest.importorskip("ompl")

from hive_lab.fleets.adversarial import (
    CELL,
    MOVES,
    ROBOTS,
    draw,
    layout_of,
    least_moves,
    site_of,
)
from hive_lab.fleets.sites import WALL
from hive_navigation.mapf.ends import joined_ends
from hive_navigation.mapf.joint_planner import Agent, JointPlanner
from hive_navigation.mapf.roadmap_builder import build_roadmap
from hive_navigation.planning.clearance import ClearanceField

SEEDS = range(300)
RADIUS = 0.43  # of an LD-60 [m]


@pytest.mark.parametrize(
    ("rows", "moves"),
    [
        ("aA", 0),
        ("a . A", 2),
        ("aB bA", -1),
        ("a . b BA", -1),
        (". a b BA", -1),
        ("aB . bA\n# . #", 6),
        ("aB . bA\n. . .", 6),
        # Who has no goal makes way.
        ("a b A\n# . #", 3),
    ],
)
def test_the_search_finds_the_fewest_moves(rows, moves):
    assert least_moves(layout_of(rows)) == moves


def test_a_seed_gives_the_same_layout_again_and_others_give_others():
    assert draw(7) == draw(7)
    assert len({draw(seed) for seed in SEEDS}) > 0.9 * len(SEEDS)


def test_layouts_have_few_robots_that_can_get_to_their_goals_in_few_moves():
    for layout in map(draw, SEEDS):
        assert ROBOTS[0] <= len(layout.starts) == len(set(layout.starts)) <= ROBOTS[1]
        assert 0 < least_moves(layout) <= MOVES


def test_all_kinds_of_layouts_are_drawn():
    drawn = [draw(seed) for seed in SEEDS]

    assert {len(layout.starts) for layout in drawn} == {*range(ROBOTS[0], ROBOTS[1] + 1)}
    assert any(-1 in layout.goals for layout in drawn)
    ends = [[beside(layout.cells, cell) for cell in layout.cells] for layout in drawn]
    assert any(1 in each for each in ends)  # a dead end or a bay
    assert any(3 in each for each in ends)  # a junction
    assert any(4 in each for each in ends)  # a crossing
    assert any(sum(each) // 2 >= len(each) for each in ends)  # a way round


def beside(cells, cell):
    """Return how many cells are beside one."""
    row, column = cell
    near = {(row + 1, column), (row - 1, column), (row, column + 1), (row, column - 1)}
    return len(near & {*cells})


def test_a_layout_can_be_read_from_the_map_that_it_is_written_as():
    for layout in map(draw, range(30)):
        assert layout_of(str(layout)) == layout


def test_a_cell_has_room_for_one_robot_and_walls_around_it():
    layout = layout_of("a . A\n# . #")
    field = ClearanceField.of(site_of(layout).grid)
    middles = [(WALL + CELL * (x + 0.5), WALL + CELL * (y + 0.5)) for y, x in layout.cells]
    wall = WALL + CELL * 0.5, WALL + CELL * 1.5

    assert all(0.43 < field.at(*middle) < 0.86 for middle in middles)
    assert field.at(*wall) == 0.0


@pytest.mark.parametrize("first", range(0, 200, 50))
def test_one_search_over_the_places_of_all_robots_solves_what_the_complete_search_does(first):
    assert all(solves(draw(seed)) for seed in range(first, first + 50))


def solves(layout):
    """Return whether the traffic planner's search leads all to their goals, none too near."""
    field = ClearanceField.of(site_of(layout).grid)
    middles = [(WALL + CELL * (x + 0.5), WALL + CELL * (y + 0.5)) for y, x in layout.cells]
    starts = [middles[start] for start in layout.starts]
    goals = {k: middles[goal] for k, goal in enumerate(layout.goals) if goal >= 0}
    rows = {k: len(starts) + row for row, k in enumerate(goals)}
    points = np.array([*starts, *goals.values()])
    roadmap = build_roadmap(field, [RADIUS])
    radii = np.full(len(points), RADIUS)
    ends = joined_ends(roadmap, field, points, radii, [*rows.items()], [], range(len(starts)))
    agents = [
        Agent(at, 0.0, 0.0, int(ends.index[rows.get(k, k)]), RADIUS, 1.8, 1.0, 3.14, k, dwell=5.0)
        for k, at in enumerate(ends.index[: len(starts)].tolist())
    ]
    planner = JointPlanner(roadmap)
    tables = planner.plan(agents, ends=ends, together=[range(len(agents))])
    return bool(planner.coupled) and all(table.complete for table in tables)
