# SPDX-License-Identifier: BSD-3-Clause
"""Tasks on their way from robot to robot: awarded together, or left to the next auction."""

from dataclasses import replace

import pytest

from blackboard.auction.transfers import Move, Transfers
from blackboard.domain.bid import Bid
from blackboard.domain.record import TaskRecord
from blackboard.domain.task import Task, TaskState, TaskType
from hive_common.pose import Pose

ALL = frozenset({"robot1", "robot2", "robot3"})


class Desk:
    """A task list, and the transfers of its tasks that have begun."""

    def __init__(self, *moves):
        self.list = {move.record.task.id: move.record for move in moves}
        self.begin(*moves)

    def begin(self, *moves):
        transfers = getattr(self, "transfers", Transfers())
        self.transfers = transfers.begin(moves, self.list.get, (1, 1, 1))

    def ready(self, in_service=ALL):
        self.transfers, moves = self.transfers.ready(in_service, self.list.get)
        return moves

    def hand_back(self, name):
        self.change(name, state=TaskState.WAITING, robot="")

    def change(self, name, **what):
        self.list[name] = replace(self.list[name], **what)


def move(name, giver, taker):
    task = Task(name, TaskType.GA, (Pose(1.0, 1.0),))
    bid = Bid(taker, name, 5.0)
    return Move(TaskRecord(task, TaskState.ASSIGNED, giver, assignment=1), bid, (bid,))


@pytest.fixture
def swap():
    return move("T1", "robot1", "robot2"), move("T2", "robot2", "robot1")


@pytest.fixture
def desk(swap):
    return Desk(*swap)


def test_what_changes_hands_is_recalled_and_that_is_no_vain_try(desk, swap):
    assert all(desk.transfers.has_recalled(each.record) for each in swap)
    assert not desk.transfers.has_recalled(replace(swap[0].record, assignment=2))


def test_one_half_of_a_swap_is_kept_until_the_other_is_there(desk, swap):
    desk.hand_back("T1")

    assert desk.ready() == ()
    assert desk.transfers.task_ids == {"T1", "T2"}

    desk.hand_back("T2")

    assert desk.ready() == swap
    assert desk.transfers.task_ids == frozenset()
    assert desk.ready() == ()


@pytest.mark.parametrize(
    "change",
    [
        {"state": TaskState.STARTED},
        {"state": TaskState.CANCELLED},
        {"assignment": 2},
    ],
    ids=["begun", "cancelled", "assigned again"],
)
def test_nothing_is_kept_for_a_task_that_will_not_come(desk, change):
    desk.hand_back("T1")
    desk.change("T2", **change)

    assert desk.ready() == ()
    assert desk.transfers.task_ids == frozenset()


def test_nothing_is_kept_for_a_task_that_the_hive_has_forgotten(desk):
    del desk.list["T2"]

    assert desk.ready() == ()
    assert desk.transfers.task_ids == frozenset()


def test_nothing_is_kept_for_a_robot_that_is_out_of_service(desk):
    desk.hand_back("T1")
    desk.hand_back("T2")

    assert desk.ready(ALL - {"robot1"}) == ()
    assert desk.transfers.task_ids == frozenset()


def test_nothing_is_kept_for_a_robot_that_has_won_something_else(desk):
    assert desk.transfers.without_taker("robot3").task_ids == {"T1", "T2"}
    assert desk.transfers.without_taker("robot2").task_ids == frozenset()


def test_what_is_given_up_is_still_no_vain_try(desk, swap):
    given_up = desk.transfers.give_up()

    assert given_up.task_ids == frozenset()
    assert given_up.has_recalled(swap[0].record)


def test_what_was_recalled_long_ago_is_not_remembered_for_ever(desk, swap):
    desk.change("T1", assignment=2)
    desk.begin()

    assert not desk.transfers.has_recalled(swap[0].record)
    assert desk.transfers.has_recalled(swap[1].record)
