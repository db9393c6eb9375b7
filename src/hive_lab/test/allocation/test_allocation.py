# SPDX-License-Identifier: BSD-3-Clause
"""Auction, bids, search and optimum: small cases by hand, and what holds of all."""

from dataclasses import replace
from itertools import permutations, product

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from blackboard.auction.search.ruin_recreate import search
from blackboard.auction.search.searcher import Job
from blackboard.errors import AllocationError
from hive_lab.allocation.exact import optimum
from hive_lab.allocation.instance import Instance
from hive_lab.allocation.rules import RULES
from hive_lab.allocation.testing import figures, on_a_road

SUMS = ("energy", "latency")
PLACE = st.integers(-20, 20).map(float)


@st.composite
def situations(draw, most=7, priorities=1):
    """Draw up to three robots and some tasks on a road."""
    robots = draw(st.integers(1, 3))
    tasks = draw(st.integers(1, most))
    place = st.lists(PLACE, min_size=tasks, max_size=tasks)
    per_robot = {"min_size": robots, "max_size": robots}
    return on_a_road(
        draw(st.lists(PLACE, **per_robot)),
        draw(place),
        draw(place),
        priority=draw(st.lists(st.integers(0, priorities - 1), min_size=tasks, max_size=tasks)),
        speed=draw(st.lists(st.sampled_from([0.5, 1.0, 2.0]), **per_robot)),
        ready=draw(st.lists(st.integers(0, 9).map(float), **per_robot)),
    )


MEASURES = {"energy": "way", "makespan": "makespan", "latency": "waiting"}
"""The measure that makes each figure small."""


def found(instance, name, plan=None, rounds=200, seed=1, move=0.0):
    """Return what the search finds from a plan, by default from empty lists."""
    lists = plan or tuple(() for _ in range(len(instance.robots)))
    measure = MEASURES[name]
    return search(Job(instance.problem(), lists, measure, move, seed, rounds, np.inf, np.inf))


def auction(instance, name, plan=None):
    """Return the plan of an auction of what is on no list of a plan."""
    return found(instance, name, plan, rounds=0).plan


def searched(instance, name, plan, rounds=200, seed=1):
    """Return what some rounds of the search make of a plan."""
    return found(instance, name, plan, rounds, seed).plan


def listed(plan):
    """Return all tasks on the lists of a plan, sorted."""
    return sorted(task for row in plan for task in row)


def test_each_task_goes_to_the_robot_it_lies_by():
    instance = on_a_road([0.0, 100.0], [101.0, 1.0, 99.0, 2.0])

    plan = auction(instance, "energy")

    assert set(plan[0]) == {1, 3}
    assert set(plan[1]) == {0, 2}


def test_a_task_goes_in_between_where_it_lengthens_the_way_least():
    instance = on_a_road([0.0], [10.0, 5.0])

    plan = auction(instance, "energy", plan=((0,),))

    assert plan == ((1, 0),)


def test_for_all_done_soonest_a_second_robot_shares_the_work():
    instance = on_a_road([0.0, 0.0], [10.0, 11.0], [20.0, 21.0])

    by_energy = auction(instance, "energy")
    by_makespan = auction(instance, "makespan")

    assert sorted(map(len, by_makespan)) == [1, 1]
    assert figures(instance, by_makespan)["makespan"] == pytest.approx(21.0)
    assert sorted(map(len, by_energy)) == [1, 1] or figures(instance, by_energy)["energy"] <= 41.0


def test_for_the_mean_time_to_done_the_short_task_goes_first():
    instance = on_a_road([0.0], [0.0, 0.0], [20.0, 2.0])

    plan = auction(instance, "latency")

    assert plan == ((1, 0),)


def test_a_robot_that_is_busy_for_long_gets_what_another_can_have_done_before():
    instance = on_a_road([0.0, 30.0], [1.0], ready=[100.0, 0.0])

    assert auction(instance, "latency") == ((), (0,))
    assert auction(instance, "energy") == ((0,), ())


def test_a_task_that_no_robot_may_do_is_on_no_list_and_holds_up_no_other():
    whole = on_a_road([0.0], [1.0, 2.0], priority=[9, 0])
    able = np.array([[False, True]])
    instance = Instance(whole.robots, whole.tasks, whole.way, able)

    assert auction(instance, "energy") == ((1,),)


def test_a_way_that_does_not_exist_is_taken_by_nobody_who_has_another():
    whole = on_a_road([0.0, 50.0], [1.0])
    way = np.array([[0.0], [np.inf], [49.0]])
    instance = Instance(whole.robots, whole.tasks, way, np.array([[False], [True]]))

    assert auction(instance, "latency") == ((), (0,))


@pytest.mark.parametrize(
    ("way", "message"),
    [
        (np.zeros((2, 3)), r"way is an array of \(2, 3\); needed: \(3, 2\)"),
        (np.array([[0.0, 1.0], [1.0, 0.0], [-1.0, 2.0]]), "allowed: from 0 m"),
        (np.array([[0.0, 1.0], [1.0, 0.0], [np.nan, 2.0]]), "allowed: from 0 m"),
    ],
)
def test_numbers_that_make_no_sense_are_refused_by_name(way, message):
    whole = on_a_road([0.0], [1.0, 2.0])

    with pytest.raises(AllocationError, match=message):
        Instance(whole.robots, whole.tasks, way, whole.able)


def test_a_robot_without_speed_is_refused():
    with pytest.raises(AllocationError, match=r"speed holds 0\.0; allowed"):
        on_a_road([0.0], [1.0], speed=[0.0])


@given(situations(priorities=3), st.sampled_from(sorted(MEASURES)))
def test_the_auction_gives_out_every_task_once_and_higher_priorities_first(instance, name):
    plan = auction(instance, name)

    assert listed(plan) == list(range(len(instance.tasks)))
    for row in plan:
        priorities = instance.tasks.priority[list(row)].tolist()
        assert priorities == sorted(priorities, reverse=True)


@given(situations(), st.sampled_from(sorted(MEASURES)))
def test_a_task_goes_where_it_adds_least_to_the_whole(instance, name):
    whole = auction(instance, name)
    plan = tuple(tuple(task for task in row if task != 0) for row in whole)
    costs = []
    for robot, row in enumerate(plan):
        for place in range(len(row) + 1):
            lists = list(plan)
            lists[robot] = (*row[:place], 0, *row[place:])
            costs.append(cost(instance, name, lists))

    assert cost(instance, name, auction(instance, name, plan)) == pytest.approx(min(costs))


def cost(instance, name, plan):
    """Return what the search makes small, worked out task by task."""
    if name != "makespan":
        return figures(instance, plan)[name]
    alone = [
        tuple(row if index == robot else ())
        for robot in range(len(plan))
        for index, row in enumerate(plan)
    ]
    count = len(plan)
    rows = [alone[first : first + count] for first in range(0, count * count, count)]
    ready = instance.robots.ready
    ends = [
        figures(instance, row)["makespan"] if plan[robot] else float(ready[robot])
        for robot, row in enumerate(rows)
    ]
    return sum(end**12 for end in ends) / 100.0**12


@settings(max_examples=40)
@given(situations(priorities=3), st.sampled_from(sorted(MEASURES)), st.integers(0, 9))
def test_the_search_loses_no_task_keeps_priorities_and_makes_nothing_worse(instance, name, seed):
    plan = auction(instance, name)

    better = found(instance, name, plan, seed=seed)

    assert listed(better.plan) == listed(plan)
    for row in better.plan:
        priorities = instance.tasks.priority[list(row)].tolist()
        assert priorities == sorted(priorities, reverse=True)
    assert better.after <= better.before * (1 + 1e-9)


@settings(max_examples=20)
@given(situations(priorities=2), st.sampled_from(SUMS))
def test_the_cost_of_a_plan_is_what_its_lists_take(instance, name):
    plan = auction(instance, name)

    better = found(instance, name, plan)

    assert better.before == pytest.approx(figures(instance, plan)[name])
    assert better.after == pytest.approx(figures(instance, better.plan)[name])


def test_a_task_that_another_robot_has_moves_only_for_more_than_a_move_counts():
    instance = on_a_road([0.0, 10.0], [4.0])

    moved, kept = (found(instance, "latency", ((), (0,)), move=move) for move in (1.0, 3.0))

    assert (moved.plan, moved.before, moved.after) == (((0,), ()), 6.0, 5.0)
    assert (kept.plan, kept.before, kept.after) == (((), (0,)), 6.0, 6.0)


def test_a_list_that_a_robot_cannot_finish_with_its_charge_is_refused():
    whole = on_a_road([0.0, 30.0], [10.0, 12.0]).problem()
    nothing = ((), ())

    plans = [
        search(Job(problem, nothing, "waiting", 0.0, 1, 200, np.inf, np.inf)).plan
        for problem in (whole, replace(whole, most=np.array([11.0, 40.0])))
    ]

    assert plans == [((0, 1), ()), ((0,), (1,))]


def test_the_search_ends_early_where_little_time_is_to_be_won():
    instance = on_a_road([0.0, 10.0], [1.0, 9.0, 3.0, 7.0])
    lists = ((), ())

    soon, late = (
        search(Job(instance.problem(), lists, "waiting", 0.0, 1, 100_000, np.inf, share)).spent
        for share in (0.0005, 0.005)
    )

    assert soon < late / 5


@settings(max_examples=20)
@given(situations(), st.integers(0, 9))
def test_the_same_seed_gives_the_same_answer(instance, seed):
    plan = auction(instance, "latency")

    first = searched(instance, "latency", plan, seed=seed)

    assert searched(instance, "latency", plan, seed=seed) == first


@settings(max_examples=30)
@given(situations(most=3), st.sampled_from(["energy", "makespan", "latency"]))
def test_the_optimum_is_the_best_of_all_plans(instance, name):
    robots, tasks = len(instance.robots), len(instance.tasks)
    found = np.inf
    for order in permutations(range(tasks)):
        for takers in product(range(robots), repeat=tasks):
            pairs = list(zip(order, takers, strict=True))
            rows = [[task for task, taker in pairs if taker == robot] for robot in range(robots)]
            found = min(found, figures(instance, rows)[name])

    assert optimum(instance, name) == pytest.approx(found)


@settings(max_examples=20)
@given(situations(most=6), st.sampled_from(["energy", "latency"]))
def test_no_plan_is_better_than_the_optimum(instance, name):
    best = optimum(instance, name)
    plan = searched(instance, name, auction(instance, name))

    assert figures(instance, plan)[name] >= best - 1e-9


def test_the_search_swaps_what_the_auction_gave_to_the_wrong_robots():
    instance = on_a_road([0.0, 10.0], [1.0, 9.0])

    assert searched(instance, "energy", ((1,), (0,))) == ((0,), (1,))


def test_too_many_tasks_for_the_optimum_are_refused():
    instance = on_a_road([0.0], list(range(15)))

    with pytest.raises(AllocationError, match="allowed: at most 14"):
        optimum(instance, "energy")


@given(situations())
def test_every_rule_gives_out_every_task_once(instance):
    for rule in RULES.values():
        assert listed(rule(instance)) == list(range(len(instance.tasks)))


def test_the_reports_rule_prefers_an_empty_list_to_a_near_one():
    instance = on_a_road([0.0, 10.0], [1.0, 4.0])

    assert RULES["nearest"](instance) == ((0, 1), ())
    # Second in the list of the first robot: 2 x 3 m; first in the other one: 1 x 6 m, a draw that
    # goes to the first robot; a little nearer to the other one it changes hands.
    nearer = on_a_road([0.0, 9.9], [1.0, 4.0])
    assert RULES["report"](nearer) == ((0,), (1,))


def test_idle_robots_are_matched_for_the_least_sum():
    instance = on_a_road([0.0, 3.0], [2.0, 8.0])

    assert RULES["hungarian"](instance) == ((0,), (1,))
