# SPDX-License-Identifier: BSD-3-Clause
"""Zones on the roadmap, places to park, and places that nobody reaches."""

from __future__ import annotations

import math
from functools import lru_cache

import numpy as np
import pytest
from scipy import sparse
from scipy.sparse import csgraph
from shapely.geometry import LineString, Polygon

from hive_common.grid_map import GridMap
from hive_common.zone import Zone
from hive_lab.mapf.joined_map import with_ends
from hive_navigation.mapf.ends import joined_ends
from hive_navigation.mapf.parking import may_park
from hive_navigation.mapf.reachability import unreached
from hive_navigation.mapf.roadmap import Roadmap, need
from hive_navigation.mapf.roadmap_builder import build_roadmap
from hive_navigation.mapf.zones import inside, roadmap_with, with_zones
from hive_navigation.planning.clearance import ClearanceField

RADIUS = 0.4
LEFT, RIGHT = (1.5, 4.0), (12.5, 4.0)  # a place in each room

DOOR = ((5.5, 1.0), (6.5, 1.0), (6.5, 3.0), (5.5, 3.0))
"""Around the lower one of the two doors."""


@lru_cache
def field() -> ClearanceField:
    """Return two rooms of 6 m x 8 m side by side, a corridor of 2 m length, and two doors.

    The doors to the corridor at x 6 to 8, y 1.4 to 2.6 and y 5.4 to 6.6, fit one robot.
    """
    blocked = np.zeros((160, 280), dtype=bool)
    blocked[:, 120:160] = True
    blocked[28:52, 120:160] = False
    blocked[108:132, 120:160] = False
    return ClearanceField.of(GridMap.of_blocked(blocked, 0.05))


@lru_cache
def base() -> Roadmap:
    return build_roadmap(field(), (RADIUS,))


def zone(kind: str, corners: tuple = DOOR, **more: object) -> Zone:
    return Zone(name="here", kind=kind, corners=corners, **more)


def way(roadmap: Roadmap, start: tuple, goal: tuple, radius: float = RADIUS) -> np.ndarray:
    """Return the corners (n, 2) of the shortest path, none if there is none."""
    joined, (begin, end) = with_ends(roadmap, field(), np.array([start, goal]), [radius] * 2)
    fits = joined.widths >= need(radius)
    count = len(joined.places)
    ways = sparse.csr_matrix((joined.lengths[fits], joined.lanes[fits].T), shape=(count, count))
    came = csgraph.dijkstra(ways, indices=begin, return_predecessors=True)[1]
    chain = [end]
    while chain[-1] != begin and chain[-1] >= 0:
        chain.append(came[chain[-1]])
    return joined.places[chain[::-1]] if chain[-1] == begin else np.empty((0, 2))


def uses_lower_door(path: np.ndarray) -> bool:
    assert len(path)
    between = path[(path[:, 0] > 5.5) & (path[:, 0] < 8.5)]
    return bool((between[:, 1] < 4.0).any())


LOWER, ACROSS = (1.5, 2.0), (12.5, 2.0)  # the way between them leads through the lower door


def test_nobody_enters_a_zone_that_keeps_out_and_all_go_round() -> None:
    roadmap = with_zones(base(), [zone("keep-out")])

    assert uses_lower_door(way(base(), LOWER, ACROSS))
    assert not uses_lower_door(way(roadmap, LOWER, ACROSS))


def test_no_part_of_a_robot_enters_a_zone_that_keeps_out() -> None:
    strip = ((2.9, 0.0), (3.1, 0.0), (3.1, 6.95), (2.9, 6.95))
    roadmap = with_zones(base(), [zone("keep-out", strip)])

    assert not len(way(roadmap, (1.5, 2.0), (4.5, 2.0), 0.6))
    path = way(roadmap, (1.5, 2.0), (4.5, 2.0), 0.4)
    assert LineString(path).distance(Polygon(strip)) >= 0.4


def test_a_robot_inside_a_closed_zone_leaves_it_and_none_gets_in() -> None:
    room = ((0.0, 0.0), (6.0, 0.0), (6.0, 8.0), (0.0, 8.0))
    roadmap = with_zones(base(), [zone("slow", room, speed=0.3, closed=True)])

    assert len(way(roadmap, LEFT, RIGHT))
    assert not len(way(roadmap, RIGHT, LEFT))


def test_zones_close_and_open_while_the_places_stay() -> None:
    first = with_zones(base(), [zone("no-stopping"), zone("parking")])
    shut = roadmap_with(first, {"here"})
    again = roadmap_with(shut, ())

    assert shut.closed == {"here"}
    assert not uses_lower_door(way(shut, LOWER, ACROSS))
    assert np.array_equal(again.lanes, first.lanes)
    assert np.array_equal(again.may_stop, first.may_stop)
    assert np.array_equal(shut.places, first.places)


def test_a_one_way_zone_is_passed_in_its_direction_only() -> None:
    roadmap = with_zones(base(), [zone("one-way", direction=0.0)])

    assert uses_lower_door(way(roadmap, LOWER, ACROSS))
    assert not uses_lower_door(way(roadmap, ACROSS, LOWER))


def test_a_one_way_zone_may_be_crossed() -> None:
    band = ((2.0, 0.0), (4.0, 0.0), (4.0, 8.0), (2.0, 8.0))
    roadmap = with_zones(base(), [zone("one-way", band, direction=math.pi / 2)])

    assert len(way(roadmap, (1.0, 4.0), (5.0, 4.0)))
    assert len(way(roadmap, (5.0, 4.0), (1.0, 4.0)))
    down = way(roadmap, (3.0, 7.0), (3.0, 1.0))
    assert ((down[:, 0] < 2.0) | (down[:, 0] > 4.0)).any()


def test_lanes_through_a_slow_zone_are_slow_and_the_others_are_not() -> None:
    roadmap = with_zones(base(), [zone("slow", speed=0.2)])
    joined, index = with_ends(roadmap, field(), np.array([(6.0, 2.0)]), [RADIUS])
    through = inside(np.array(DOOR), joined.places[joined.lanes].mean(axis=1))

    assert through.any()
    assert (joined.speeds[through] == 0.2).all()
    assert (joined.speeds[joined.begins[index[0]] : joined.begins[index[0] + 1]] == 0.2).all()
    far = (joined.places[joined.lanes][:, :, 0] > 8.0).all(axis=1)
    assert np.isinf(joined.speeds[far]).all()


def test_nobody_stops_or_parks_in_a_no_stopping_zone_except_at_a_goal() -> None:
    room = ((0.0, 0.0), (6.0, 0.0), (6.0, 8.0), (0.0, 8.0))
    roadmap = with_zones(base(), [zone("no-stopping", room)])
    here = inside(np.array(room), roadmap.places)

    assert here.any()
    assert not roadmap.may_stop[here].any()
    assert not roadmap.may_park[here].any()
    assert roadmap.may_stop[~here].all()
    ends = joined_ends(roadmap, field(), np.array([(3.03, 3.07)]), [RADIUS])
    assert not ends.may_park.any()


def test_an_at_most_zone_names_its_places_and_the_lanes_through_it() -> None:
    roadmap = with_zones(
        base(), [zone("at-most", robots=1), zone("keep-out", ((1, 6), (2, 6), (2, 7)))]
    )
    (limit,) = roadmap.limits

    assert limit.robots == 1
    assert limit.places.tolist() == np.flatnonzero(inside(np.array(DOOR), roadmap.places)).tolist()
    lanes = roadmap.places[roadmap.lanes]
    passing = inside(np.array(DOOR), lanes.mean(axis=1))
    listed = np.zeros(len(lanes), dtype=bool)
    listed[limit.lanes] = True
    assert listed[passing].all()
    assert not listed[(lanes[:, :, 0] > 7.0).all(axis=1)].any()


def test_a_parking_zone_between_the_places_gets_a_place_of_its_own() -> None:
    spot = ((6.9, 1.95), (7.1, 1.95), (7.1, 2.05), (6.9, 2.05))
    roadmap = build_roadmap(field(), (RADIUS,), [zone("parking", spot)])
    here = inside(np.array(spot), roadmap.places)

    assert here.any()
    assert roadmap.may_park[here].all()


def test_a_robot_parks_in_rooms_and_never_in_doors_or_before_them() -> None:
    x, y = base().places.T
    in_corridor = (x > 5.6) & (x < 8.4)
    before_a_door = (x > 5.0) & (x <= 6.0) & (np.abs(y - 2.0) < 0.5)
    in_corner = (x < 0.8) & (y < 0.8)

    assert in_corridor.any()
    assert not base().may_park[in_corridor | before_a_door].any()
    assert in_corner.any()
    assert base().may_park[in_corner].all()
    assert may_park(field(), np.array([(0.43, 0.43)]), RADIUS).all()


def test_each_robot_parks_and_a_way_stays_free_past_any_of_them() -> None:
    middle = base().places[base().may_park]
    regions = []
    for place in middle[::5]:
        away = np.hypot(*(base().places - place).T)
        fits = (base().room >= need(RADIUS)) & (away >= 2 * RADIUS + 0.1)
        links = base().lanes[fits[base().lanes].all(axis=1)]
        count = len(base().places)
        graph = sparse.coo_matrix((np.ones(len(links)), links.T), shape=(count, count))
        labels = csgraph.connected_components(graph)[1]
        regions.append(len(set(labels[fits])))

    assert len(regions) > 5
    assert set(regions) == {1}


def test_a_map_of_aisles_for_one_robot_has_no_way_past_a_parked_one() -> None:
    blocked = np.ones((60, 200), dtype=bool)
    blocked[18:42, 10:190] = False
    narrow = ClearanceField.of(GridMap.of_blocked(blocked, 0.05))
    roadmap = build_roadmap(narrow, (RADIUS,))
    middle = np.abs(roadmap.places[:, 0] - 5.0) < 3.0

    assert middle.any()
    assert not roadmap.may_park[middle].any()


@pytest.mark.parametrize(
    ("radius", "names"), [(0.4, ["in a wall"]), (0.65, ["in a wall", "right"])]
)
def test_what_a_robot_cannot_reach_is_named(radius: float, names: list[str]) -> None:
    roadmap = build_roadmap(field(), (0.4, 0.65))
    goals = {"left": (4.5, 6.5, 0.0), "in a wall": (7.0, 4.0, 0.0), "right": (12.5, 4.0, 1.57)}

    assert unreached(roadmap, field(), radius, LEFT, goals) == names


def test_what_a_closed_zone_cuts_off_is_named() -> None:
    wall = ((6.5, 0.0), (7.5, 0.0), (7.5, 8.0), (6.5, 8.0))
    roadmap = with_zones(base(), [zone("keep-out", wall)])

    assert unreached(roadmap, field(), RADIUS, LEFT, {"right": RIGHT}) == ["right"]
