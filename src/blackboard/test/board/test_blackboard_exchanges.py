# SPDX-License-Identifier: BSD-3-Clause
"""How tasks that have not begun change hands, with the test in the robots' place."""

import pytest

from blackboard.domain.record import OrderKind
from blackboard.domain.talker import TASK_BROADCAST
from blackboard.domain.task import Task, TaskState, TaskType
from hive_common.pose import Pose
from hive_lab.virtual.harness import BlackboardHarness

ONE = Task("T1", TaskType.GA, (Pose(1.0, 1.0),))
TWO = Task("T2", TaskType.GA, (Pose(3.0, 3.0),))
NEW = Task("T3", TaskType.GA, (Pose(1.0, 3.0),))
WAITING, ASSIGNED, STARTED, *_ = TaskState


@pytest.fixture
def harness():
    """Return a harness whose two robots have been told to swap their tasks."""
    harness = BlackboardHarness(improve_period=1.0, order_timeout=2.0)
    harness.join("robot1", "robot2")
    harness.post(ONE)
    harness.bid("robot1", T1=1.0)
    harness.bid("robot2", T1=9.0)
    harness.post(TWO)
    harness.bid("robot1", T2=9.0)
    harness.bid("robot2", T2=1.0)
    harness.wait(1.0)
    harness.bid("robot1", T1=9.0, T2=1.0)
    harness.bid("robot2", T1=1.0, T2=9.0)
    return harness


def given(harness):
    """Return the orders after the first two."""
    return harness.orders()[2:]


def test_tasks_that_change_hands_are_recalled(harness):
    assert harness.orders() == [("T1", "robot1"), ("T2", "robot2")]
    assert harness.orders(OrderKind.HAND_BACK_UNBEGUN) == [("T1", "robot1"), ("T2", "robot2")]


def test_a_swap_is_awarded_without_an_auction_once_both_tasks_are_back(harness):
    harness.report("robot1", ONE, WAITING)
    one_half = given(harness)
    harness.report("robot2", TWO, WAITING)

    assert one_half == []
    assert given(harness) == [("T1", "robot2"), ("T2", "robot1")]
    assert harness.offered == ["T1", "T2"]
    assert harness.record(ONE).assignment == harness.record(TWO).assignment == 2
    assert harness.record(ONE).tried == ()
    assert [(each.task_id, each.winner, each.reason) for each in harness.decisions[2:]] == [
        ("T1", "robot2", "exchanged: T1 from robot1 to robot2, T2 from robot2 to robot1"),
        ("T2", "robot1", "exchanged: T1 from robot1 to robot2, T2 from robot2 to robot1"),
    ]


def test_one_half_of_a_swap_is_auctioned_if_the_other_has_begun(harness):
    harness.report("robot1", ONE, WAITING)
    harness.report("robot2", TWO, STARTED)
    harness.wait(2.0)
    harness.bid("robot1", T1=1.0)
    harness.bid("robot2", T1=2.0)

    assert given(harness) == [("T1", "robot1")]
    assert harness.record(TWO).robot == "robot2"


def test_one_half_of_a_swap_is_auctioned_after_a_while_if_the_other_order_was_lost(harness):
    harness.report("robot1", ONE, WAITING)
    harness.wait(1.5)
    kept = given(harness)
    harness.wait(0.6)

    assert kept == []
    assert harness.offered == ["T1"]


def test_a_new_task_is_awarded_at_once_and_its_winner_drops_out_of_the_swap(harness):
    harness.report("robot1", ONE, WAITING)
    harness.post(NEW)
    harness.bid("robot1", T3=9.0)
    harness.bid("robot2", T3=1.0)
    harness.bid("robot1", T1=1.0)
    harness.bid("robot2", T1=2.0)

    assert given(harness) == [("T3", "robot2"), ("T1", "robot1")]


def test_nothing_else_is_offered_while_an_exchange_is_under_way(harness):
    before = harness.offered
    harness.report("robot1", ONE, WAITING)
    harness.wait(1.5)

    assert harness.offered == before == ["T1", "T2"]


def test_one_half_of_a_swap_is_auctioned_if_the_other_is_cancelled(harness):
    harness.report("robot1", ONE, WAITING)
    harness.cancel("T2")
    harness.wait(2.0)

    assert harness.offered == ["T1"]


def test_ends_of_schedules_are_exchanged_as_bundles():
    harness = BlackboardHarness(improve_period=1.0)
    harness.join("robot1", "robot2")
    for task, winner in ((ONE, "robot1"), (TWO, "robot1"), (NEW, "robot2")):
        harness.post(task)
        for robot in ("robot1", "robot2"):
            harness.bid(robot, **{task.id: 1.0 if robot == winner else 9.0})
    harness.status("robot1", tasks=("T2", "T1"))
    harness.status("robot2", tasks=("T3",))
    while harness.bundles != [("T2", "T1"), ("T3",)]:
        for robot in ("robot1", "robot2"):
            harness.bid(robot, **{bundle[0]: 5.0 for bundle in harness.bundles})
        harness.wait(1.0)
    harness.bid("robot1", T2=9.0, T3=1.0)
    harness.bid("robot2", T2=1.0, T3=9.0)
    for robot, task in (("robot1", ONE), ("robot1", TWO), ("robot2", NEW)):
        harness.report(robot, task, WAITING)

    assert harness.orders()[3:] == [("T2", "robot2"), ("T1", "robot2"), ("T3", "robot1")]


def offering():
    """Return a harness whose two robots have just been offered each other's tasks."""
    harness = BlackboardHarness(improve_period=1.0)
    harness.join("robot1", "robot2")
    for task, winner in ((ONE, "robot1"), (TWO, "robot2")):
        harness.post(task)
        for robot in ("robot1", "robot2"):
            harness.bid(robot, **{task.id: 1.0 if robot == winner else 9.0})
    harness.wait(1.0)
    return harness


def test_a_new_task_does_not_wait_for_a_reallocation():
    harness = offering()
    assert harness.offered == ["T1", "T2"]

    harness.post(NEW)

    assert harness.offered == ["T3"]


def test_late_bids_on_a_dropped_reallocation_are_ignored_without_a_refusal():
    harness = offering()
    improvement = harness.said(TASK_BROADCAST)[-1].auction
    harness.post(NEW)
    harness.bid("robot1", auction=improvement, T1=9.0, T2=1.0)
    harness.bid("robot2", auction=improvement, T1=1.0, T2=9.0)
    harness.bid("robot1", T3=1.0)
    harness.bid("robot2", T3=2.0)

    assert harness.orders() == [("T1", "robot1"), ("T2", "robot2"), ("T3", "robot1")]
    assert harness.talker.warnings == []


def test_only_some_robots_of_a_large_fleet_offer_their_tasks_at_a_time():
    harness = BlackboardHarness(improve_period=1.0, most_bids=8)
    robots = [f"robot{number}" for number in range(1, 5)]
    harness.join(*robots)
    for winner in robots:
        task = Task(f"of_{winner}", TaskType.GA, (Pose(1.0, 1.0),))
        harness.post(task)
        for robot in robots:
            harness.bid(robot, **{task.id: 1.0 if robot == winner else 9.0})
    offered = []
    for _ in range(6):
        harness.wait(1.0)
        offered.append(len(harness.bundles))
        for robot in robots:
            harness.bid(robot, **{bundle[0]: 5.0 for bundle in harness.bundles})

    assert max(offered) == 2
