# SPDX-License-Identifier: BSD-3-Clause
"""When a robot answers a broadcast."""

from blackboard.domain.record import Broadcast
from blackboard.robot.answering import Answering


def answering():
    """Return robot1's, and the rounds that it has answered."""
    answered = []
    return Answering("robot1", lambda broadcast: answered.append(broadcast.round)), answered


def broadcast(round_, asked=None):
    """Return a broadcast of a round."""
    return Broadcast(1, 1, (), round=round_, asked=asked)


def test_a_broadcast_to_all_is_answered_at_once():
    robot, answered = answering()
    robot.hear(broadcast(1))

    assert answered == [1]


def test_a_broadcast_to_others_is_not_answered():
    robot, answered = answering()
    robot.hear(broadcast(2, {"robot2": "T1"}))

    assert answered == []


def test_a_robot_that_has_heard_what_it_won_answers_at_once():
    robot, answered = answering()
    robot.note_order("T1")
    robot.hear(broadcast(2, {"robot1": "T1"}))

    assert answered == [2]


def test_a_broadcast_that_overtakes_the_order_is_answered_after_the_order():
    robot, answered = answering()
    robot.hear(broadcast(2, {"robot1": "T1"}))
    before = list(answered)
    robot.note_order("T1")
    robot.note_order("T2")

    assert (before, answered) == ([], [2])


def test_only_the_last_broadcast_is_answered():
    robot, answered = answering()
    robot.hear(broadcast(2, {"robot1": "T1"}))
    robot.hear(broadcast(3))
    robot.note_order("T1")

    assert answered == [3]
