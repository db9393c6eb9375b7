# SPDX-License-Identifier: BSD-3-Clause
"""Robots that no order gets through are planned in one search, and get through."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from hive_lab.mapf.testing import grid_map, nearest, robot
from hive_navigation.mapf import joint_planner
from hive_navigation.mapf.bodies import Body
from hive_navigation.mapf.joint_planner import JointPlanner, PlannerSettings, Timetable

DWELL = 5.0
TOGETHER = ((0, 1, 2),)

JUNCTION = ["####.###", "####.###", "####.###", "........"]


def junction(**more):
    """Return three robots of which each has to give way: one is idle, at the goal of another."""
    roadmap, number = grid_map(JUNCTION)
    agents = [
        robot(number[3, 4], number[3, 0], **more),
        robot(number[2, 4], number[3, 3], heading=math.pi / 2),
        robot(number[3, 0], number[3, 0]),
    ]
    return roadmap, number, [replace(agent, dwell=DWELL) for agent in agents]


def gap(roadmap, agents, tables):
    """Return the least room between robots until the first of them gets another task [m]."""
    until = min(t.arrives[-1] for a, t in zip(agents, tables, strict=True) if a.start != a.goal)
    return nearest(roadmap, agents, [cut(table, until + DWELL) for table in tables])


def cut(table, until):
    """Return a timetable without what begins after a time."""
    count = 1 + sum(leaves < until for leaves in table.leaves[:-1])
    return replace(
        table,
        places=table.places[:count],
        arrives=table.arrives[:count],
        leaves=(*table.leaves[: count - 1], math.inf),
    )


def test_robots_that_no_order_gets_through_get_through_in_one_search():
    roadmap, _, agents = junction()

    one_by_one = JointPlanner(roadmap).plan(agents)
    together = JointPlanner(roadmap).plan(agents, together=TOGETHER)

    assert not all(table.complete for table in one_by_one)
    assert all(table.complete for table in together)
    assert gap(roadmap, agents, together) >= 0.1 - 1e-6


def test_who_is_in_the_way_of_a_group_and_cannot_get_out_of_it_joins_it():
    roadmap, _, agents = junction()
    planner = JointPlanner(roadmap)

    tables = planner.plan(agents, together=((0,),))

    assert [sorted(group) for group in planner.coupled] == [[0, 1, 2]]
    assert all(table.complete for table in tables)


def test_two_groups_that_hinder_each_other_become_one():
    roadmap, _, agents = junction()
    planner = JointPlanner(roadmap)

    tables = planner.plan(agents, together=((0,), (1, 2)))

    assert [sorted(group) for group in planner.coupled] == [[0, 1, 2]]
    assert all(table.complete for table in tables)


def test_a_group_of_more_robots_than_a_search_can_take_is_planned_one_by_one(monkeypatch):
    monkeypatch.setattr(joint_planner, "MOST_TOGETHER", 2)
    roadmap, _, agents = junction()
    planner = JointPlanner(roadmap)

    tables = planner.plan(agents, together=((0,),))

    assert planner.coupled == ()
    assert tables == JointPlanner(roadmap).plan(agents)


def test_robots_that_cannot_get_past_each_other_at_all_are_planned_one_by_one():
    roadmap, number = grid_map(["...."])
    agents = [robot(number[0, 0], number[0, 3]), robot(number[0, 3], number[0, 0])]
    planner = JointPlanner(roadmap)

    tables = planner.plan(agents, together=((0, 1),))

    assert planner.coupled == ()
    assert nearest(roadmap, agents, tables) >= 0.1 - 1e-6


def test_a_robot_that_stays_is_never_pushed():
    roadmap, number, agents = junction()
    agents[2] = replace(agents[2], stays=True)
    planner = JointPlanner(roadmap)

    tables = planner.plan(agents, together=TOGETHER)

    assert tables[2].places == (number[3, 0],)
    assert nearest(roadmap, agents, tables) >= 0.1 - 1e-6


def test_a_group_goes_on_with_its_plan_in_the_same_order():
    roadmap, _, agents = junction()
    planner = JointPlanner(roadmap)
    first = planner.plan(agents, together=TOGETHER)

    # The first robot was held up for 3 s before it has set out.
    late = [replace(agents[0], ready=3.0), *agents[1:]]
    again = planner.plan(late, first, together=TOGETHER)

    assert [table.places for table in again] == [table.places for table in first]
    assert gap(roadmap, late, again) >= 0.1 - 1e-6


def test_a_group_is_planned_anew_when_something_is_in_its_way():
    roadmap, number, agents = junction()
    planner = JointPlanner(roadmap, PlannerSettings())
    first = planner.plan(agents, together=TOGETHER)
    box = Body(0.2, ((*roadmap.places[number[3, 6]], math.inf),))

    again = planner.plan(agents, first, [box], together=TOGETHER)

    assert all(table.complete for table in again)
    assert not {number[3, 6], number[3, 7]} & {p for table in again for p in table.places}


def test_drives_that_touch_nobody_begin_at_once():
    roadmap, number = grid_map([".....", ".####", "....."])
    agents = [robot(number[0, 0], number[0, 4]), robot(number[2, 0], number[2, 4])]

    one, other = JointPlanner(roadmap).plan(agents, together=((0, 1),))

    assert one.leaves[0] == other.leaves[0] == 0.0
    assert one.arrives == pytest.approx(other.arrives)


def test_others_that_are_not_in_the_group_are_planned_around_it():
    roadmap, number = grid_map(["....", "...."])
    agents = [
        robot(number[0, 0], number[0, 3]),
        robot(number[0, 3], number[0, 0], heading=math.pi),
        robot(number[1, 3], number[1, 0], heading=math.pi),
    ]
    planner = JointPlanner(roadmap)

    tables = planner.plan(agents, together=((0, 1),))

    assert planner.coupled == [[0, 1]]
    assert all(table.complete for table in tables)
    assert nearest(roadmap, agents, tables) >= 0.1 - 1e-6


def test_a_robot_whose_goal_is_far_away_gets_as_far_as_it_is_searched():
    roadmap, number = grid_map(["." * 30])
    planner = JointPlanner(roadmap)

    (table,) = planner.plan([robot(number[0, 0], number[0, 29])], together=((0,),))

    assert not table.complete
    assert roadmap.places[table.places[-1]] == pytest.approx(np.array([9.6, 0.0]))


def test_a_large_robot_takes_no_lane_that_only_a_small_one_fits():
    roadmap, number = grid_map(["...", "..."])
    lane = [tuple(pair) for pair in roadmap.lanes].index((number[0, 0], number[0, 1]))
    widths = roadmap.widths.copy()
    widths[lane] = 0.35
    roadmap = replace(roadmap, widths=widths)
    agents = [
        robot(number[0, 0], number[0, 2], radius=0.4),
        robot(number[1, 0], number[1, 2], radius=0.2),
    ]

    large, small = JointPlanner(roadmap).plan(agents, together=((0, 1),))

    assert large.complete
    assert small.complete
    assert (number[0, 0], number[0, 1]) != large.places[:2]


def ring(**more):
    """Return a robot that drives from one corner of a ring to the next, and the long way round."""
    roadmap, number = grid_map(["...", ".#.", "..."], **more)
    long_way = tuple(
        number[cell] for cell in ((0, 0), (1, 0), (2, 0), (2, 1), (2, 2), (1, 2), (0, 2))
    )
    return roadmap, number, robot(number[0, 0], number[0, 2]), long_way


def test_a_group_goes_round_what_stays_in_the_way_for_ever():
    roadmap, number, agent, long_way = ring()
    standing = robot(number[0, 1], number[0, 1], stays=True)

    table, _ = JointPlanner(roadmap).plan([agent, standing], together=((0,),))

    assert table.places == long_way


def test_a_group_stops_nowhere_where_nobody_may():
    stop = np.ones(8, dtype=bool)
    stop[1] = False
    roadmap, _, agent, long_way = ring(stop=stop)

    (table,) = JointPlanner(roadmap).plan([agent], together=((0,),))

    assert table.places == long_way


def test_a_group_keeps_a_plan_that_holds_though_there_is_a_shorter_one():
    roadmap, _, agent, long_way = ring()
    times = tuple(2.0 * k for k in range(len(long_way)))
    before = Timetable(long_way, times, (*times[:-1], math.inf), complete=True, coupled=True)

    (table,) = JointPlanner(roadmap).plan([agent], [before], together=((0,),))

    assert table.places == long_way
