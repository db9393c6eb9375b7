# SPDX-License-Identifier: BSD-3-Clause
"""Tasks that nobody can take, and bids that do not count."""

import math

import pytest

from blackboard.domain.bid import MAX_COST
from blackboard.domain.characteristics import RobotState
from blackboard.domain.talker import (
    TASK_BROADCAST,
)
from blackboard.domain.task import Task, TaskState, TaskType
from hive_common.pose import Pose
from hive_lab.virtual.harness import BlackboardHarness

A, B = Pose(1.0, 1.0), Pose(3.0, 3.0)
GO = Task("T1", TaskType.GA, (A,), priority=3)
CARRY = Task("T2", TaskType.GPAB, (A, B), payload=2.0)
WAITING, ASSIGNED, STARTED, DONE, REJECTED, CANCELLED, FAILED = TaskState


def nobody_can():
    """Return a harness on which robot1, at work on T0, cannot take T1 now."""
    harness = BlackboardHarness(retry_period=30.0)
    harness.assign(Task("T0", TaskType.GA, (B,)))
    harness.status("robot1", tasks=["T0"])
    harness.post(GO)
    harness.bid("robot1", T1=MAX_COST)
    return harness


def times_offered(harness):
    """Return how often T1 was offered."""
    return [task.id for said in harness.said(TASK_BROADCAST) for task, _ in said.tasks].count("T1")


def busy_seconds(harness, seconds):
    """Let time pass while robot1 tells every second that it is still at work."""
    for _ in range(seconds):
        harness.wait(1.0)
        harness.status("robot1", tasks=["T0"])


def test_it_is_not_auctioned_again_while_nothing_changes():
    harness = nobody_can()
    busy_seconds(harness, 29)

    assert times_offered(harness) == 1


@pytest.mark.parametrize(
    "change",
    [
        lambda harness: harness.join("robot2"),
        lambda harness: harness.status("robot1"),
        lambda harness: busy_seconds(harness, 30),
        lambda harness: [harness.status("robot1", RobotState.DEFECT), harness.status("robot1")],
    ],
    ids=["a robot joins", "a list is shorter", "time passes", "a robot is back in service"],
)
def test_it_is_auctioned_again_when_something_changes(change):
    harness = nobody_can()

    change(harness)

    assert times_offered(harness) == 2
    assert harness.offered == ["T1"]


def test_a_change_while_the_auction_is_open_is_not_lost():
    harness = BlackboardHarness()
    harness.join("robot1")
    harness.post(GO)
    harness.join("robot2")
    harness.bid("robot1", T1=MAX_COST)

    assert len(harness.said(TASK_BROADCAST)) == 2


def test_a_robot_that_improves_while_the_auction_is_open_bids_again_alone_and_then_it_rests():
    harness = BlackboardHarness()
    harness.status("robot1", tasks=["T0"])
    harness.join("robot2")
    harness.post(GO)
    harness.bid("robot1", T1=MAX_COST)
    harness.status("robot1")
    harness.bid("robot2", T1=MAX_COST)
    asked = harness.said(TASK_BROADCAST)
    harness.bid("robot1", T1=MAX_COST)
    harness.wait(1.0)

    assert [each.asked for each in asked] == [None, {"robot1": ""}]
    assert len(harness.said(TASK_BROADCAST)) == 2


def test_another_task_is_auctioned_without_the_one_nobody_can_take():
    harness = nobody_can()
    harness.post(CARRY)

    assert harness.offered == ["T2"]


@pytest.mark.parametrize(
    "answer",
    [
        {"T1": math.nan},
        {"T1": -1.0},
        {"T1": 1000.5},
        {"T1": math.inf},
        {"T9": 1.0},
        {"T1": 1.0, "T9": 1.0},
        {"auction": 99, "T1": 1.0},
    ],
    ids=str,
)
def test_an_invalid_answer_is_refused_and_wins_nothing(answer):
    harness = BlackboardHarness()
    harness.join("robot1", "robot2")
    harness.post(GO)
    harness.bid("robot2", **answer)
    harness.bid("robot1", T1=999.0)
    harness.wait(2.1)

    assert harness.orders() == [("T1", "robot1")]
    assert len(harness.talker.warnings) == 1
    assert harness.talker.warnings[0].startswith("a message on task_cost is refused: ")


def test_an_answer_after_the_auction_changes_nothing():
    harness = BlackboardHarness()
    harness.assign(GO)
    harness.join("robot2")
    harness.bid("robot2", T1=0.5)

    assert harness.orders() == [("T1", "robot1")]
    assert not harness.talker.warnings
