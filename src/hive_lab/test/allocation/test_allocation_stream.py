# SPDX-License-Identifier: BSD-3-Clause
"""Tasks that arrive one after the other: figures by hand, and that everything gets done."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from hive_lab.allocation import rules
from hive_lab.allocation.objectives import OBJECTIVES
from hive_lab.allocation.policies import Append, IdleTakesNearest, Reallocation, aged
from hive_lab.allocation.stream import Stream, simulate
from hive_lab.allocation.testing import on_a_road


def reallocation(**how):
    """Return the policy that goes on improving."""
    return Reallocation(OBJECTIVES["latency"], np.random.default_rng(1), **how)


POLICIES = {
    "report": lambda: Append(rules.report),
    "idle takes nearest": IdleTakesNearest,
    "improving": reallocation,
    "with aging": lambda: reallocation(aging=10.0),
    "afresh": lambda: reallocation(afresh=True),
}


def stream(posted, *road, **more):
    """Return tasks on a road that arrive at some times."""
    return Stream(on_a_road(*road, **more), np.array(posted, dtype=float))


@pytest.mark.parametrize("name", POLICIES)
def test_a_single_task_takes_its_way(name):
    taken = simulate(stream([5.0], [0.0], [3.0], [7.0]), POLICIES[name]())

    assert taken.tolist() == [7.0]


def test_what_has_begun_is_finished_before_what_arrives_meanwhile():
    taken = simulate(stream([0.0, 1.0], [0.0], [10.0, 1.0]), reallocation())

    # The robot drives to 10 first and comes back for the task at 1, posted at 1 s.
    assert taken.tolist() == [10.0, 10.0 + 9.0 - 1.0]


def test_what_has_not_begun_makes_way_for_what_is_quicker():
    posted = [0.0, 0.1, 0.2]
    road = ([0.0], [5.0, 50.0, 6.0])

    by_report = simulate(stream(posted, *road), Append(rules.report))
    improved = simulate(stream(posted, *road), reallocation())

    assert by_report.sum() > improved.sum()
    assert improved[2] == pytest.approx(6.0 - 0.2)


@settings(max_examples=15)
@given(
    st.lists(st.integers(-20, 20).map(float), min_size=1, max_size=8),
    st.integers(1, 3),
    st.sampled_from(sorted(POLICIES)),
    st.integers(0, 5),
)
def test_every_task_is_done_under_every_policy(places, robots, name, seed):
    instance = on_a_road([0.0] * robots, places)
    gaps = np.random.default_rng(seed).exponential(5.0, size=len(places))

    taken = simulate(Stream(instance, gaps.cumsum()), POLICIES[name]())

    assert np.isfinite(taken).all()
    assert (taken >= 0).all()


def test_a_stream_arrives_as_often_as_its_load_says():
    instance = on_a_road([0.0] * 4, [0.0] * 2000, [10.0] * 2000)

    posted = Stream.poisson(instance, 0.8, np.random.default_rng(1)).posted

    # Each takes 10 m back and 10 m with the load, so four robots do 0.2 tasks a second.
    assert 2000 / posted[-1] == pytest.approx(0.8 * 0.2, rel=0.05)


def test_what_has_waited_for_long_outweighs_what_is_new():
    weights = aged(np.ones(3), np.array([0.0, 60.0, 1e9]), 60.0)

    assert weights.tolist() == [1.0, 2.0, 2.0**20]


def near_tasks_without_end(policy):
    """Return how long a far task takes while near ones arrive all the time [s]."""
    near = 80
    places = [30.0, *([1.0, 0.0] * (near // 2))]
    posted = [0.1, *(0.05 + 0.9 * np.arange(near))]
    order = np.argsort(posted)
    instance = on_a_road([0.0], np.array(places)[order])
    taken = simulate(Stream(instance, np.sort(posted)), policy)
    return taken[int(np.argmax(order == 0))]


def test_aging_ends_the_wait_of_a_far_task_that_near_ones_keep_pushing_back():
    assert near_tasks_without_end(reallocation(aging=5.0, rounds=2)) < 65.0
    assert near_tasks_without_end(reallocation(rounds=2)) > 75.0
