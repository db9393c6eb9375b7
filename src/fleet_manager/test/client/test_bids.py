# SPDX-License-Identifier: BSD-3-Clause
"""What the details of a task say about its bids."""

from dataclasses import replace

import pytest

from blackboard.costing.bid_basis import Bids
from blackboard.domain.bid import MAX_COST, Bid, CostTerms
from blackboard.domain.record import TaskRecord
from blackboard.domain.task import Task, TaskType
from fleet_manager.client.bids import HEADS, BidBook, bid_cells, predicted_by, story, task_alone
from hive_common.pose import Pose

RECORD = TaskRecord(Task("T1", TaskType.GPA, (Pose(0.0, 0.0),), payload=40.0))
ABLE = Bid(
    *("robot1", "T1", 0.52, 0.02, 300.0),
    terms=CostTerms(0.02, 39.5, 2, 8.25, 300.0),
    learned_from=34,
    duration=41.0,
    formula_duration=55.0,
    formula_energy_cost=0.025,
)
EMPTY = replace(ABLE, robot_id="robot2", cost=MAX_COST, reason="too empty", exclusion="charge")


def test_a_bid_is_shown_with_its_terms():
    cells = bid_cells(ABLE, "robot1")

    assert cells == (
        "robot1 (has it)", "0.5", "+8.25 m", "2", "0.020 Ah", "39.500 Ah", "5 min 00 s",
        "41 s", "34 drives; formula: 55 s, 0.025 Ah", "",
    )  # fmt: skip
    assert len(cells) == len(HEADS)


def test_a_robot_that_cannot_is_shown_with_its_reason_and_no_terms():
    cells = bid_cells(EMPTY, "robot1")

    assert (cells[0], cells[-1]) == ("robot2", "too empty")
    assert set(cells[2:-1]) == {"–"}


@pytest.mark.parametrize(
    ("changes", "alone", "by"),
    [
        ({"learned_from": 1}, "41 s", "1 drive; formula: 55 s, 0.025 Ah"),
        ({"learned_from": 0}, "41 s", "formula"),
        ({"formula_duration": 0.0}, "41 s", "34 drives"),
        ({"duration": 0.0}, "–", "–"),
        ({"cost": MAX_COST}, "–", "–"),
    ],
    ids=["learned", "by the formula", "formula not stated", "nothing stated", "refused"],
)
def test_a_prediction_is_told_with_what_it_was_made_by(changes, alone, by):
    bid = replace(ABLE, **changes)

    assert (task_alone(bid), predicted_by(bid)) == (alone, by)


def test_it_is_told_how_often_a_task_was_offered_assigned_and_tried():
    record = TaskRecord(RECORD.task, assignment=3, tried=("robot1", "robot2", "robot1"))

    assert story(record, 4).splitlines() == [
        "Auctions it was seen in: 4. Times assigned: 3.",
        "Tried without success by robot1 (2x), robot2.",
    ]


def test_auctions_are_counted_once_however_many_robots_bid_in_how_many_rounds():
    book = BidBook()
    for auction, round_, robot in ((1, 1, "robot1"), (1, 1, "robot2"), (1, 2, "robot1")):
        book.add(Bids(robot, 1, auction, (ABLE,), round_))
    assert book.auctions("T1") == 1

    book.add(Bids("robot1", 1, 2, (ABLE,)))
    assert book.auctions("T1") == 2

    book.forget("T1")
    assert book.auctions("T1") == 0


def test_bids_of_equal_cost_are_listed_as_the_auction_ranks_them():
    late, soon, last = (
        Bid("robot1", "T1", 2.0, eta=30.0),
        Bid("robot2", "T1", 2.0, eta=20.0),
        Bid("robot3", "T1", 3.0, eta=10.0),
    )
    book = BidBook()
    for bid in (last, late, soon):
        book.add(Bids(bid.robot_id, 1, 1, (bid,)))

    assert book.bids("T1") == (soon, late, last)
