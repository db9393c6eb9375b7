# SPDX-License-Identifier: BSD-3-Clause
"""Bids have one order, whoever shows them or decides by them."""

from itertools import permutations

import pytest

from blackboard.costing.preemption import best_bid
from blackboard.domain.bid import Bid, ranked
from blackboard.domain.record import TaskRecord
from blackboard.domain.task import Task, TaskType
from hive_common.pose import Pose

RECORD = TaskRecord(Task("T1", TaskType.GA, (Pose(0.0, 0.0),)))
BIDS = (
    Bid("robot9", "T1", 1.0, eta=90.0),
    Bid("robot8", "T1", 2.0, eta=10.0),
    Bid("robot1", "T1", 2.0, eta=20.0),
    Bid("robot2", "T1", 2.0, eta=20.0),
)
"""The cheapest first, then the one that is done first, then the first by name."""


@pytest.mark.parametrize("bids", list(permutations(BIDS)))
def test_bids_go_by_cost_then_by_who_is_done_first_then_by_name(bids):
    assert ranked(bids) == list(BIDS)


@pytest.mark.parametrize("left", range(1, len(BIDS) + 1))
def test_the_bid_that_goes_first_wins_the_task(left):
    assert best_bid(RECORD, reversed(BIDS[-left:])) == BIDS[-left]
