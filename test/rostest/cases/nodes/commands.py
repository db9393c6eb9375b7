# SPDX-License-Identifier: BSD-3-Clause
"""What a robot takes an action server for that is quick, slow to hear, or silent."""

import threading
import time
from types import SimpleNamespace

import actionlib
import pytest
import rospy
from actionlib_msgs.msg import GoalStatusArray
from move_base_msgs.msg import MoveBaseAction

from blackboard.domain.task import StepKind, TaskStep
from blackboard.robot.drive_guard import DriveGuard
from blackboard.robot.executor import CommandState
from blackboard.ros.commands import MoveBaseCommand
from hive_common.pose import Pose
from hive_common.ros import action_servers
from hive_lab.runner.limits import PATIENCE


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
    action_servers.start(server)
    return server


@pytest.mark.usefixtures("server")
def test_a_goal_that_is_reached_while_it_is_being_sent_ends():
    command = MoveBaseCommand(Talker(), 5.0, DriveGuard())
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


class Paused:
    """Has two clocks and looks that only advance when the test says so."""

    own = "/"

    def __init__(self):
        self.time = self.world_time = 0.0
        self.looks = []
        self.world = SimpleNamespace(now=lambda: self.world_time)

    def now(self):
        return self.time

    def call(self, action):
        action()

    def after(self, _delay, action):
        self.looks.append(action)

    def advance(self, seconds, world=None):
        """Look again after some time, by the robots' clock another one [s]."""
        self.time += seconds
        self.world_time += seconds if world is None else world
        for look in [self.looks.pop() for _ in range(len(self.looks))]:
            look()


def begin(talker, timeout, *, answers):
    """Give a goal to a base that is heard, and deaf from then on; return the results to come."""
    command, results = MoveBaseCommand(talker, timeout, DriveGuard()), []
    manager = command._client.manager  # noqa: SLF001  (what does not arrive)
    manager.register_send_goal_fn(lambda _: None)
    assert command._client.wait_for_server(rospy.Duration(PATIENCE))  # noqa: SLF001
    command.start(TaskStep(StepKind.MOVE, Pose(1.0, 2.0, 0.0), 0.0, "T1"), results.append)
    while command._goal is None:  # noqa: SLF001  (sent once the base has been heard)
        talker.advance(0.0)
    if not answers:
        command._status.impl.callbacks = []  # noqa: SLF001  (connected still)
    return results


@pytest.mark.usefixtures("server")
def test_a_robot_that_was_held_up_itself_does_not_call_its_base_lost():
    talker = Paused()
    results = begin(talker, 5.0, answers=True)
    talker.advance(60.0)
    held_up = list(results)
    heard = threading.Semaphore(0)
    rospy.Subscriber("/move_base/status", GoalStatusArray, lambda _: heard.release())
    for _ in range(3):  # the first is latched; the robot has heard what came before the third
        assert heard.acquire(timeout=PATIENCE)
    talker.advance(0.5)

    assert held_up == []
    assert [each.state for each in results] == [CommandState.LOST]


@pytest.mark.usefixtures("server")
def test_a_base_that_is_silent_while_it_drives_is_gone_at_once_with_the_reason():
    talker = Paused()
    results = begin(talker, 2.0, answers=False)
    for _ in range(3):
        talker.advance(0.5)
    before = list(results)
    for _ in range(2):
        talker.advance(0.5)

    assert before == []
    assert [each.state for each in results] == [CommandState.GONE]
    assert "silent for more than 2 s: it is frozen, or cut off" in results[0].text


@pytest.mark.parametrize(("machine", "world"), [(0.5, 0.01), (0.01, 0.5)])
@pytest.mark.usefixtures("server")
def test_a_base_is_not_silent_before_the_timeout_has_passed_on_both_clocks(machine, world):
    talker = Paused()
    results = begin(talker, 2.0, answers=False)
    for _ in range(20):
        talker.advance(machine, world)

    assert results == []
