# SPDX-License-Identifier: BSD-3-Clause
"""The places where fleets drive: a standard warehouse, people that walk, and lanes that close."""

from __future__ import annotations

import numpy as np
import pytest
from shapely.geometry import Point

from hive_lab.fleets.sites import CELL, CELLS, LANE, PERSON, SITES, WALL, warehouse, with_people
from hive_navigation.mapf.reachability import unreached
from hive_navigation.mapf.roadmap_builder import build_roadmap
from hive_navigation.mapf.zones import roadmap_with
from hive_navigation.planning.clearance import ClearanceField

RADIUS = 0.43  # of an LD-60 [m]


def test_the_warehouse_has_ten_shelves_of_ten_cells_with_three_free_rows_between():
    site = warehouse()
    columns, rows = CELLS
    solid = np.array(
        [
            [
                site.world.solid.covers(Point(WALL + CELL * (x + 0.5), WALL + CELL * (y + 0.5)))
                for x in range(columns)
            ]
            for y in range(rows)
        ]
    )

    assert np.flatnonzero(solid.any(axis=1)).tolist() == [2, 6, 10, 14, 18]
    assert np.flatnonzero(solid[2]).tolist() == [*range(7, 17), *range(18, 28)]
    assert solid.sum() == 100


@pytest.mark.parametrize("name", SITES)
def test_people_walk_where_the_world_lets_them_and_others_with_another_seed(name):
    site = SITES[name]()
    crowded, again, other = (with_people(site, 5, seed) for seed in (1, 1, 2))

    assert list(crowded.world.mistakes()) == []
    assert len(crowded.world.people) == 5
    assert crowded.world.people == again.world.people
    assert crowded.world.people != other.world.people
    assert {person.radius for person in crowded.world.people} == {PERSON}
    assert crowded.grid is site.grid


@pytest.mark.parametrize(
    ("name", "one", "other"),
    [
        ("lab", (6.0, 3.2), (13.0, 3.2)),
        ("hall", (21.0, 5.0), (21.0, 12.0)),
        ("warehouse", (7.6, 10.4), (22.6, 10.4)),
    ],
)
def test_a_lane_that_closes_leaves_another_way_from_one_side_to_the_other(name, one, other):
    site = SITES[name]()
    field = ClearanceField.of(site.grid)
    roadmap = build_roadmap(field, [RADIUS], site.zones)
    left, low, right, high = site.lane
    inside = {"inside": ((left + right) / 2, (low + high) / 2)}

    assert unreached(roadmap, field, RADIUS, one, {"other": other} | inside) == []
    closed = roadmap_with(roadmap, {LANE})
    assert unreached(closed, field, RADIUS, one, {"other": other} | inside) == ["inside"]
