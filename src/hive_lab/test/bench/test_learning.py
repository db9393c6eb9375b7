# SPDX-License-Identifier: BSD-3-Clause
"""The benchmark of what robots learn counts what it says."""

import pytest

from blackboard.costing.track_record import Outcome
from hive_lab.bench.learning import (
    FIXED_SEED,
    NEVER,
    coverage_of,
    errors_of,
    measure,
    tasks_until_as_before,
)


def outcome(time, energy=100.0):
    """Return a task predicted as 10 s and 100 J, at most 12 and 110, by the formula 20 and 200."""
    return Outcome(0.0, 20.0, 10.0, 12.0, time, 200.0, 100.0, 110.0, energy)


def test_errors_are_shares_of_what_tasks_took():
    figures = errors_of([[outcome(10.0)], [outcome(8.0, 80.0)] * 2])

    assert figures["time_median"] == pytest.approx(0.25)
    assert figures["time_median_by_formula"] == pytest.approx(1.5)
    assert figures["energy_95"] == pytest.approx(0.25)
    assert figures["time_95_by_formulas"] == pytest.approx(0.25 / 1.5)


def test_coverage_is_the_share_of_tasks_within_the_margin():
    figures = coverage_of([[outcome(12.0, 110.0)] * 8 + [outcome(12.1, 90.0)] * 2])

    assert figures["time_coverage"] == pytest.approx(0.8)
    assert figures["time_coverage_off_by"] == pytest.approx(0.1)
    assert figures["energy_coverage"] == 1.0


@pytest.mark.parametrize(
    ("after", "tasks"),
    [
        ([0.014] * 12, 0.0),
        ([0.5] * 7 + [0.012] * 12, 3.0),
        ([0.5] * 20, NEVER),
        ([0.01] * 5, NEVER),
    ],
)
def test_errors_are_as_before_once_half_of_ten_tasks_are(after, tasks):
    assert tasks_until_as_before([0.01] * 30 + after, 30) == tasks


@pytest.mark.parametrize("learns", [True, False])
def test_robots_predict_by_what_they_learn_unless_they_learn_nothing(learns):
    run = measure(FIXED_SEED, robots=4, tasks=12, learns=learns)

    assert len(run.done_after) == 12
    assert run.collisions == 0
    learned = [each.predicted_time != each.formula_time for _, each in run.outcomes]
    assert any(learned) is learns
