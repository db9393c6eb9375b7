# SPDX-License-Identifier: BSD-3-Clause
"""The actions `move_base` and `pick` of a robot, as its connector uses them."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import actionlib
import blackboard.msg as bb_msgs
import rospy
import tf2_ros
from actionlib_msgs.msg import GoalStatus, GoalStatusArray
from geometry_msgs.msg import PoseWithCovarianceStamped
from move_base_msgs.msg import MoveBaseAction, MoveBaseGoal
from nav_msgs.msg import Odometry
from std_msgs.msg import Float32

from hive_common.pose import STOP, Pose, Velocity
from hive_common.ros.conversions import planar_pose, pose_from_transform
from hive_common.ros.onward_clock import OnwardClock
from hive_common.ros.transforms import Transforms
from vda5050.vehicle.ports import Outcome

if TYPE_CHECKING:
    from collections.abc import Callable

    from hive_common.ros.inbox import Inbox
    from hive_common.ros.names import RobotNames

_MAP_FRAME = "map"
_SILENT = 5.0  # an action server that is silent for longer counts as lost [s]


class _Goals:
    """Sends goals to an action server, one at a time, and hears how they end.

    It does not use actionlib's simple client, which may miss what a fast server says.
    """

    def __init__(self, name: str, kind: type, inbox: Inbox) -> None:
        self._name, self._inbox = name, inbox
        self._client = actionlib.ActionClient(name, kind)
        self._goal: actionlib.ClientGoalHandle | None = None
        self._done: Callable[[Outcome], None] | None = None
        self._now = OnwardClock(rospy.get_time).now
        self._heard = self._sent = self._now()
        rospy.Subscriber(f"{name}/status", GoalStatusArray, self._hear, queue_size=1)

    def _hear(self, _: GoalStatusArray) -> None:
        self._heard = self._now()

    def send(self, goal: Any, done: Callable[[Outcome], None]) -> None:  # noqa: ANN401  (the action's)
        """Send a goal in place of the one before; `done` gets how it ends."""
        self._done, self._sent = done, self._now()

        def changed(handle: actionlib.ClientGoalHandle) -> None:
            if handle.get_comm_state() == actionlib.CommState.DONE:
                self._inbox.put(lambda: self._end(handle))

        self._goal = self._client.send_goal(goal, changed)

    def _end(self, handle: actionlib.ClientGoalHandle) -> None:
        if handle is not self._goal and handle != self._goal:
            return
        reached = handle.get_terminal_state() == GoalStatus.SUCCEEDED
        words = handle.get_goal_status_text() or getattr(handle.get_result(), "message", "")
        self._tell(Outcome(reached, words))

    def _tell(self, outcome: Outcome) -> None:
        done, self._done, self._goal = self._done, None, None
        if done is not None:
            done(outcome)

    def cancel(self) -> None:
        """Cancel the goal; nothing more is told of it."""
        if self._goal is not None:
            self._goal.cancel()
        self._goal = self._done = None

    def watch(self) -> None:
        """End a goal whose server has gone silent; to be called now and then."""
        silence = self._now() - max(self._heard, self._sent)
        if self._goal is not None and silence > _SILENT:
            text = f"the action server {self._name} has been silent for {_SILENT:g} s"
            self._tell(Outcome(done=False, text=text))


class RosNavigation:
    """A robot's `move_base`; a `Navigation`.

    ROS Actions: client of `move_base` (move_base_msgs/MoveBaseAction).
    ROS Subscribers: `odom` (nav_msgs/Odometry), tf from map to the robot's base_footprint.
    ROS Publishers: `initialpose` (geometry_msgs/PoseWithCovarianceStamped); `speed_limit`
        (std_msgs/Float32, latched), the highest speed from now on [m/s], 0 for none.
    """

    def __init__(self, names: RobotNames, inbox: Inbox) -> None:
        self._frame = f"{names.robot}/base_footprint"
        self._goals = _Goals(names.of("move_base"), MoveBaseAction, inbox)
        self._transforms = Transforms(cache_time=10.0)
        self._initial = rospy.Publisher(
            names.of("initialpose"), PoseWithCovarianceStamped, queue_size=1
        )
        self._speed_limit = rospy.Publisher(
            names.of("speed_limit"), Float32, queue_size=1, latch=True
        )
        rospy.Subscriber(names.of("odom"), Odometry, self._hear_odometry, queue_size=1)
        self.pose: Pose | None = None
        self.velocity = STOP
        self.outcome: Outcome | None = None

    def _hear_odometry(self, message: Odometry) -> None:
        twist = message.twist.twist
        self.velocity = Velocity(twist.linear.x, twist.linear.y, twist.angular.z)

    def step(self) -> None:
        """Look where the robot is, and whether its navigation is still there."""
        self._goals.watch()
        try:
            found = self._transforms.lookup_transform(_MAP_FRAME, self._frame, rospy.Time(0))
            self.pose = pose_from_transform(found.transform)
        except (tf2_ros.TransformException, ValueError):
            return

    def send(self, goal: Pose) -> None:
        """Drive to a goal, frame map, instead of the one before."""
        message = MoveBaseGoal()
        message.target_pose.header.frame_id = _MAP_FRAME
        message.target_pose.header.stamp = rospy.Time.now()
        message.target_pose.pose = planar_pose(goal)
        self.outcome = None
        self._goals.send(message, self._end)

    def _end(self, outcome: Outcome) -> None:
        self.outcome = outcome

    def cancel(self) -> None:
        """Stop, and drop the goal."""
        self._goals.cancel()

    def limit_speed(self, limit: float | None) -> bool:
        """Drive no faster from now on [m/s]; return whether a navigation heeds it."""
        self._speed_limit.publish(Float32(limit or 0.0))
        return bool(self._speed_limit.get_num_connections())

    def set_pose(self, pose: Pose) -> bool:
        """Tell the localization where the robot is; return whether there is one to tell."""
        if not self._initial.get_num_connections():
            return False
        message = PoseWithCovarianceStamped()
        message.header.frame_id, message.header.stamp = _MAP_FRAME, rospy.Time.now()
        message.pose.pose = planar_pose(pose)
        self._initial.publish(message)
        return True


class RosArm:
    """A robot's action `pick`; an `ArmControl`.

    ROS Actions: client of `pick` (blackboard/PickAction).
    """

    def __init__(self, names: RobotNames, inbox: Inbox) -> None:
        self._goals = _Goals(names.of("pick"), bb_msgs.PickAction, inbox)

    def step(self) -> None:
        """Look whether the arm is still there."""
        self._goals.watch()

    def start(
        self, *, picks: bool, task_id: str, payload: float, done: Callable[[Outcome], None]
    ) -> None:
        """Pick a load, or put down what was picked for a task; [kg]."""
        act = bb_msgs.PickGoal.PICK if picks else bb_msgs.PickGoal.PLACE
        self._goals.send(bb_msgs.PickGoal(act=act, task_id=task_id, payload=payload), done)

    def cancel(self) -> None:
        """Drop the order."""
        self._goals.cancel()
