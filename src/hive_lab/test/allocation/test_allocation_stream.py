# SPDX-License-Identifier: BSD-3-Clause
"""Tasks that arrive one after the other: figures by hand, and that everything gets done."""

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

from hive_lab.allocation import rules
from hive_lab.allocation.policies import Append, IdleTakesNearest
from hive_lab.allocation.stream import Stream, simulate
from hive_lab.allocation.testing import on_a_road

POLICIES = {
    "report": lambda: Append(rules.report),
    "idle takes nearest": IdleTakesNearest,
    "soonest": lambda: Append(rules.soonest),
}


def stream(posted, *road, **more):
    """Return tasks on a road that arrive at some times."""
    return Stream(on_a_road(*road, **more), np.array(posted, dtype=float))


@pytest.mark.parametrize("name", POLICIES)
def test_a_single_task_takes_its_way(name):
    taken = simulate(stream([5.0], [0.0], [3.0], [7.0]), POLICIES[name]())

    assert taken.tolist() == [7.0]


def test_an_idle_robot_takes_what_is_nearest_once_it_has_finished():
    taken = simulate(stream([0.0, 1.0, 1.0], [0.0], [10.0, 1.0, 9.0]), IdleTakesNearest())

    # From 10 it goes back to 9 first, then to 1; both were posted at 1 s.
    assert taken.tolist() == [10.0, 10.0 + 1.0 + 8.0 - 1.0, 10.0 + 1.0 - 1.0]


@settings(max_examples=15)
@given(
    st.lists(st.integers(-20, 20).map(float), min_size=1, max_size=8),
    st.integers(1, 3),
    st.sampled_from(sorted(POLICIES)),
    st.integers(0, 5),
)
@example([1.0, 0.0, 0.0, 0.0], 1, "idle takes nearest", 0)  # tasks that take no time
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
