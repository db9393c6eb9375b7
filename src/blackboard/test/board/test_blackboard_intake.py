# SPDX-License-Identifier: BSD-3-Clause
"""What the blackboard takes in, with the test in the robots' and the operator's place."""

import math
from dataclasses import replace

import pytest

from blackboard.auction.step import step
from blackboard.board.intake import why_refused
from blackboard.costing.bid_basis import Bids
from blackboard.costing.euclidean_lengths import EuclideanLengths
from blackboard.domain.bid import Bid
from blackboard.domain.record import TaskRecord
from blackboard.domain.talker import (
    SYNC,
    TASK_BROADCAST,
    TASK_COST,
    TASK_STATE,
)
from blackboard.domain.task import Task, TaskState, TaskType
from hive_common.pose import Pose
from hive_lab.virtual.harness import SOON, BlackboardHarness
from hive_lab.virtual.hive import Hive

A, B = Pose(1.0, 1.0), Pose(3.0, 3.0)
GO = Task("T1", TaskType.GA, (A,), priority=3)
WAITING, ASSIGNED, STARTED, DONE, REJECTED, CANCELLED, FAILED = TaskState


def test_a_valid_task_enters_the_list_and_waits():
    harness = BlackboardHarness()
    harness.post(GO)

    update = harness.said(TASK_STATE)[0]
    assert (update.task_id, update.state, update.robot_id) == ("T1", WAITING, "")
    assert (update.step, update.steps, update.epoch) == (0, 1, 1)


@pytest.mark.parametrize("posted", [0.0, 5_000.0])
def test_a_task_without_a_stamp_or_with_one_ahead_is_stamped_by_the_blackboard(posted):
    harness = BlackboardHarness()
    harness.wait(30.0)
    harness.post(replace(GO, posted=posted))

    assert harness.record(GO).task.posted == pytest.approx(harness.talker.date(), abs=1.0)


def test_a_task_keeps_the_stamp_of_who_posted_it():
    harness = BlackboardHarness()
    harness.wait(30.0)
    harness.post(replace(GO, posted=harness.talker.date() - 20.0))

    assert harness.record(GO).task.posted == pytest.approx(harness.talker.date() - 20.0, abs=1.0)


def test_an_invalid_task_is_rejected_with_the_reason_and_never_enters_the_list():
    harness = BlackboardHarness()
    harness.post(replace(GO, goals=(Pose(2.05, 1.0),)))

    (update,) = harness.said(TASK_STATE)
    assert update.state is REJECTED
    assert "goal A (2.05, 1.00) is inside a wall" in update.reason
    assert harness.record(GO) is None


def test_an_id_that_is_too_long_is_repeated_only_in_part():
    harness = BlackboardHarness()
    harness.post(replace(GO, id="x" * 100_000))

    (update,) = harness.said(TASK_STATE)
    assert update.state is REJECTED
    assert len(update.task_id) == 64


@pytest.mark.parametrize("posted", [-1.0, 2.0**32, math.inf, math.nan])
def test_a_task_whose_stamp_fits_into_no_message_is_rejected(posted):
    harness = BlackboardHarness()
    harness.post(replace(GO, posted=posted))

    (update,) = harness.said(TASK_STATE)
    assert update.state is REJECTED
    assert "allowed: 0 to 4294967295 s" in update.reason


def test_goals_that_will_not_be_visited_are_named():
    harness = BlackboardHarness()
    harness.post(replace(GO, goals=(A, B)))

    assert "not used" in harness.said(TASK_STATE)[0].reason


def test_posting_the_same_task_again_tells_its_state():
    harness = BlackboardHarness()
    harness.assign(GO)
    harness.post(replace(GO, posted=99.0))

    assert harness.states(GO)[-1] == (ASSIGNED, "robot1")
    assert harness.orders() == [("T1", "robot1")]


def test_a_done_task_posted_again_is_still_done_and_not_done_again():
    harness = BlackboardHarness()
    harness.assign(GO)
    harness.report("robot1", GO, DONE)
    harness.post(GO)

    assert harness.states(GO)[-1] == (DONE, "robot1")
    assert len(harness.said(TASK_BROADCAST)) == 1


def test_another_task_with_a_taken_id_is_refused_and_the_first_goes_on():
    harness = BlackboardHarness()
    harness.assign(GO)
    harness.post(replace(GO, priority=4))

    update = harness.said(TASK_STATE)[-1]
    assert update.state is REJECTED
    assert update.reason == "the id is taken by another task; post it with another id"
    assert harness.record(GO).state is ASSIGNED
    assert harness.record(GO).task.priority == 3


def test_a_task_whose_bids_come_at_once_is_one_change_of_the_list_with_its_assignment():
    harness = BlackboardHarness()
    before = harness.said(SYNC)[-1].version
    harness.assign(GO)

    assert harness.states(GO) == [(WAITING, ""), (ASSIGNED, "robot1")]
    assert harness.record(GO).state is ASSIGNED
    assert harness.said(SYNC)[-1].version == before + 1


def test_a_task_whose_bids_are_late_is_accepted_half_a_heartbeat_after_it_was_posted():
    harness = BlackboardHarness()
    harness.join("robot1")
    harness.post(GO)

    harness.wait(0.09 - SOON)
    early = harness.states(GO)
    harness.wait(0.012)

    assert (early, harness.states(GO)) == ([], [(WAITING, "")])


def test_tasks_that_are_held_keep_their_order_on_the_list():
    harness = BlackboardHarness()
    harness.join("robot1")
    second = replace(GO, id="T2")
    harness.post(GO, second)
    harness.bid("robot1", T1=1.0)
    harness.record(GO)

    assert [record.task.id for record in harness.said(SYNC)[-1].records] == ["T1", "T2"]


def test_a_task_that_is_cancelled_before_it_is_written_is_accepted_and_cancelled():
    harness = BlackboardHarness()
    harness.join("robot1")
    harness.post(GO)
    harness.cancel("T1")

    assert harness.states(GO) == [(WAITING, ""), (CANCELLED, "")]
    assert harness.record(GO).state is CANCELLED


class FaultyLengths(EuclideanLengths):
    """Fails for one goal, as a defect would that nobody has found yet."""

    def __init__(self, goal, error):
        self.goal, self.error = goal, error

    def refusal(self, pose):
        if pose == self.goal:
            raise self.error
        return super().refusal(pose)


@pytest.mark.parametrize("error", [ZeroDivisionError("by zero"), KeyError("cell")])
def test_a_task_that_cannot_be_worked_through_is_rejected_and_the_next_is_done(error):
    hive = Hive(path_lengths=FaultyLengths(B, error))
    hive.add_robot("robot1", Pose(0.0, 0.0))
    hive.network.run(1.0)
    hive.post(replace(GO, id="odd", goals=(B,)), GO)
    hive.network.run(60.0)

    assert hive.record("T1").state is DONE
    (update,) = hive.updates("odd")
    assert update.state is REJECTED
    assert f"{type(error).__name__}: {error}; this is a defect" in update.reason
    with pytest.raises(StopIteration):
        hive.record("odd")


def test_a_reason_that_quotes_many_robots_is_told_only_in_part():
    # Whoever hears of the task would refuse a longer one, and never learn what became of it.
    told = TaskRecord(GO, reason="x" * 50_000).told(epoch=1)

    assert why_refused(TASK_STATE, told) == ""


@pytest.mark.parametrize("field", ["energy_cost", "interrupt_cost", "most_payload", "eta"])
@pytest.mark.parametrize("number", [math.nan, 1e300])
def test_no_bid_counts_with_a_number_with_which_one_cannot_calculate(field, number):
    harness = BlackboardHarness()
    harness.join("robot1")
    harness.post(GO)
    asked = harness.said(TASK_BROADCAST)[-1]
    bid = replace(Bid("robot1", "T1", 1.0), **{field: number})
    harness.send(TASK_COST, Bids("robot1", 1, asked.auction, (bid,)))

    assert harness.orders() == []
    ((topic, reason),) = harness.talker.refusals.counts
    assert topic == TASK_COST
    assert "allowed: " in reason


def test_a_task_at_which_the_auction_fails_is_held_by_nobody(monkeypatch):
    def step_with_a_defect(state, event, view):
        if "T1" in view.records:
            raise IndexError("list index out of range")
        return step(state, event, view)

    monkeypatch.setattr("blackboard.auction.auctioneer.step", step_with_a_defect)
    harness = BlackboardHarness()
    harness.join("robot1")
    harness.post(GO)
    harness.post(replace(GO, id="T2"))

    assert harness.states(GO) == [(REJECTED, "")]
    assert harness.record(GO) is None
    assert harness.offered == ["T2"]
