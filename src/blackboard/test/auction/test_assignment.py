# SPDX-License-Identifier: BSD-3-Clause
"""The assignment problem, compared with scipy's solution."""

import numpy as np
import pytest
from scipy.optimize import linear_sum_assignment

from blackboard.auction.assignment import assignment


@pytest.mark.parametrize("seed", range(100))
def test_the_sum_is_as_small_as_scipys_and_no_column_is_used_twice(seed):
    generator = np.random.default_rng(seed)
    count = int(generator.integers(1, 12))
    costs = generator.uniform(-5.0, 50.0, (count, count + int(generator.integers(0, 6))))
    excluded = generator.random(costs.shape) < generator.choice([0.0, 0.3, 0.7])
    excluded[np.arange(count), np.arange(count)] = False
    costs[excluded] = np.inf

    columns = assignment(costs)

    best = costs[linear_sum_assignment(costs)].sum()
    assert costs[np.arange(count), columns].sum() == pytest.approx(best)
    assert len(set(columns)) == count


def test_what_costs_the_same_everywhere_is_assigned_in_order():
    assert assignment(np.ones((3, 4))) == [0, 1, 2]
