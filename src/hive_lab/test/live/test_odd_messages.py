# SPDX-License-Identifier: BSD-3-Clause
"""What counts as a failure while odd messages are published to a hive of real nodes."""

import itertools
from collections import Counter, deque
from types import SimpleNamespace

import pytest

pytest.importorskip("blackboard.msg", reason="needs generated messages")

import blackboard.msg as bb_msgs
import rospy

from blackboard.errors import LiveHiveError
from hive_lab.live import odd_messages
from hive_lab.live.odd_messages import BusyHive


class Hive:
    """Nodes that end when they are told to."""

    def __init__(self):
        self.robots = ["robot1", "robot2"]
        self.members = ["/blackboard", "/robot1/robot", "/robot2/robot"]
        self.dead, self.killed, self.started = [], [], []

    def node_of(self, robot):
        return f"/{robot}/robot"

    def kill(self, node):
        self.killed.append(node)

    def start(self, node):
        self.started.append(node)

    def ended(self):
        return self.dead

    def log_of(self, node):
        return f"Traceback of {node}"

    def restart_ended(self):
        self.started += self.dead
        self.dead = []


class Operator:
    """One that hears how each task ends."""

    def __init__(self):
        self.last = SimpleNamespace(active="/blackboard")
        self.ends = itertools.repeat(bb_msgs.TaskState.DONE)

    def post(self, task):
        self.posted = task.id

    def follow(self, task_id):
        assert task_id == self.posted
        end = next(self.ends)
        if end is None:
            raise LiveHiveError(f"{task_id} has no end")
        return end


class Odd:
    """One that publishes nothing."""

    def __init__(self):
        self.names = ["/blackboard", "robot1", "robot2"]
        self.last = deque(["/bids: cost = nan"])
        self.published, self.said, self.lies = 0, Counter(), 0

    def publish_one(self):
        self.published += 1

    def publish_lies(self):
        self.lies += 1

    def say(self, topic, _message, _own=""):
        self.said[topic] += 1


@pytest.fixture
def hive(monkeypatch):
    monkeypatch.setattr(odd_messages, "_PAUSE", 0.0)
    monkeypatch.setattr(odd_messages, "_SETTLE", 0.0)
    monkeypatch.setattr(rospy.Time, "now", lambda: rospy.Time(1))
    return Hive()


@pytest.fixture
def operator():
    return Operator()


@pytest.fixture
def odd():
    return Odd()


def test_a_hive_that_stands_everything_has_no_failure_and_does_the_good_task(hive, operator, odd):
    busy = BusyHive(hive, operator, odd, deeds=False)
    busy.stand(250)
    busy.stand_lies()

    assert (busy.failures, busy.posted, busy.done) == ([], 1, 1)
    assert (odd.published, odd.lies) == (250, 1)


def test_a_node_that_ends_is_a_failure_with_its_log_and_the_last_messages(hive, operator, odd):
    hive.dead = ["/robot2/robot"]
    busy = BusyHive(hive, operator, odd, deeds=False)
    busy.stand(1)

    [failure] = busy.failures
    assert failure.startswith("/robot2/robot has ended:\nTraceback of /robot2/robot")
    assert failure.endswith("The last odd messages:\n  /bids: cost = nan")
    assert hive.started == ["/robot2/robot"]


def test_a_node_that_a_lie_ends_is_a_failure(hive, operator, odd):
    busy = BusyHive(hive, operator, odd, deeds=False)
    hive.dead = ["/blackboard"]
    busy.stand_lies()

    assert len(busy.failures) == 1


@pytest.mark.parametrize(
    ("end", "words"), [(None, "has no end"), (bb_msgs.TaskState.FAILED, "ended in state")]
)
def test_a_good_task_that_is_not_done_is_a_failure(hive, operator, odd, end, words):
    operator.ends = iter([end])
    busy = BusyHive(hive, operator, odd, deeds=False)
    busy.stand(1)

    assert words in busy.failures[0]
    assert (busy.posted, busy.done) == (1, 0)


def test_meanwhile_the_operator_posts_cancels_and_restarts_nodes(hive, operator, odd):
    busy = BusyHive(hive, operator, odd, deeds=True)
    busy.stand(700)

    assert set(odd.said) >= {"new_task", "task_cancel", "set_state"}
    assert hive.killed == hive.started
    assert "/blackboard" in hive.killed
    assert busy.failures == []
