# SPDX-License-Identifier: BSD-3-Clause
"""How much of what one process says may wait."""

from blackboard.process.backlog import Backlog


def test_so_many_messages_of_one_process_wait_and_no_more():
    backlog = Backlog(2)

    assert [backlog.admits("robot1", "task_state") for _ in range(4)] == [True, True, False, False]


def test_each_that_was_read_makes_room_for_one():
    backlog = Backlog(1)
    backlog.admits("robot1", "task_state")
    backlog.leaves("robot1")

    assert [backlog.admits("robot1", "task_state") for _ in range(2)] == [True, False]


def test_others_may_have_as_many():
    backlog = Backlog(1)
    backlog.admits("robot1", "task_state")

    assert backlog.admits("robot2", "task_state")


def test_what_was_dropped_is_told_once_by_topic():
    backlog = Backlog(1)
    for topic in ("task_state", "task_state", "bb_ack", "task_state"):
        backlog.admits("robot1", topic)

    assert backlog.leaves("robot1") == {"task_state": 2, "bb_ack": 1}
    backlog.admits("robot1", "bb_ack")
    assert backlog.leaves("robot1") == {}
