# SPDX-License-Identifier: BSD-3-Clause
"""What reaches a node's main thread: in order, answered, and without ending it."""

from concurrent.futures import ThreadPoolExecutor

import pytest

pytest.importorskip("rospy", reason="needs ROS")

import rospy

from hive_common.ros.inbox import Inbox


@pytest.fixture
def said(monkeypatch):
    """What was logged as an error."""
    lines = []
    monkeypatch.setattr(rospy, "logerr_throttle_identical", lambda _, line: lines.append(line))
    return lines


def test_actions_run_in_the_order_in_which_they_came():
    inbox, done = Inbox(), []
    for number in range(3):
        inbox.put(lambda number=number: done.append(number))

    inbox.empty()

    assert done == [0, 1, 2]


def test_an_action_that_fails_is_counted_and_logged_and_the_next_one_runs(said):
    inbox, done = Inbox(), []
    inbox.put(lambda: 1 / 0)
    inbox.put(lambda: done.append("next"))

    inbox.wait(0.0)

    assert done == ["next"]
    assert inbox.failures == 1
    assert said == ["what came in could not be handled: ZeroDivisionError: division by zero"]


def test_whoever_asks_hears_of_the_failure(said):
    inbox = Inbox()
    with ThreadPoolExecutor(1) as caller:
        answer = caller.submit(inbox.ask, lambda: 1 / 0, None)
        while not answer.done():
            inbox.wait(0.01)

        with pytest.raises(ZeroDivisionError):
            answer.result()
    assert len(said) == 1


def test_an_end_of_the_node_passes_through():
    inbox = Inbox()

    def ends():
        raise rospy.ROSInterruptException

    inbox.put(ends)

    with pytest.raises(rospy.ROSInterruptException):
        inbox.empty()
