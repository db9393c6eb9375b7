# SPDX-License-Identifier: BSD-3-Clause
from __future__ import annotations

import itertools
import math
import random
from dataclasses import replace

import numpy as np
import pytest

from hive_lab.mapf.testing import CELL, NEXT, grid_map, nearest, robot, where
from hive_navigation.mapf.bodies import Body
from hive_navigation.mapf.joint_planner import (
    Agent,
    JointPlanner,
    PlannerSettings,
    Timetable,
)
from hive_navigation.mapf.pushing import PushingFleet
from hive_navigation.mapf.roadmap import Limit

OPEN = ["........"] * 6
AISLES = ["..........", ".###.####.", "..........", ".####.###.", ".........."]
CORNER = ["...", ".##", ".##"]
DIAGONAL = (*NEXT, (1, 1), (1, -1), (-1, 1), (-1, -1))


def point(start, goal, priority=0.0):
    return Agent(start, 0.0, 0.0, goal, 0.0, 1.0, math.inf, math.inf, priority)


def meetings(tables):
    """Return how often two points are at one place or swap places, step by step."""
    end = round(max(table.arrives[-1] for table in tables)) + 1
    at = []
    for table in tables:
        line = []
        for place, leave in zip(table.places, table.leaves, strict=True):
            line += [place] * (min(end, leave) + 1 - len(line)).__int__()
        at.append(line)
    return sum(
        (one[t] == other[t]) or (one[t] == other[t - 1] and one[t - 1] == other[t])
        for one, other in itertools.combinations(at, 2)
        for t in range(1, end)
    )


def apart(roadmap, cells, radii, gap=0.1):
    """Return whether robots at places can all stand there."""
    return all(
        math.dist(roadmap.places[cells[i]], roadmap.places[cells[j]]) >= radii[i] + radii[j] + gap
        for i, j in itertools.combinations(range(len(cells)), 2)
    )


def drawn(roadmap, seed, count, radii):
    """Return robots at random places with random goals."""
    chance = random.Random(seed)
    sizes = [chance.choice(radii) for _ in range(count)]
    ends = []
    while len(ends) < 2:
        places = chance.sample(range(len(roadmap.places)), count)
        if apart(roadmap, places, sizes):
            ends.append(places)
    return [
        robot(start, goal, radius, chance.uniform(0.6, 1.4), chance.uniform(-3, 3), k)
        for k, (start, goal, radius) in enumerate(zip(*ends, sizes, strict=True))
    ]


@pytest.mark.parametrize("seed", range(12))
def test_no_two_robots_come_too_near_to_each_other(seed):
    steps = (NEXT, DIAGONAL)[seed % 2]
    roadmap, _ = grid_map((OPEN, AISLES)[seed // 2 % 2], steps)
    agents = drawn(roadmap, seed, 7, (0.25, 0.4, 0.5))

    tables = JointPlanner(roadmap).plan(agents)

    assert nearest(roadmap, agents, tables) >= 0.1 - 1e-5


@pytest.mark.parametrize("seed", range(12))
def test_no_two_points_meet_in_the_classical_problem(seed):
    roadmap, _ = grid_map((OPEN, AISLES)[seed % 2], cell=1.0)
    chance = random.Random(seed)
    starts, goals = (chance.sample(range(len(roadmap.places)), 12) for _ in range(2))
    agents = [point(start, goal) for start, goal in zip(starts, goals, strict=True)]
    settings = PlannerSettings(horizon=math.inf, classical=True)

    tables = JointPlanner(roadmap, settings).plan(agents)

    assert meetings(tables) == 0
    assert [table.places[0] for table in tables] == starts


def test_the_same_robots_give_the_same_plan():
    roadmap, _ = grid_map(AISLES)
    agents = drawn(roadmap, 5, 7, (0.25, 0.4))

    assert JointPlanner(roadmap).plan(agents) == JointPlanner(roadmap).plan(agents)


def test_a_robot_alone_drives_the_shortest_way():
    roadmap, number = grid_map(AISLES)
    agent = robot(number[0, 0], number[0, 9])

    (table,) = JointPlanner(roadmap).plan([agent])

    assert table.places == tuple(number[0, x] for x in range(10))
    assert table.arrives[-1] == pytest.approx(9 * CELL)
    assert table.complete


def test_turning_takes_time():
    roadmap, number = grid_map(["...", "..."])
    there = robot(number[0, 0], number[0, 2], heading=0.0)
    back = robot(number[0, 0], number[0, 2], heading=math.pi)

    (early,), (late,) = (JointPlanner(roadmap).plan([agent]) for agent in (there, back))

    assert late.arrives[-1] - early.arrives[-1] == pytest.approx(math.pi / 1.5 + 1.0 / 0.8)


def test_a_robot_that_stays_is_driven_around():
    roadmap, number = grid_map(["...", "..."])
    agents = [
        robot(number[0, 0], number[0, 2]),
        robot(number[0, 1], number[0, 1], stays=True),
    ]

    first, second = JointPlanner(roadmap).plan(agents)

    assert second.places == (number[0, 1],)
    assert first.complete
    assert number[0, 1] not in first.places


def test_an_idle_robot_makes_way_and_parks():
    park = np.array([False] * 3 + [True])
    roadmap, number = grid_map(
        [
            "....",
        ],
        park=park,
    )
    roadmap, number = grid_map(["...", "#.#"], park=park)
    agents = [robot(number[0, 0], number[0, 2]), robot(number[0, 1], number[0, 1])]

    first, second = JointPlanner(roadmap).plan(agents)

    assert first.complete
    assert second.places == (number[0, 1], number[1, 1])


def test_nobody_waits_where_nobody_may_stop():
    stop = np.ones(7, dtype=bool)
    stop[[1, 2, 3]] = False
    roadmap, number = grid_map([".....", "#.#.#"], stop=stop)
    agents = [
        robot(number[0, 4], number[0, 0], heading=math.pi, priority=0),
        robot(number[0, 0], number[0, 4], priority=1),
    ]

    tables = JointPlanner(roadmap).plan(agents)

    assert nearest(roadmap, agents, tables) >= 0.1 - 1e-5
    for table in tables:
        for place, arrive, leave in zip(table.places, table.arrives, table.leaves, strict=True):
            if not stop[place]:
                assert leave - arrive < math.pi / 1.5 + 1.0 / 0.8 + 1e-6


def test_a_plan_that_still_holds_is_kept():
    roadmap, _ = grid_map(OPEN)
    agents = drawn(roadmap, 3, 5, (0.25,))
    planner = JointPlanner(roadmap)
    tables = planner.plan(agents)

    assert planner.plan(agents, tables) == tables


def total(tables):
    return sum(table.arrives[-1] for table in tables)


def improved(seed):
    """Return a plan in aisles, and the same one improved."""
    roadmap, _ = grid_map(AISLES, cell=1.0)
    chance = random.Random(seed)
    starts, goals = (chance.sample(range(len(roadmap.places)), 12) for _ in range(2))
    agents = [point(start, goal) for start, goal in zip(starts, goals, strict=True)]
    settings = PlannerSettings(horizon=math.inf, classical=True)
    return [
        JointPlanner(roadmap, replace(settings, improvements=number)).plan(agents)
        for number in (0, 100)
    ]


@pytest.mark.parametrize("seed", range(4))
def test_improvements_make_no_plan_longer_and_nobody_meets(seed):
    first, better = improved(seed)

    assert meetings(better) == 0
    assert all(table.complete for table in better)
    assert not all(table.complete for table in first) or total(better) <= total(first)


def test_improvements_make_plans_shorter():
    before, after = (
        sum(map(total, plans)) for plans in zip(*map(improved, range(4)), strict=True)
    )

    assert after < 0.9 * before


def test_points_that_fill_most_of_a_map_all_arrive():
    roadmap, _ = grid_map(OPEN, cell=1.0)
    chance = random.Random(1)
    starts, goals = (chance.sample(range(len(roadmap.places)), 40) for _ in range(2))
    agents = [point(start, goal) for start, goal in zip(starts, goals, strict=True)]

    tables = JointPlanner(roadmap, PlannerSettings(horizon=math.inf, classical=True)).plan(agents)

    assert meetings(tables) == 0
    assert [table.places[-1] for table in tables] == goals


@pytest.mark.parametrize(("side", "robots", "stand", "seed"), [(6, 22, 6, 0), (7, 30, 10, 4)])
def test_points_that_always_stand_are_driven_through_by_no_shorter_plan(side, robots, stand, seed):
    roadmap, _ = grid_map(["." * side] * side, cell=1.0)
    places = range(len(roadmap.places))
    chance = random.Random(seed)
    starts = chance.sample(places, robots)
    others = [place for place in places if place not in starts[:stand]]
    goals = starts[:stand] + chance.sample(others, robots - stand)
    agents = [point(start, goal) for start, goal in zip(starts, goals, strict=True)]
    settings = PlannerSettings(horizon=math.inf, classical=True, improvements=100)

    assert meetings(JointPlanner(roadmap, settings).plan(agents)) == 0


def test_two_robots_change_places_in_a_dead_end():
    roadmap, number = grid_map([".......", "##.####"])
    agents = [
        robot(number[0, 5], number[0, 6]),
        robot(number[0, 6], number[0, 5], heading=math.pi),
    ]
    planner = JointPlanner(roadmap)
    tables = [None, None]

    for _ in range(20):
        tables = planner.plan(agents, tables)
        assert nearest(roadmap, agents, tables) >= 0.1 - 1e-5
        agents, tables = later(agents, tables, roadmap, 5.0)

    assert [agent.start for agent in agents] == [number[0, 6], number[0, 5]]


def test_a_robot_whose_goal_is_taken_for_ever_ends_near_it():
    roadmap, number = grid_map(["......"])
    agents = [
        robot(number[0, 0], number[0, 5]),
        robot(number[0, 5], number[0, 5], stays=True),
    ]

    first, _ = JointPlanner(roadmap).plan(agents)

    assert not first.complete
    assert first.places[-1] == number[0, 4]


@pytest.mark.parametrize("seed", [14, 20, 21, 48])
def test_a_robot_that_others_drive_over_costs_nobody_else_the_plan(monkeypatch, seed):
    def all_anew(*_):
        raise AssertionError("the fleet is planned anew")

    monkeypatch.setattr(PushingFleet, "settle_all", all_anew)
    roadmap, _ = grid_map(AISLES)
    chance = random.Random(seed)
    starts, goals = (chance.sample(range(len(roadmap.places)), 10) for _ in range(2))
    agents = [
        robot(start, goal, heading=chance.uniform(-3, 3), priority=k)
        for k, (start, goal) in enumerate(zip(starts, goals, strict=True))
    ]

    tables = JointPlanner(roadmap).plan(agents)

    assert nearest(roadmap, agents, tables) >= 0.1 - 1e-6


def test_robots_that_cannot_move_stand_still():
    roadmap, number = grid_map(["...."])
    agents = [
        robot(number[0, k], number[0, 3 - k], heading=math.pi * (k > 1), priority=k)
        for k in range(4)
    ]

    tables = JointPlanner(roadmap).plan(agents)

    assert [table.places for table in tables] == [(number[0, k],) for k in range(4)]
    assert not any(table.complete for table in tables)


def test_a_robot_takes_no_lane_that_is_too_narrow_for_it():
    roadmap, number = grid_map(["...", "..."])
    lane = [tuple(pair) for pair in roadmap.lanes].index((number[0, 0], number[0, 1]))
    widths = roadmap.widths.copy()
    widths[lane] = 0.35
    roadmap = replace(roadmap, widths=widths)
    agents = [robot(number[0, 0], number[0, 2], radius) for radius in (0.3, 0.4)]

    small, large = (JointPlanner(roadmap).plan([agent])[0] for agent in agents)

    assert number[0, 1] in small.places[:2]
    assert large.places[1] == number[1, 0]


def test_a_robot_drives_no_further_than_to_the_horizon():
    roadmap, number = grid_map(["." * 60])
    agent = robot(number[0, 0], number[0, 59])

    (table,) = JointPlanner(roadmap, PlannerSettings(horizon=20.0)).plan([agent])

    assert not table.complete
    assert 20.0 <= table.arrives[-1] < 20.0 + CELL + 1e-6


@pytest.mark.parametrize("seed", range(6))
def test_everybody_arrives_when_planned_again_and_again(seed):
    roadmap, _ = grid_map((OPEN, AISLES)[seed % 2])
    agents = drawn(roadmap, seed, 6, (0.25, 0.4))
    planner = JointPlanner(roadmap, PlannerSettings(horizon=15.0))
    tables = [None] * len(agents)
    for _ in range(40):
        tables = planner.plan(agents, tables)
        assert nearest(roadmap, agents, tables, 0.2) >= 0.1 - 1e-5
        agents, tables = later(agents, tables, roadmap, 5.0)
        if all(agent.start == agent.goal for agent in agents):
            return
    raise AssertionError([agent for agent in agents if agent.start != agent.goal])


def later(agents, tables, roadmap, step):
    """Return robots and what they have to do as they are some seconds later."""
    moved, shifted = [], []
    for agent, table in zip(agents, tables, strict=True):
        at = next(
            k
            for k in range(len(table.places))
            if table.leaves[k] > step or k + 1 == len(table.places)
        )
        heading = agent.heading
        if at > 0:
            one, other = (roadmap.places[table.places[k]] for k in (at - 1, at))
            heading = math.atan2(other[1] - one[1], other[0] - one[0])
        ready = max(table.arrives[at] - step, 0.0)
        moved.append(
            robot(
                table.places[at],
                agent.goal,
                agent.radius,
                agent.speed,
                heading,
                agent.priority,
                ready,
            )
        )
        shifted.append(
            Timetable(
                table.places,
                tuple(time - step for time in table.arrives),
                tuple(time - step for time in table.leaves),
                table.complete,
            )
        )
    return moved, shifted


@pytest.mark.parametrize("most", [1, 2])
def test_no_more_robots_are_in_a_zone_than_its_limit_allows(most):
    roadmap, number = grid_map(OPEN)
    middle = np.array([number[y, x] for y in range(6) for x in (3, 4)])
    lanes = np.flatnonzero(np.isin(roadmap.lanes, middle).any(axis=1))
    roadmap = replace(roadmap, limits=(Limit("middle", middle, lanes, most),))
    agents = [
        robot(number[y, x], number[y, 7 - x], priority=float(y))
        for y, x in ((0, 0), (2, 0), (4, 0), (1, 7), (3, 7))
    ]

    tables = JointPlanner(roadmap, PlannerSettings(horizon=math.inf)).plan(agents)

    assert all(table.complete for table in tables)
    left, right = 2.0 * CELL, 5.0 * CELL
    counts = [
        sum(left + 0.01 < where(roadmap, table, time)[0] < right - 0.01 for table in tables)
        for time in np.arange(0.0, max(table.arrives[-1] for table in tables), 0.1)
    ]
    assert max(counts) == most


def test_a_robot_that_is_not_planned_counts_in_a_zone_too():
    roadmap, number = grid_map(OPEN)
    middle = np.array([number[y, x] for y in range(6) for x in (3, 4)])
    lanes = np.flatnonzero(np.isin(roadmap.lanes, middle).any(axis=1))
    roadmap = replace(roadmap, limits=(Limit("middle", middle, lanes, 1),))
    stranger = Body(0.3, ((3.0 * CELL, 0.0, math.inf),))
    agent = robot(number[5, 0], number[5, 7])

    (table,) = JointPlanner(roadmap).plan([agent], bodies=[stranger])

    assert not table.complete
    assert not set(table.places) & set(middle.tolist())
