# SPDX-License-Identifier: BSD-3-Clause
"""How long runs still take, by what those before have taken."""

import attrs
import pytest

from fleet_manager.config.scenario import PlannedTask, read_scenario
from hive_lab.compare.forecast import Forecast, share_of_run


def test_nothing_is_said_of_the_first_run_before_something_is_known():
    assert Forecast(["a", "b"]).remaining(5.0, 0.01) is None


def test_runs_that_take_the_same_are_foretold_exactly():
    forecast = Forecast(["a", "b", "a", "b"])

    assert forecast.remaining(25.0, 0.25) == pytest.approx(375.0)
    forecast.note(100.0)
    assert forecast.remaining(0.0, 0.0) == pytest.approx(300.0)
    assert forecast.remaining(50.0, 0.5) == pytest.approx(250.0)


def test_a_run_takes_what_runs_of_its_kind_have_taken():
    forecast = Forecast(["a", "b", "a", "b"])
    for took in (10.0, 100.0):
        forecast.note(took)

    assert forecast.remaining(0.0, 0.0) == pytest.approx(110.0)
    forecast.note(10.0)
    assert forecast.remaining(0.0, 0.0) == pytest.approx(100.0)


def test_a_run_that_is_slower_than_usual_is_foretold_by_its_own_pace_in_the_end():
    forecast = Forecast(["a", "a"])
    forecast.note(10.0)

    assert forecast.remaining(90.0, 0.9) == pytest.approx(10.0, rel=0.1)


def test_after_the_last_run_nothing_remains():
    forecast = Forecast(["a"])
    forecast.note(10.0)

    assert forecast.remaining(0.0, 0.0) == 0.0


def scenario(*times, limit=1000.0):
    read = read_scenario("demo")
    tasks = tuple(PlannedTask(read.tasks[0].task, at) for at in times)
    return attrs.evolve(read, tasks=tasks, time_limit=limit)


def test_of_tasks_that_come_at_once_those_that_have_ended_count():
    assert share_of_run(scenario(0.0, 0.0), 30.0, 0.5) == 0.5


def test_while_tasks_still_come_the_time_counts_too():
    assert share_of_run(scenario(0.0, 240.0), 30.0, 0.5) == pytest.approx(0.1)
    assert share_of_run(scenario(0.0, 240.0), 290.0, 0.5) == 0.5


def test_a_run_in_which_nothing_happens_any_more_ends_with_its_time_limit():
    assert share_of_run(scenario(0.0, limit=100.0), 90.0, 0.5) == pytest.approx(0.9)
    assert share_of_run(scenario(0.0, limit=100.0), 101.0, 0.5) == 1.0
