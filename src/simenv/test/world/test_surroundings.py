# SPDX-License-Identifier: BSD-3-Clause
from dataclasses import replace

import numpy as np
import pytest
from shapely.geometry import LineString, MultiLineString, Point, box

from simenv.testing import hall
from simenv.world.surroundings import WALLS, Surroundings
from simenv.world.world_content import Person


class Lines:
    """A world of lines between random points, some far outside of the others."""

    people = doors = ()

    def __init__(self, number):
        random = np.random.default_rng(5)
        start = random.uniform(-25, 25, (number, 1, 2))
        self.segments = np.concatenate([start, start + random.normal(0, 2, start.shape)], axis=1)


def found(near, place):
    return slice(near.starts[place], near.starts[place + 1])


@pytest.mark.parametrize("reach", [0.3, 3.0, 200.0])
def test_walls_within_reach_are_found_once_each_and_few_others(reach):
    world = Lines(400)
    places = np.random.default_rng(6).uniform(-30, 30, (40, 3))

    near = Surroundings(world).near(places, np.full(40, reach))

    assert (near.things == WALLS).all()
    for place in range(40):
        got = sorted(segment.tobytes() for segment in near.segments[found(near, place)])
        distances = [LineString(s).distance(Point(places[place, :2])) for s in world.segments]
        must = {s.tobytes() for s, d in zip(world.segments, distances, strict=True) if d <= reach}
        assert len(set(got)) == len(got)
        assert must <= set(got)
        assert len(got) <= sum(d <= 1.5 * (reach + 5.0) for d in distances)


def test_a_world_without_walls_has_nothing_near():
    near = Surroundings(Lines(0)).near(np.zeros((2, 3)), np.full(2, 5.0))

    assert len(near.segments) == 0
    assert near.starts.tolist() == [0, 0, 0]


def test_obstacles_within_reach_come_with_their_numbers():
    anna = Person("anna", ((8.0, 8.0), (8.0, 2.0)), radius=0.25)
    surroundings = Surroundings(replace(hall(), people=(anna,)))
    surroundings.obstacles.put("crate", box(2.0, 2.0, 3.0, 3.0))

    near = surroundings.near(np.array([[3.2, 2.5], [5.0, 5.0], [7.5, 8.0]]), np.full(3, 0.5))

    assert [set(near.things[found(near, place)]) for place in range(3)] == [{1}, set(), {2}]
    crate = MultiLineString(near.segments[found(near, 0)].tolist())
    assert crate.equals(box(2.0, 2.0, 3.0, 3.0).exterior)
    surroundings.obstacles.take("crate")
    assert len(surroundings.near(np.array([[3.2, 2.5]]), np.array([0.5])).segments) == 0
