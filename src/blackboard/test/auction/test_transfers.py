# SPDX-License-Identifier: BSD-3-Clause
"""Tasks on their way from robot to robot: given out together, or left to the next auction."""

from dataclasses import replace

import pytest

from blackboard.auction.transfers import Move, Transfers
from blackboard.domain.bid import Bid
from blackboard.domain.record import TaskRecord
from blackboard.domain.task import Task, TaskState, TaskType
from hive_common.pose import Pose

ALL = frozenset({"robot1", "robot2", "robot3"})


class Lists:
    """Where tasks stand, and who was asked to hand one back."""

    def __init__(self, *records):
        self.records = {record.task.id: record for record in records}
        self.recalled = []

    def hand_back(self, name):
        self.change(name, state=TaskState.WAITING, robot="")

    def change(self, name, **what):
        self.records[name] = replace(self.records[name], **what)


def move(name, giver, taker):
    task = Task(name, TaskType.GA, (Pose(1.0, 1.0),))
    bid = Bid(taker, name, 5.0)
    return Move((TaskRecord(task, TaskState.ASSIGNED, giver, assignment=1),), bid, (bid,))


@pytest.fixture
def swap():
    return move("T1", "robot1", "robot2"), move("T2", "robot2", "robot1")


@pytest.fixture
def lists(swap):
    return Lists(*(each.records[0] for each in swap))


@pytest.fixture
def transfers(lists, swap):
    over = Transfers(lists.records.get, lambda record: lists.recalled.append(record.task.id))
    over.begin([swap])
    return over


def test_what_is_to_change_hands_is_asked_for_and_that_is_no_try_in_vain(transfers, lists, swap):
    assert lists.recalled == ["T1", "T2"]
    assert all(transfers.has_recalled(each.records[0]) for each in swap)
    assert not transfers.has_recalled(replace(swap[0].records[0], assignment=2))


def test_one_half_of_a_swap_is_kept_until_the_other_is_there(transfers, lists, swap):
    lists.hand_back("T1")

    assert transfers.ready(ALL) == []
    assert transfers.kept == {"T1", "T2"}

    lists.hand_back("T2")

    assert transfers.ready(ALL) == list(swap)
    assert transfers.kept == frozenset()
    assert transfers.ready(ALL) == []


def test_what_is_taken_as_one_is_given_out_one_by_one_when_all_is_there(swap):
    bundle = swap[0]._replace(records=tuple(each.records[0] for each in swap))
    lists = Lists(*bundle.records)
    over = Transfers(lists.records.get, lambda _: None)
    over.begin([(bundle,)])
    lists.hand_back("T2")

    assert over.ready(ALL) == []

    lists.hand_back("T1")

    assert over.ready(ALL) == [bundle]
    assert [(bid.task_id, bid.robot_id) for bid in bundle.awards] == [
        ("T1", "robot2"),
        ("T2", "robot2"),
    ]


def test_exchanges_do_not_wait_for_each_other(lists, swap):
    other = move("T3", "robot3", "robot3")
    lists.records["T3"] = other.records[0]
    over = Transfers(lists.records.get, lambda _: None)
    over.begin([swap, (other,)])
    lists.hand_back("T3")

    assert over.ready(ALL) == [other]
    assert over.kept == {"T1", "T2"}


@pytest.mark.parametrize(
    "change",
    [
        {"state": TaskState.STARTED},
        {"state": TaskState.CANCELLED},
        {"assignment": 2},
    ],
    ids=["begun", "cancelled", "given out anew"],
)
def test_nothing_is_kept_for_a_task_that_will_not_come(transfers, lists, change):
    lists.hand_back("T1")
    lists.change("T2", **change)

    assert transfers.ready(ALL) == []
    assert transfers.kept == frozenset()


def test_nothing_is_kept_for_a_task_that_the_hive_has_forgotten(transfers, lists):
    del lists.records["T2"]

    assert transfers.ready(ALL) == []
    assert transfers.kept == frozenset()


def test_nothing_is_kept_for_a_robot_that_is_out_of_service(transfers, lists):
    lists.hand_back("T1")
    lists.hand_back("T2")

    assert transfers.ready(ALL - {"robot1"}) == []
    assert transfers.kept == frozenset()


def test_nothing_is_kept_for_a_robot_that_has_won_something_else(transfers):
    transfers.leave_out("robot3")
    assert transfers.kept == {"T1", "T2"}

    transfers.leave_out("robot2")
    assert transfers.kept == frozenset()


def test_what_is_given_up_is_still_no_try_in_vain(transfers, swap):
    transfers.give_up()

    assert transfers.kept == frozenset()
    assert transfers.has_recalled(swap[0].records[0])


def test_what_was_recalled_long_ago_is_not_remembered_for_ever(transfers, lists, swap):
    lists.change("T1", assignment=2)
    transfers.begin([])

    assert not transfers.has_recalled(swap[0].records[0])
    assert transfers.has_recalled(swap[1].records[0])
