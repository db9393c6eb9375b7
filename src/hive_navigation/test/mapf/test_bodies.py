# SPDX-License-Identifier: BSD-3-Clause
"""What bodies block is what they come near to, but for the ends that robots may still leave."""

from __future__ import annotations

import math

import numpy as np
import pytest
from shapely.geometry import LineString

from hive_lab.mapf.testing import CELL, grid_map, robot
from hive_navigation.mapf.bodies import Body
from hive_navigation.mapf.conflicts import Lines
from hive_navigation.mapf.joint_planner import JointPlanner

RADIUS, GAP = 0.3, 0.1


@pytest.mark.parametrize("seed", range(20))
def test_lines_are_near_to_others_if_shapely_says_so(seed):
    draw = np.random.default_rng(seed)
    some, others = draw.uniform(-4.0, 4.0, (30, 4)), draw.uniform(-4.0, 4.0, (60, 4))
    others[::3, 2:] = others[::3, :2]  # places are lines of no length
    limits = draw.uniform(0.1, 2.0, 30)

    one, other = Lines(others).near(some, limits)

    def line(points):
        return LineString(points.reshape(2, 2))

    expected = {
        (i, j)
        for i, limit in enumerate(limits)
        for j in range(len(others))
        if line(some[i]).distance(line(others[j])) < limit
    }
    assert set(zip(one.tolist(), other.tolist(), strict=True)) == expected


def test_lines_far_from_the_origin_are_found_and_of_none_none_is_near():
    line = np.array([[3e7, -4e7, 3e7 + 1.0, -4e7]])

    one, other = Lines(line).near(line + 0.2, np.array([0.3]))
    nothing, _ = Lines(line[:0]).near(line, np.array([0.3]))

    assert (one.tolist(), other.tolist()) == ([0], [0])
    assert not len(nothing)


def test_a_body_that_drives_blocks_each_part_of_its_track_until_it_has_left_it():
    roadmap, number = grid_map(["......"])
    body = Body(RADIUS, ((0.0, 0.0, 0.0), (2 * CELL, 0.0, 4.0), (4 * CELL, 0.0, math.inf)))
    agent = robot(number[0, 5], number[0, 0], radius=RADIUS, heading=math.pi)

    alone, beside = (JointPlanner(roadmap).plan([agent], [], bodies) for bodies in ([], [body]))

    assert alone[0].complete
    assert not beside[0].complete
    assert beside[0].places == (number[0, 5],)


def test_a_robot_waits_until_a_body_has_left():
    roadmap, number = grid_map(["......", "###.##"])
    there = roadmap.places[number[0, 2]]
    body = Body(RADIUS, ((*there, 0.0), (*there, 7.0)))
    agent = robot(number[0, 0], number[0, 5], radius=RADIUS)

    (table,) = JointPlanner(roadmap).plan([agent], [], [body])

    assert table.complete
    after = next(
        leave
        for place, leave in zip(table.places, table.leaves, strict=True)
        if roadmap.places[place][0] + CELL > there[0] - 2 * RADIUS - GAP
    )
    assert after >= 7.0
