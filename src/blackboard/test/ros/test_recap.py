# SPDX-License-Identifier: BSD-3-Clause
"""What a new subscriber of `robot_status` gets from a process of several robots."""

from types import SimpleNamespace

import pytest

pytest.importorskip("blackboard.msg", reason="needs generated messages")

import rospy

from blackboard.domain.characteristics import RobotState, RobotStatus
from blackboard.ros.recap import Recap
from hive_common.pose import Pose


def status(robot, reason=""):
    return RobotStatus(robot, RobotState.IDLE, Pose(1.0, 2.0), 0.5, reason=reason)


class FakeLock:
    """A lock that knows whether it is held."""

    is_held = False

    def __enter__(self):
        self.is_held = True

    def __exit__(self, *_):
        self.is_held = False


class FakePublisher:
    """A publisher as far as its listener needs it: its lock, and what its connections say."""

    def __init__(self):
        self.headers = {}
        self.lock = FakeLock()
        self.impl = SimpleNamespace(publock=self.lock, add_headers=self.headers.update)


@pytest.fixture
def publisher(monkeypatch):
    monkeypatch.setattr(rospy, "get_time", lambda: 7.0)
    return FakePublisher()


def told_to_a_newcomer(recap):
    """Return the messages that a new subscriber gets; others must get none."""
    told, to_all = [], []
    recap.peer_subscribe("/robot_status", to_all.append, told.append)
    assert to_all == []
    return told


def test_a_newcomer_gets_the_last_status_of_each_robot(publisher):
    recap = Recap(["robot1", "robot2"])
    recap.attach(publisher)
    for robot, reason in (("robot1", "old"), ("robot2", "here"), ("robot1", "new")):
        recap.note(status(robot, reason))

    told = {msg.robot_id: msg for msg in told_to_a_newcomer(recap)}

    assert {robot: msg.reason for robot, msg in told.items()} == {
        "robot1": "new",
        "robot2": "here",
    }
    assert told["robot1"].header.stamp.to_sec() == 7.0


def test_every_newcomer_gets_it(publisher):
    recap = Recap(["robot1"])
    recap.attach(publisher)
    recap.note(status("robot1"))

    assert len(told_to_a_newcomer(recap)) == len(told_to_a_newcomer(recap)) == 1


def test_it_is_told_while_nobody_else_uses_the_publisher(publisher):
    recap, locked = Recap(["robot1"]), []
    recap.attach(publisher)
    recap.note(status("robot1"))
    recap.peer_subscribe("/robot_status", None, lambda _: locked.append(publisher.lock.is_held))

    assert locked == [True]
    assert not publisher.lock.is_held


def test_a_robot_of_another_process_is_not_told_of(publisher):
    recap = Recap(["robot1"])
    recap.attach(publisher)
    recap.note(status("robot9"))

    assert told_to_a_newcomer(recap) == []


def test_nothing_is_told_before_there_is_a_publisher(publisher):
    recap = Recap(["robot1"])
    recap.note(status("robot1"))
    assert told_to_a_newcomer(recap) == []

    recap.attach(publisher)
    assert len(told_to_a_newcomer(recap)) == 1


def test_connections_say_for_which_robots_the_process_speaks():
    assert Recap(["robot1", "robot2"]).headers() == {"robots": "robot1 robot2"}
    assert Recap().headers() == {"robots": ""}


def test_a_robot_that_is_met_is_named_to_those_who_connect_later_and_told_of(publisher):
    recap = Recap()
    recap.attach(publisher)
    for robot in ("robot1", "robot2"):
        recap.meet(robot)
        recap.note(status(robot))

    assert publisher.headers == {"robots": "robot1 robot2"}
    assert [msg.robot_id for msg in told_to_a_newcomer(recap)] == ["robot1", "robot2"]


def test_a_robot_that_is_met_again_is_named_once(publisher):
    recap = Recap(["robot1"])
    recap.attach(publisher)
    recap.meet("robot2")
    recap.meet("robot2")
    recap.meet("robot1")

    assert publisher.headers == recap.headers() == {"robots": "robot1 robot2"}


def test_a_robot_may_be_met_before_there_is_a_publisher():
    recap = Recap()
    recap.meet("robot1")

    assert recap.headers() == {"robots": "robot1"}
