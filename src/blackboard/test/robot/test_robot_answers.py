# SPDX-License-Identifier: BSD-3-Clause
"""When a robot answers a call for bids."""

from blackboard.domain.record import Broadcast
from blackboard.domain.talker import TASK_BROADCAST, TASK_COST
from blackboard.domain.task import Task, TaskType
from hive_common.pose import Pose
from hive_lab.virtual.harness import RobotHarness

WON = Task("T1", TaskType.GA, (Pose(6.0, 0.0),))
OTHER = Task("T2", TaskType.GA, (Pose(9.0, 0.0),))
OFFER = Task("T3", TaskType.GA, (Pose(3.0, 0.0),))


def ask(harness, round_, asked=None):
    """Broadcast an offer; return the rounds that the robot has answered so far."""
    call = Broadcast(1, 1, ((OFFER, 0),), round=round_, asked=asked)
    harness.send(TASK_BROADCAST, call)
    return answered(harness)


def answered(harness):
    return [answer.round for answer in harness.said(TASK_COST)]


def test_a_broadcast_to_all_is_answered_at_once():
    assert ask(RobotHarness(), 1) == [1]


def test_a_broadcast_to_others_is_not_answered():
    assert ask(RobotHarness(), 2, {"robot2": "T1"}) == []


def test_a_robot_that_has_the_order_for_what_it_won_answers_at_once():
    harness = RobotHarness()
    harness.order(WON)

    assert ask(harness, 2, {"robot1": "T1"}) == [2]


def test_a_broadcast_that_overtakes_the_order_is_answered_once_after_the_order():
    harness = RobotHarness()
    before = ask(harness, 2, {"robot1": "T1"})
    harness.order(WON)
    harness.order(OTHER)

    assert before == []
    assert answered(harness) == [2]
    assert harness.said(TASK_COST)[0].bids[0].under_way == "T1"


def test_only_the_last_broadcast_is_answered():
    harness = RobotHarness()
    ask(harness, 2, {"robot1": "T1"})
    ask(harness, 3)
    harness.order(WON)

    assert answered(harness) == [3]
