# SPDX-License-Identifier: BSD-3-Clause
"""What a robot makes of what an action server says about its goal."""

from types import SimpleNamespace

import pytest

pytest.importorskip("blackboard.msg", reason="needs generated messages")

import actionlib
import blackboard.msg as bb_msgs
import rospy
from actionlib_msgs.msg import GoalStatus, GoalStatusArray

from blackboard.domain.task import StepKind, TaskStep
from blackboard.robot.executor import CommandState
from blackboard.ros import commands
from blackboard.ros.commands import PickCommand
from hive_common.pose import Pose

STEP = TaskStep(StepKind.PICK, Pose(1.0, 2.0), 0.5, "T1", posted=3.25)


class Server:
    """An action server, as far as a client hears of it."""

    def __init__(self, monkeypatch):
        self.manager = SimpleNamespace(_generate_id=lambda: None)
        self.sent = []
        self.cancelled_all = False
        monkeypatch.setattr(commands.actionlib, "ActionClient", lambda *_: self)
        monkeypatch.setattr(rospy, "Subscriber", self._subscribe)

    def _subscribe(self, _topic, _kind, hear, **_):
        self.hear = hear
        return SimpleNamespace(get_num_connections=lambda: 1)

    def send_goal(self, goal, changed):
        self.sent.append(goal)
        self._changed = changed
        return SimpleNamespace(get_comm_state=lambda: actionlib.CommState.ACTIVE)

    def cancel_all_goals(self):
        self.cancelled_all = True

    def end(self, state, text="", result=None):
        """End the goal."""
        self._changed(
            SimpleNamespace(
                get_comm_state=lambda: actionlib.CommState.DONE,
                get_terminal_state=lambda: state,
                get_result=lambda: result,
                get_goal_status_text=lambda: text,
            )
        )


@pytest.fixture
def server(monkeypatch):
    return Server(monkeypatch)


@pytest.fixture
def ends(server):
    """The results of a step that was started at a server that is there."""
    found = []
    talker = SimpleNamespace(
        own="/robot1/",
        now=lambda: 5.0,
        world=SimpleNamespace(now=lambda: 5.0),
        call=lambda act: act(),
        after=lambda _, __: None,
    )
    command = PickCommand(talker, 2.0)
    server.hear(GoalStatusArray())
    command.start(STEP, found.append)
    return found


def test_what_an_earlier_process_has_begun_is_cancelled(server):
    talker = SimpleNamespace(own="/robot1/", now=lambda: 5.0)

    PickCommand(talker, 2.0).cancel()

    assert server.cancelled_all


def test_a_reason_of_any_length_is_cut_to_what_a_report_may_hold(server, ends):
    server.end(GoalStatus.ABORTED, "x" * 100_000)

    [result] = ends
    assert result.state is CommandState.ABORTED
    assert result.text == "x" * 1000


def test_a_reason_may_come_in_the_result(server, ends):
    server.end(GoalStatus.ABORTED, result=bb_msgs.PickResult(message="the gripper is stuck"))

    assert ends[0].text == "the gripper is stuck"


def test_an_arm_that_holds_another_load_is_occupied(server, ends):
    server.end(
        GoalStatus.ABORTED, result=bb_msgs.PickResult(outcome=bb_msgs.PickResult.HOLDS_ANOTHER)
    )

    assert ends[0].state is CommandState.OCCUPIED


@pytest.mark.parametrize("state", [GoalStatus.LOST, 77])
def test_a_state_that_no_goal_ends_in_counts_as_lost(server, ends, state):
    server.end(state)

    assert ends[0].state is CommandState.LOST


@pytest.mark.usefixtures("ends")
def test_the_arm_is_told_which_load_is_meant(server):
    (goal,) = server.sent

    assert (goal.task_id, goal.posted.to_sec()) == ("T1", 3.25)


def test_what_is_said_of_a_step_that_has_ended_counts_for_nothing(server, ends):
    server.end(GoalStatus.SUCCEEDED)
    server.end(GoalStatus.ABORTED, "too late")

    assert [end.state for end in ends] == [CommandState.SUCCEEDED]
