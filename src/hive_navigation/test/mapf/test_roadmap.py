# SPDX-License-Identifier: BSD-3-Clause
"""The roadmap: it fits the map, connects what is connected, and makes paths hardly longer."""

from __future__ import annotations

from functools import lru_cache
from typing import TYPE_CHECKING

import numpy as np
import pytest
from scipy import ndimage, sparse
from scipy.sparse import csgraph

import hive_common.distances
from hive_common.grid_map import GridMap
from hive_common.map_file import load_map
from hive_common.zone import Zone
from hive_lab.bench.shortest_paths import ShortestPaths, path_length, random_pairs
from hive_lab.fleets import sites
from hive_lab.mapf.joined_map import with_ends
from hive_navigation.mapf.ends import joined_ends
from hive_navigation.mapf.reachability import unreached
from hive_navigation.mapf.roadmap import Roadmap, need
from hive_navigation.mapf.roadmap_builder import build_roadmap
from hive_navigation.planning.clearance import ClearanceField

if TYPE_CHECKING:
    from hive_common.geometry import Array

LD60, MIR100, YOUBOT, FETCH = 0.430, 0.531, 0.347, 0.302  # radii [m]
CELL = 1.2  # of the warehouse that the tests draw [m]
FINE = 24  # cells of the map in one of those

WAREHOUSE = """
...............
...............
..TTTTT.TTTTT..
...............
..TTTTT.TTTTT..
..TTTTT.TTTTT..
...............
...............
...............
"""
"""Shelves T; its aisles are one cell wide, and three below."""


def drawn(text: str) -> GridMap:
    """Return the map of a drawing with cells of 1.2 m."""
    rows = text.split()
    shelves = np.array([[cell == "T" for cell in row] for row in reversed(rows)])
    return GridMap.of_blocked(np.kron(shelves, np.ones((FINE, FINE), dtype=bool)), CELL / FINE)


def rooms(door: float) -> GridMap:
    """Return two rooms of 5 m x 6 m, and a door around y 2.03 between them."""
    blocked = np.zeros((120, 204), dtype=bool)
    blocked[:, 100:104] = True
    low = round((2.03 - door / 2) / 0.05)
    blocked[low : low + round(door / 0.05), 100:104] = False
    return GridMap.of_blocked(blocked, 0.05)


FIELDS = {
    "warehouse": lambda: drawn(WAREHOUSE),
    "lab": lambda: load_map("lab"),
    "hall": lambda: sites.hall().grid,
    "narrow door": lambda: rooms(1.2),
}
FLEETS = {
    "warehouse": (LD60,),
    "lab": (LD60, MIR100, YOUBOT),
    "hall": (MIR100, LD60, YOUBOT, FETCH),
    "narrow door": (LD60, MIR100),
}
SIZES = [(name, radius) for name, radii in FLEETS.items() for radius in radii]


@lru_cache
def built(name: str) -> tuple[Roadmap, ClearanceField]:
    field = ClearanceField.of(FIELDS[name]())
    return build_roadmap(field, FLEETS[name]), field


def parts(roadmap: Roadmap, radius: float) -> np.ndarray:
    """Return to which connected part each place belongs for a robot, -1 for those too narrow."""
    fits = roadmap.widths >= need(radius)
    count = len(roadmap.places)
    links = sparse.coo_matrix((np.ones(fits.sum()), roadmap.lanes[fits].T), shape=(count, count))
    labels = csgraph.connected_components(links, connection="strong")[1]
    return np.where(roadmap.room >= need(radius), labels, -1)


@pytest.mark.parametrize(("name", "radius"), SIZES)
def test_lanes_connect_what_free_space_connects_for_each_size(name: str, radius: float) -> None:
    roadmap, field = built(name)
    regions, count = ndimage.label(field.clearance >= need(radius))
    cells = np.array([field.grid.cell(tuple(place)) for place in roadmap.places])
    region = regions[cells[:, 0], cells[:, 1]]
    part = parts(roadmap, radius)
    both = np.unique(np.column_stack([region, part])[part >= 0], axis=0)

    assert both[:, 0].tolist() == list(range(1, count + 1))
    assert len(set(both[:, 1])) == count


@pytest.mark.parametrize(("name", "radius"), SIZES)
def test_every_free_point_reaches_a_place_near_it_straight(name: str, radius: float) -> None:
    roadmap, field = built(name)
    rows, columns = np.nonzero(field.clearance >= need(radius))
    points = (np.column_stack([columns, rows])[::7] + 0.5) * 0.05
    ends = joined_ends(roadmap, field, points, np.full(len(points), radius))
    count = len(roadmap.places)
    legs = ends.legs[ends.legs[:, 0] >= count]
    begins, stops = ends.points[legs[:, 0] - count], roadmap.places[legs[:, 1]]
    nearest = np.full(len(ends.points), np.inf)
    np.minimum.at(nearest, legs[:, 0] - count, np.hypot(*(stops - begins).T))

    assert field.lines_are_clear(begins, stops, need(radius)).all()
    assert nearest.max() <= 1.6 * roadmap.spacing


@pytest.mark.parametrize("name", FLEETS)
def test_lanes_are_as_wide_as_they_say_and_lead_both_ways(name: str) -> None:
    roadmap, field = built(name)
    a, b = (roadmap.places[ends] for ends in roadmap.lanes.T)

    assert roadmap.widths.min() >= need(min(FLEETS[name]))
    for radius in FLEETS[name]:
        fits = roadmap.widths >= need(radius)
        assert field.lines_are_clear(a[fits], b[fits], need(radius)).all()
    ways = set(map(tuple, roadmap.lanes.tolist()))
    assert len(ways) == len(roadmap.lanes)
    assert ways == {(there, here) for here, there in ways}
    assert (np.diff(roadmap.lanes[:, 0]) >= 0).all()
    for place in (0, len(roadmap.places) // 2, len(roadmap.places) - 1):
        lanes = roadmap.lanes[roadmap.begins[place] : roadmap.begins[place + 1]]
        assert (lanes[:, 0] == place).all()
    assert roadmap.begins[-1] == len(roadmap.lanes)
    assert roadmap.lengths == pytest.approx(np.hypot(*(b - a).T))


def test_each_free_cell_of_a_warehouse_has_its_place_in_the_middle() -> None:
    roadmap, _ = built("warehouse")
    rows = list(reversed(WAREHOUSE.split()))
    middles = [
        ((column + 0.5) * CELL, (row + 0.5) * CELL)
        for row, cells in enumerate(rows)
        for column, cell in enumerate(cells)
        if cell == "."
    ]
    away = np.hypot(*(roadmap.places[:, None] - np.array(middles)[None]).T)

    assert roadmap.spacing == pytest.approx(CELL)
    assert len(roadmap.places) == len(middles)
    assert away.min(axis=1).max() < 0.1


def test_a_lane_leads_through_the_middle_of_a_door_that_one_robot_fits() -> None:
    roadmap, _ = built("narrow door")
    starts, stops = (roadmap.places[ends] for ends in roadmap.lanes.T)
    through = (starts[:, 0] < 5.0) & (stops[:, 0] >= 5.0) & (roadmap.widths >= need(MIR100))

    assert through.any()
    assert (np.abs(stops[through][:, 1] - 2.03) < 0.1).all()


def test_aisles_at_odd_distances_get_their_lanes_in_their_middle() -> None:
    blocked = np.ones((240, 160), dtype=bool)
    blocked[:, :30] = blocked[:, -30:] = False
    middles = (1.0, 3.35, 5.1, 8.25, 10.9)
    for middle in middles:
        low = round((middle - 0.6) / 0.05)
        blocked[low : low + 24] = False
    field = ClearanceField.of(GridMap.of_blocked(blocked, 0.05))
    roadmap = build_roadmap(field, (LD60,))
    between = np.abs(roadmap.places[:, 0] - 4.0) < 1.5
    off = np.abs(roadmap.places[between, 1:] - np.array(middles))

    assert set(off.argmin(axis=1)) == set(range(len(middles)))
    assert off.min(axis=1).max() <= 0.05


def test_a_robot_too_wide_for_a_door_stays_in_its_room_on_the_same_roadmap() -> None:
    field = ClearanceField.of(rooms(0.95))
    roadmap = build_roadmap(field, (LD60, MIR100))
    left = roadmap.places[:, 0] < 5.0

    for radius, connected in ((LD60, True), (MIR100, False)):
        part = parts(roadmap, radius)
        shared = set(part[left & (part >= 0)]) & set(part[~left & (part >= 0)])
        assert bool(shared) == connected


def test_two_lanes_stay_beside_each_other_where_two_robots_pass() -> None:
    blocked = np.ones((60, 400), dtype=bool)
    blocked[10:50, 10:390] = False
    field = ClearanceField.of(GridMap.of_blocked(blocked, 0.05))
    roadmap = build_roadmap(field, (LD60,))
    middle = roadmap.places[np.abs(roadmap.places[:, 0] - 10.0) < 3.0]
    heights = sorted({round(y, 2) for y in middle[:, 1]})

    assert len(heights) == 2
    assert heights[1] - heights[0] >= 2 * LD60 + 0.1


def test_the_same_map_gives_the_same_roadmap() -> None:
    roadmap, field = built("lab")
    again = build_roadmap(field, FLEETS["lab"])

    assert np.array_equal(again.places, roadmap.places)
    assert np.array_equal(again.lanes, roadmap.lanes)


@pytest.mark.parametrize(
    ("name", "radius"), [("warehouse", LD60), ("lab", LD60), ("lab", MIR100), ("hall", LD60)]
)
def test_a_robot_alone_drives_hardly_farther_than_the_shortest_path(
    name: str, radius: float
) -> None:
    roadmap, field = built(name)
    pairs = list(random_pairs(ShortestPaths(field, need(radius), radius + 0.05), 20, seed=2))
    paths = [path_on(roadmap, field, start, goal, radius) for start, goal, _ in pairs]
    lengths = np.array([length for _, _, length in pairs])
    driven = np.array([path_length(list(map(tuple, path))) for path in paths])
    assert driven.sum() <= 1.08 * lengths.sum()


def path_on(
    roadmap: Roadmap,
    field: ClearanceField,
    start: tuple[float, float],
    goal: tuple[float, float],
    radius: float,
) -> Array:
    """Return the corners (n, 2) of the shortest path on the roadmap, none if it has none."""
    joined, (begin, end) = with_ends(
        roadmap, field, np.array([start, goal]), np.array([radius, radius]), [(0, 1)]
    )
    fits = joined.widths >= need(radius)
    count = len(joined.places)
    ways = sparse.csr_matrix((joined.lengths[fits], joined.lanes[fits].T), shape=(count, count))
    came = csgraph.dijkstra(ways, indices=begin, return_predecessors=True)[1]
    chain = [end]
    while chain[-1] != begin and chain[-1] >= 0:
        chain.append(came[chain[-1]])
    return joined.places[chain[::-1]] if chain[-1] == begin else np.empty((0, 2))


DOORS = {
    "lower": ((9.4, 2.4), (10.6, 2.4), (10.6, 4.0), (9.4, 4.0)),
    "upper": ((9.4, 8.0), (10.6, 8.0), (10.6, 9.6), (9.4, 9.6)),
}
"""Of the lab; each is 1.2 m wide, and every robot fits through both."""


@pytest.mark.parametrize("radii", [FLEETS["hall"], FLEETS["lab"], (MIR100,)])
@pytest.mark.parametrize("shut", DOORS)
def test_a_second_door_has_lanes_for_every_robot_too(radii: tuple[float, ...], shut: str) -> None:
    field = ClearanceField.of(load_map("lab"))
    door = Zone(name=shut, kind="keep-out", corners=DOORS[shut], closed=True)
    roadmap = build_roadmap(field, radii, [door])
    rooms = {"east": (13.0, 5.5), "west": (6.5, 5.0)}

    for radius in radii:
        assert unreached(roadmap, field, radius, rooms["west"], rooms) == []
        assert unreached(roadmap, field, radius, rooms["east"], rooms) == []


def test_robots_start_and_end_exactly_where_they_are() -> None:
    roadmap, field = built("lab")
    points = np.array([(3.37, 4.12), (17.71, 1.03)])
    joined, index = with_ends(roadmap, field, points, np.array([LD60, LD60]))

    assert joined.places[index].tolist() == points.tolist()
    assert np.array_equal(joined.places[: len(roadmap.places)], roadmap.places)
    assert (np.diff(joined.begins)[index] > 0).all()
    assert len(path_on(roadmap, field, (3.37, 4.12), (17.71, 1.03), LD60))


def test_an_end_on_a_place_is_that_place() -> None:
    roadmap, field = built("lab")
    joined, index = with_ends(
        roadmap, field, roadmap.places[[5, 9]] + 0.001, np.array([YOUBOT, YOUBOT])
    )

    assert index.tolist() == [5, 9]
    assert len(joined.places) == len(roadmap.places)


def test_a_goal_in_sight_is_joined_right_to_its_robot() -> None:
    roadmap, field = built("lab")
    start, goal = (2.03, 2.07), (3.01, 4.02)

    assert path_on(roadmap, field, start, goal, LD60).tolist() == [list(start), list(goal)]


def test_a_robot_too_close_to_a_wall_may_leave() -> None:
    roadmap, field = built("lab")
    start = (0.5, 4.0)

    assert field.at(*start) < need(LD60)
    assert len(path_on(roadmap, field, start, (4.0, 4.0), LD60))


def test_a_point_in_a_wall_has_no_lane() -> None:
    roadmap, field = built("warehouse")
    joined, index = with_ends(roadmap, field, np.array([(4.8, 5.4)]), np.array([LD60]))

    assert joined.begins[index + 1] == joined.begins[index]


def test_who_waits_for_a_roadmap_is_told_of_each_step() -> None:
    steps: list[int] = []

    build_roadmap(ClearanceField.of(rooms(1.2)), [LD60], (), lambda: steps.append(1))

    assert len(steps) == 5


@pytest.mark.parametrize("seed", range(3))
def test_a_map_in_strips_has_the_roadmap_of_the_whole(
    seed: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    random = np.random.default_rng(seed)
    blocked = np.zeros((500, 90), dtype=bool)
    for row, column in random.integers((0, 0), (500, 90), (40, 2)):
        blocked[row : row + 9, column : column + 30] = True
    grid = GridMap.of_blocked(blocked, 0.05)
    whole = build_roadmap(ClearanceField.of(grid), [YOUBOT])
    monkeypatch.setattr(hive_common.distances, "CELLS", 1)

    roadmap = build_roadmap(ClearanceField.of(grid), [YOUBOT])

    assert np.array_equal(roadmap.places, whole.places)
    assert np.array_equal(roadmap.lanes, whole.lanes)
    assert np.array_equal(roadmap.may_park, whole.may_park)
