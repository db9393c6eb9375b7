# SPDX-License-Identifier: BSD-3-Clause
"""Recursive least squares on relative errors."""

import pytest

from blackboard.costing.regression import Regression


@pytest.mark.parametrize("odd", [1000.0, 1.0])
def test_a_total_that_is_far_off_hardly_counts(odd):
    regression = Regression((10.0,), (1.0,), spread=0.1)
    for _ in range(30):
        regression.learn((1.0,), 10.0)

    regression.learn((1.0,), odd)

    assert regression.values[0] == pytest.approx(10.0, abs=0.5)


def test_a_term_that_is_never_there_does_not_become_ever_less_certain():
    regression = Regression((1.0, 1.0), (0.5, 0.5), spread=0.05)
    for _ in range(3000):
        regression.learn((100.0, 0.0), 110.0)

    assert regression.covariance[1][1] <= 0.25
    assert regression.values.tolist() == pytest.approx([1.1, 1.0])


def test_it_tells_the_total_as_a_share_of_what_was_expected():
    regression = Regression((2.0,), (0.5,), spread=0.1)

    assert regression.learn((10.0,), 25.0) == pytest.approx(1.25)
    assert regression.learn((0.0,), 25.0) == 1.0
