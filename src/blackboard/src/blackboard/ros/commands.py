# SPDX-License-Identifier: BSD-3-Clause
"""A robot's commands on ROS: actionlib clients of `move_base` and `pick`."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

import actionlib
import rospy
from actionlib_msgs.msg import GoalID, GoalStatus, GoalStatusArray
from geometry_msgs.msg import Quaternion
from move_base_msgs.msg import MoveBaseAction, MoveBaseGoal

import blackboard.msg as bb_msgs
from blackboard.domain.task import StepKind
from blackboard.robot.executor import CommandResult, CommandState

if TYPE_CHECKING:
    from collections.abc import Callable

    from blackboard.domain.task import TaskStep
    from blackboard.ros.talker import MemberTalker

_STATES = {
    GoalStatus.SUCCEEDED: CommandState.SUCCEEDED,
    GoalStatus.PREEMPTED: CommandState.PREEMPTED,
    GoalStatus.RECALLED: CommandState.PREEMPTED,
    GoalStatus.ABORTED: CommandState.ABORTED,
    GoalStatus.REJECTED: CommandState.REJECTED,
}

_CHECKS_PER_TIMEOUT = 5


def _never_back(generate: Callable[[], GoalID]) -> Callable[[], GoalID]:
    """Wrap a generator of goal ids so that stamps grow even if the clock goes back.

    actionlib's simple server cancels a goal that looks older than the previous one.
    """
    last = rospy.Time()

    def next_id() -> GoalID:
        nonlocal last
        goal_id = generate()
        last = goal_id.stamp = max(goal_id.stamp, last + rospy.Duration(0, 1))
        return goal_id

    return next_id


class ActionCommand:
    """Sends steps as goals to one action server, and notices if the server is gone.

    A Python actionlib client does not learn that its server has died or that a goal was lost, so
    this one listens to the server's status messages. It does not use actionlib's simple client,
    which misses what the server says about a goal before `send_goal` returns: on a busy machine
    that may be everything up to the result.

    Args:
        name: Name of the action in the namespace of the talker's robot.
        action: Type of the action.
        make_goal: Makes a goal from a step.
        talker: Its thread gets the results.
        server_timeout: A server that is silent for longer counts as lost [s].

    ROS Actions: client of `name`.
    ROS Subscribers: `name`/status (actionlib_msgs/GoalStatusArray).
    """

    def __init__(
        self,
        name: str,
        action: type,
        make_goal: Callable[[TaskStep], Any],
        talker: MemberTalker,
        server_timeout: float,
    ) -> None:
        self._name = name
        self._make_goal = make_goal
        self._talker = talker
        self._timeout = server_timeout
        self._client = actionlib.ActionClient(talker.own + name, action)
        manager = self._client.manager
        manager._generate_id = _never_back(manager._generate_id)  # noqa: SLF001  (actionlib's only place for it)
        self._goal: actionlib.ClientGoalHandle | None = None
        self._heard = -math.inf
        self._run = 0
        rospy.Subscriber(f"{talker.own}{name}/status", GoalStatusArray, self._hear, queue_size=1)

    def start(self, step: TaskStep, done: Callable[[CommandResult], None]) -> None:
        """Send a step as a goal as soon as the server is there; see `Command.start`."""
        self._run += 1
        self._wait_for_server(self._run, step, done, self._talker.world.now() + self._timeout)

    def cancel(self) -> None:
        """Cancel the goal if there is one; see `Command.cancel`."""
        self._run += 1
        if self._goal is not None:
            self._goal.cancel()

    def _wait_for_server(
        self, run: int, step: TaskStep, done: Callable[[CommandResult], None], deadline: float
    ) -> None:
        if run != self._run:
            return
        if self._is_alive():
            self._send(run, step, done)
        elif self._talker.world.now() > deadline:
            self._give_up(run, done)
        else:
            self._talker.world.after(
                self._timeout / _CHECKS_PER_TIMEOUT,
                lambda: self._wait_for_server(run, step, done, deadline),
            )

    def _send(self, run: int, step: TaskStep, done: Callable[[CommandResult], None]) -> None:
        def changed(goal: actionlib.ClientGoalHandle) -> None:
            if goal.get_comm_state() == actionlib.CommState.DONE:
                state = _STATES.get(goal.get_terminal_state(), CommandState.LOST)
                words = goal.get_goal_status_text() or getattr(goal.get_result(), "message", "")
                self._talker.call(lambda: self._end(run, done, CommandResult(state, words)))

        self._goal = self._client.send_goal(self._make_goal(step), changed)
        now = self._talker.world.now()
        self._watch(run, self._goal, done, now, now)

    def _watch(
        self,
        run: int,
        goal: actionlib.ClientGoalHandle,
        done: Callable[[CommandResult], None],
        sent: float,
        checked: float,
    ) -> None:
        """Check periodically that the server lives and has accepted the goal.

        A check that comes late shows that this node was held up and may not have read yet what
        the server said, so it leaves the verdict to the next check.
        """
        if run != self._run:
            return
        now, period = self._talker.world.now(), self._timeout / _CHECKS_PER_TIMEOUT
        waiting = goal.get_comm_state() == actionlib.CommState.WAITING_FOR_GOAL_ACK
        is_silent = not self._is_alive() or (waiting and now - sent > self._timeout)
        if is_silent and now - checked < 2 * period:
            goal.cancel()
            self._give_up(run, done)
            return
        self._talker.world.after(period, lambda: self._watch(run, goal, done, sent, now))

    def _give_up(self, run: int, done: Callable[[CommandResult], None]) -> None:
        text = f"the action server {self._name} has not answered for {self._timeout:g} s"
        self._end(run, done, CommandResult(CommandState.LOST, text))

    def _end(self, run: int, done: Callable[[CommandResult], None], result: CommandResult) -> None:
        if run == self._run:
            self._run += 1
            self._goal = None
            done(result)

    def _hear(self, _: GoalStatusArray) -> None:
        self._heard = self._talker.world.now()

    def _is_alive(self) -> bool:
        return self._talker.world.now() - self._heard < self._timeout


class MoveBaseCommand(ActionCommand):
    """Drives: client of `move_base` (move_base_msgs/MoveBaseAction)."""

    def __init__(self, talker: MemberTalker, server_timeout: float) -> None:
        super().__init__("move_base", MoveBaseAction, _move_goal, talker, server_timeout)


class PickCommand(ActionCommand):
    """Picks and places: client of `pick` (blackboard/PickAction)."""

    def __init__(self, talker: MemberTalker, server_timeout: float) -> None:
        super().__init__("pick", bb_msgs.PickAction, _pick_goal, talker, server_timeout)


def _move_goal(step: TaskStep) -> MoveBaseGoal:
    goal = MoveBaseGoal()
    goal.target_pose.header.frame_id = "map"
    goal.target_pose.header.stamp = rospy.Time.now()
    goal.target_pose.pose.position.x = step.goal.x
    goal.target_pose.pose.position.y = step.goal.y
    half = step.goal.yaw / 2
    goal.target_pose.pose.orientation = Quaternion(0.0, 0.0, math.sin(half), math.cos(half))
    return goal


def _pick_goal(step: TaskStep) -> bb_msgs.PickGoal:
    act = bb_msgs.PickGoal.PICK if step.kind is StepKind.PICK else bb_msgs.PickGoal.PLACE
    return bb_msgs.PickGoal(act=act, task_id=step.task_id, payload=step.payload)
