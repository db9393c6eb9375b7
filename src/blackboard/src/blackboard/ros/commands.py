# SPDX-License-Identifier: BSD-3-Clause
"""A robot's commands on ROS: actionlib clients of `move_base` and `pick`."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any, NamedTuple

import actionlib
import rospy
from actionlib_msgs.msg import GoalID, GoalStatus, GoalStatusArray
from geometry_msgs.msg import Quaternion
from move_base_msgs.msg import MoveBaseAction, MoveBaseGoal

import blackboard.msg as bb_msgs
from blackboard.domain.task import StepKind
from blackboard.robot.drive_guard import Drive
from blackboard.robot.executor import CommandResult, CommandState

if TYPE_CHECKING:
    from collections.abc import Callable

    from blackboard.domain.task import TaskStep
    from blackboard.process.talker import MemberTalker
    from blackboard.robot.drive_guard import Guard

_STATES = {
    GoalStatus.SUCCEEDED: CommandState.SUCCEEDED,
    GoalStatus.PREEMPTED: CommandState.PREEMPTED,
    GoalStatus.RECALLED: CommandState.PREEMPTED,
    GoalStatus.ABORTED: CommandState.ABORTED,
    GoalStatus.REJECTED: CommandState.REJECTED,
}

_PERIOD = 0.3
"""Time between two looks at a server [s, the machine's clock]."""

_GONE_AFTER = 1.5
"""A server without a connection for this long has ended [s, the machine's clock]. A connection
that broke is back sooner; rospy closes that of a dead process in some 25 ms."""


_MAX_WORDS = 1000
"""Characters of what a server says about a goal; the hive refuses reports with endless reasons."""


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


class _Moment(NamedTuple):
    """A time on the machine's clock and on the robots' clock [s]."""

    machine: float
    world: float

    def since(self, earlier: _Moment) -> float:
        """Return the time that has passed on both clocks [s]."""
        return min(self.machine - earlier.machine, self.world - earlier.world)


class ActionCommand:
    """Sends steps as goals to one action server, and notices if the server is gone.

    A Python actionlib client does not learn that its server has died or that a goal was lost, so
    this one listens to its status messages. Where their connection is gone, the server has
    ended; where they stay away, it is frozen or cut off. Either way the step ends at once,
    because trying it again would only take time.

    Time is measured on both clocks, and the shorter one counts: simulated time may pass slowly,
    and then statuses are rare, or quickly, and then every hitch of the machine looks long.

    It does not use actionlib's simple client, which misses what the server says about a goal
    before `send_goal` returns: on a busy machine that may be everything up to the result.

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
        self._heard: _Moment | None = None
        self._run = 0
        self._status = rospy.Subscriber(
            f"{talker.own}{name}/status", GoalStatusArray, self._hear, queue_size=1
        )

    @property
    def gone(self) -> str:
        """Why no step can be done: the server was there and has ended, or it is silent now.

        Empty otherwise.
        """
        if self._heard is None:
            return ""
        now = self._now()
        linked = self._status.get_num_connections()
        if not linked and now.machine - self._heard.machine >= _GONE_AFTER:
            return f"the action server {self._name} has ended; start it again"
        if now.since(self._heard) > self._timeout:
            return (
                f"the action server {self._name} has been silent for more than "
                f"{self._timeout:g} s: it is frozen, or cut off"
            )
        return ""

    def start(self, step: TaskStep, done: Callable[[CommandResult], None]) -> None:
        """Send a step as a goal as soon as the server is there; see `Command.start`."""
        self._run += 1
        self._wait_for_server(self._run, step, done, self._now())

    def cancel(self) -> None:
        """Cancel the goal, or those of an earlier process; see `Command.cancel`."""
        self._run += 1
        if self._goal is None:
            self._client.cancel_all_goals()
        else:
            self._goal.cancel()
            self._over()

    def _wait_for_server(
        self, run: int, step: TaskStep, done: Callable[[CommandResult], None], since: _Moment
    ) -> None:
        if run != self._run:
            return
        if self.gone:
            self._end_gone(run, done, begun=False)
        elif self._heard is not None:
            self._send(run, step, done)
        elif self._now().since(since) > self._timeout:
            self._give_up(run, done, begun=False)
        else:
            self._talker.after(_PERIOD, lambda: self._wait_for_server(run, step, done, since))

    def _send(self, run: int, step: TaskStep, done: Callable[[CommandResult], None]) -> None:
        def changed(goal: actionlib.ClientGoalHandle) -> None:
            if goal.get_comm_state() == actionlib.CommState.DONE:
                state = _STATES.get(goal.get_terminal_state(), CommandState.LOST)
                result = goal.get_result()
                if getattr(result, "outcome", 0) == bb_msgs.PickResult.HOLDS_ANOTHER:
                    state = CommandState.OCCUPIED
                words = goal.get_goal_status_text() or getattr(result, "message", "")
                words = words[:_MAX_WORDS]
                self._talker.call(lambda: self._end(run, done, CommandResult(state, words)))

        self._goal = self._client.send_goal(self._make_goal(step), changed)
        self._begun(self._goal)
        now = self._now()
        self._watch(run, self._goal, done, now, now)

    def _watch(
        self,
        run: int,
        goal: actionlib.ClientGoalHandle,
        done: Callable[[CommandResult], None],
        sent: _Moment,
        checked: _Moment,
    ) -> None:
        """Check periodically that the server lives and has accepted the goal.

        A check that comes late shows that this node was held up and may not have read yet what
        the server said, so it leaves the verdict to the next check.
        """
        if run != self._run:
            return
        now = self._now()
        if now.machine - checked.machine < 2 * _PERIOD:
            waiting = goal.get_comm_state() == actionlib.CommState.WAITING_FOR_GOAL_ACK
            if self.gone:
                goal.cancel()  # a server that only froze will read it
                self._end_gone(run, done)
                return
            if waiting and now.since(sent) > self._timeout:
                goal.cancel()
                self._give_up(run, done)
                return
        self._talker.after(_PERIOD, lambda: self._watch(run, goal, done, sent, now))

    def _end_gone(
        self, run: int, done: Callable[[CommandResult], None], *, begun: bool = True
    ) -> None:
        """End a step whose server has ended or is silent."""
        result = CommandResult(CommandState.GONE, self.gone, begun)
        self._talker.call(lambda: self._end(run, done, result))

    def _give_up(
        self, run: int, done: Callable[[CommandResult], None], *, begun: bool = True
    ) -> None:
        text = f"the action server {self._name} has not answered for {self._timeout:g} s"
        self._end(run, done, CommandResult(CommandState.LOST, text, begun))

    def _end(self, run: int, done: Callable[[CommandResult], None], result: CommandResult) -> None:
        if run == self._run:
            self._run += 1
            self._goal = None
            self._over()
            done(result)

    def _begun(self, goal: actionlib.ClientGoalHandle) -> None:
        """Note that a goal was sent."""

    def _over(self) -> None:
        """Note that no goal is under way any more."""

    def _hear(self, _: GoalStatusArray) -> None:
        self._heard = self._now()

    def _now(self) -> _Moment:
        return _Moment(self._talker.now(), self._talker.world.now())


class MoveBaseCommand(ActionCommand):
    """Drives: client of `move_base` (move_base_msgs/MoveBaseAction).

    Args:
        guard: Ends a drive for which this process holds no lease any more.
    """

    def __init__(self, talker: MemberTalker, server_timeout: float, guard: Guard) -> None:
        super().__init__("move_base", MoveBaseAction, _move_goal, talker, server_timeout)
        self._guard = guard
        self._action = rospy.resolve_name(f"{talker.own}move_base")
        self._drive: Drive | None = None
        self._until = 0.0

    def hold_until(self, end: float) -> None:
        """Drive no longer than until the robot's lease ends, by the machine's clock [s]."""
        self._until = end
        if self._drive is not None:
            self._guard.hold(self._drive, end)

    def _begun(self, goal: actionlib.ClientGoalHandle) -> None:
        self._drive = Drive(self._action, goal.comm_state_machine.action_goal.goal_id.id)
        self._guard.hold(self._drive, self._until)

    def _over(self) -> None:
        if self._drive is not None:
            self._guard.drop(self._drive)
        self._drive = None


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
    return bb_msgs.PickGoal(
        act=act,
        task_id=step.task_id,
        payload=step.payload,
        action_id=step.action,
        look=step.look,
        posted=rospy.Time.from_sec(step.posted),
    )
