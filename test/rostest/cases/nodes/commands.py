# SPDX-License-Identifier: BSD-3-Clause
"""A robot hears that a goal was reached, even while it is still sending it."""

import threading
import time

import actionlib
import pytest
import rospy
from move_base_msgs.msg import MoveBaseAction

from blackboard.domain.task import StepKind, TaskStep
from blackboard.robot.executor import CommandState
from blackboard.ros.commands import MoveBaseCommand
from hive_common.pose import Pose

PATIENCE = 20.0


class Talker:
    """Runs at once what the robot's own runs in its thread."""

    now = staticmethod(time.monotonic)
    world = property(lambda self: self)
    own = "/"

    def call(self, action):
        action()

    def after(self, _delay, action):
        threading.Timer(0.05, action).start()


@pytest.fixture
def server():
    """A base that is always at its goal already."""
    rospy.init_node("robot")
    server = actionlib.SimpleActionServer(
        "move_base", MoveBaseAction, lambda _goal: server.set_succeeded(), auto_start=False
    )
    server.start()
    return server


@pytest.mark.usefixtures("server")
def test_a_goal_that_is_reached_while_it_is_being_sent_ends():
    command = MoveBaseCommand(Talker(), 5.0)
    reached, ended, results = threading.Event(), threading.Event(), []
    client = command._client  # noqa: SLF001  (where a busy machine stops for a while)
    send, hear = client.manager.send_goal_fn, client.manager.update_results

    def hear_result(result):
        hear(result)
        reached.set()

    def send_slowly(goal):
        send(goal)
        assert reached.wait(PATIENCE)

    client.manager.register_send_goal_fn(send_slowly)
    client.manager.update_results = hear_result
    assert client.wait_for_server(rospy.Duration(PATIENCE))
    command.start(
        TaskStep(StepKind.MOVE, Pose(1.0, 2.0, 0.0), 0.0, "T1"),
        lambda result: (results.append(result.state), ended.set()),
    )

    assert ended.wait(PATIENCE)
    assert results == [CommandState.SUCCEEDED]


class HeldUp:
    """Has a clock and checks that only advance when the test says so."""

    def __init__(self):
        self.time = 0.0
        self.looks = []
        self.world = self
        self.own = "/"

    def now(self):
        return self.time

    def call(self, action):
        action()

    def after(self, _delay, action):
        self.looks.append(action)


@pytest.mark.usefixtures("server")
def test_a_robot_that_was_held_up_itself_does_not_call_its_base_lost():
    talker, results = HeldUp(), []
    command = MoveBaseCommand(talker, 5.0)
    command._client.manager.register_send_goal_fn(lambda _: None)  # noqa: SLF001  (on its way for ever)
    assert command._client.wait_for_server(rospy.Duration(PATIENCE))  # noqa: SLF001
    command.start(
        TaskStep(StepKind.MOVE, Pose(1.0, 2.0, 0.0), 0.0, "T1"),
        lambda result: results.append(result.state),
    )
    while command._goal is None:  # noqa: SLF001  (sent once the base has been heard)
        talker.looks.pop()()
    talker.time += 60.0
    talker.looks.pop()()
    held_up = list(results)
    talker.time += 1.0
    talker.looks.pop()()

    assert held_up == []
    assert results == [CommandState.LOST]
