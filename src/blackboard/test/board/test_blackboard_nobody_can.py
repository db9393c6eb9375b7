# SPDX-License-Identifier: BSD-3-Clause
"""Tasks that nobody can take, and answers that do not count."""

import math

import pytest

from blackboard.costing.cost import MAX_COST
from blackboard.domain.characteristics import RobotState
from blackboard.domain.talker import (
    TASK_BROADCAST,
)
from blackboard.domain.task import Task, TaskState, TaskType
from hive_common.pose import Pose
from hive_lab.virtual.harness import BlackboardRig

A, B = Pose(1.0, 1.0), Pose(3.0, 3.0)
GO = Task("T1", TaskType.GA, (A,), priority=3)
CARRY = Task("T2", TaskType.GPAB, (A, B), payload=2.0)
WAITING, ASSIGNED, STARTED, DONE, REJECTED, CANCELLED, FAILED = TaskState


def nobody_can():
    """Return a rig on which robot1 cannot take a task now."""
    rig = BlackboardRig(retry_period=30.0)
    rig.status("robot1", tasks=["T0"])
    rig.post(GO)
    rig.bid("robot1", T1=MAX_COST)
    return rig


def busy_seconds(rig, seconds):
    """Let time pass while robot1 says every second that it is still at work."""
    for _ in range(seconds):
        rig.wait(1.0)
        rig.status("robot1", tasks=["T0"])


def test_it_is_not_auctioned_again_while_nothing_changes():
    rig = nobody_can()
    busy_seconds(rig, 29)

    assert len(rig.said(TASK_BROADCAST)) == 1


@pytest.mark.parametrize(
    "change",
    [
        lambda rig: rig.join("robot2"),
        lambda rig: rig.status("robot1"),
        lambda rig: busy_seconds(rig, 30),
        lambda rig: [rig.status("robot1", RobotState.DEFECT), rig.status("robot1")],
    ],
    ids=["a robot joins", "a list is shorter", "time passes", "a robot is back in service"],
)
def test_it_is_auctioned_again_when_something_changes(change):
    rig = nobody_can()

    change(rig)

    assert len(rig.said(TASK_BROADCAST)) == 2
    assert rig.offered == ["T1"]


def test_a_change_while_the_auction_is_open_is_not_lost():
    rig = BlackboardRig()
    rig.join("robot1")
    rig.post(GO)
    rig.join("robot2")
    rig.bid("robot1", T1=MAX_COST)

    assert len(rig.said(TASK_BROADCAST)) == 2


def test_a_robot_that_changes_while_the_auction_is_open_bids_again_alone_and_then_it_rests():
    rig = BlackboardRig()
    rig.status("robot1", tasks=["T0"])
    rig.join("robot2")
    rig.post(GO)
    rig.bid("robot1", T1=MAX_COST)
    rig.status("robot1")
    rig.bid("robot2", T1=MAX_COST)
    asked = rig.said(TASK_BROADCAST)
    rig.bid("robot1", T1=MAX_COST)
    rig.wait(1.0)

    assert [each.asked for each in asked] == [None, {"robot1": ""}]
    assert len(rig.said(TASK_BROADCAST)) == 2


def test_another_task_is_auctioned_without_the_one_nobody_can_take():
    rig = nobody_can()
    rig.post(CARRY)

    assert rig.offered == ["T2"]


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
def test_a_bad_answer_is_refused_and_gives_nobody_anything(answer):
    rig = BlackboardRig()
    rig.join("robot1", "robot2")
    rig.post(GO)
    rig.bid("robot2", **answer)
    rig.bid("robot1", T1=999.0)
    rig.wait(2.1)

    assert rig.orders() == [("T1", "robot1")]
    assert len(rig.talker.warnings) == 1
    assert rig.talker.warnings[0].startswith("a message on task_cost is refused: ")


def test_an_answer_after_the_auction_changes_nothing():
    rig = BlackboardRig()
    rig.assign(GO)
    rig.join("robot2")
    rig.bid("robot2", T1=0.5)

    assert rig.orders() == [("T1", "robot1")]
    assert not rig.talker.warnings
