# SPDX-License-Identifier: BSD-3-Clause
"""A robot's `move_base`: a Navigator with the topics, action and service of ROS's own."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import actionlib
import rospy
import tf2_ros
from geometry_msgs.msg import PoseStamped, Twist
from move_base_msgs.msg import (
    MoveBaseAction,
    MoveBaseActionGoal,
    MoveBaseFeedback,
    MoveBaseGoal,
    MoveBaseResult,
)
from nav_msgs.srv import GetPlan, GetPlanResponse
from std_msgs.msg import Float32
from std_srvs.srv import Empty, EmptyRequest, EmptyResponse

from hive_common.pose import STOP, compose
from hive_common.ros import action_servers
from hive_common.ros.conversions import (
    path_to_msg,
    pose_from_msg,
    pose_to_msg,
    twist_from,
)
from hive_common.ros.names import RobotNames, own_names
from hive_navigation.control.goal_tracker import NavigationSettings
from hive_navigation.control.navigator import Navigator
from hive_navigation.control.pursuit_follower import PursuitFollower
from hive_navigation.planning.planner import PlanError
from hive_navigation.ros.map_topic import MapTeller
from hive_navigation.ros.path_teller import PathTeller
from hive_navigation.ros.senses import Senses
from hive_navigation.ros.startup import read_model, read_settings, run_node
from hive_navigation.ros.surroundings import Surroundings

if TYPE_CHECKING:
    from collections.abc import Callable

    from nav_msgs.msg import Path as PathMsg
    from nav_msgs.srv import GetPlanRequest

    from hive_common.pose import Pose, Velocity
    from hive_navigation.control.goal_tracker import GoalOutcome
    from hive_navigation.traffic.right_of_way import Announcement

_MAP_FRAME = "map"

_IDLE_PERIOD = 0.5  # time between two announcements of a robot that stands without a goal [s]
_FEEDBACK_PERIOD = 0.2  # time between two feedback messages of the action [s]
_BLIND_FOR = 30.0  # a goal is aborted when scan or pose have been missing for this long [s]


class MoveBase:
    """One robot's `move_base`.

    Callbacks only fill an inbox, which the control loop empties before each round, so the
    Navigator needs no lock. The constructor waits for the hive's map.

    ROS Subscribers: `move_base_simple/goal` (geometry_msgs/PoseStamped); `speed_limit`
        (std_msgs/Float32), the highest speed from now on [m/s], none if it is not above 0; and
        those of `Senses` and `Surroundings`.
    ROS Publishers: `cmd_vel` (geometry_msgs/Twist), and those of `Surroundings`, `MapTeller` and
        `PathTeller`.
    ROS Actions: `move_base` (move_base_msgs/MoveBaseAction); the result's text says why a goal was
        not reached.
    ROS Services: `move_base/make_plan` (nav_msgs/GetPlan): a path, also while the robot drives;
        from where the robot is if the frame of `start` is empty, and to the nearest place within
        `tolerance` [m] that it can reach if `goal` is none. Without a path it is empty, and the
        log says why. `move_base/clear_costmaps` (std_srvs/Empty): forget the obstacles that the
        laser has seen.
    ROS Parameters: see config/move_base.yaml; `characteristics` of the robot.

    Raises:
        ParameterError: A parameter is missing, unknown or has a value that is not allowed.
        rospy.ROSInterruptException: The node was shut down.
    """

    def __init__(self, names: RobotNames, surroundings: Surroundings) -> None:
        self._names = names
        self._surroundings = surroundings
        self._inbox = surroundings.inbox
        settings = read_settings(NavigationSettings, names.of("move_base"))
        model = read_model(names)
        self._settings = settings
        self._radius = model.base.circumscribed_radius
        self._planner = surroundings.planner(self._radius)
        self._senses = Senses(
            names, surroundings, _MAP_FRAME, settings.senses_timeout, 1.0 / model.laser.rate
        )
        self._follower = follower = PursuitFollower(model.base)
        self._make_navigator: Callable[[], Navigator] = lambda: Navigator(
            names.robot, model, self._planner, follower, self._planner.field, settings
        )
        self._navigator = self._make_navigator()
        self._last_velocity = STOP
        self._announced_at = self._fed_back_at = self._blind_since = rospy.Time(0)
        self._announced_idle = True
        # A simulator waits for commands that come once a period of simulated time.
        period = {"control_period": f"{1.0 / settings.control_rate:.6f}"}
        self._cmd_vel = rospy.Publisher(names.of("cmd_vel"), Twist, queue_size=1, headers=period)
        self._path_teller = PathTeller(names, _MAP_FRAME)
        self._goals = rospy.Publisher(names.of("move_base/goal"), MoveBaseActionGoal, queue_size=1)
        self._map_teller = MapTeller(names, "move_base")
        self._server = actionlib.SimpleActionServer(
            names.of("move_base"), MoveBaseAction, auto_start=False
        )
        self._server.register_goal_callback(lambda: self._inbox.put(self._take_goal))
        self._server.register_preempt_callback(lambda: self._inbox.put(self._preempt))

    def start(self) -> None:
        """Serve, and join the control loop."""
        action_servers.start(self._server)
        simple_goal = self._names.of("move_base_simple/goal")
        rospy.Subscriber(simple_goal, PoseStamped, self._pass_on, queue_size=1)
        rospy.Subscriber(self._names.of("speed_limit"), Float32, self._limit_speed, queue_size=1)
        rospy.Service(self._names.of("move_base/make_plan"), GetPlan, self._make_plan)
        rospy.Service(self._names.of("move_base/clear_costmaps"), Empty, self._clear)
        rospy.on_shutdown(lambda: self._cmd_vel.publish(Twist()))
        self._surroundings.give_routes_to(
            lambda routes: self._navigator.take_routes(routes, rospy.get_time())
        )
        self._surroundings.when_set_back(self._begin_anew)
        self._surroundings.when_map_changes(self._change_map)
        self._surroundings.when_zones_change(self._plan_again)
        self._map_teller.tell(self._surroundings.map.checksum)
        self._surroundings.catch_up_with(self._senses.recent_until)
        self._surroundings.every(1 / self._settings.control_rate, self._round)

    def _begin_anew(self) -> None:
        """Go on to the goal without anything that was written down before time was set back."""
        goal, self._navigator = self._navigator.goal, self._make_navigator()
        self._announced_at = self._fed_back_at = rospy.Time(0)
        self._blind_since = rospy.Time.now()
        self._senses.forget()
        if goal is not None:
            self._navigator.set_goal(goal, rospy.get_time())

    def _plan_again(self) -> None:
        self._navigator.plan_unless_guided()

    def _change_map(self) -> None:
        """Go on to the goal on a new map, without what was planned on the old one."""
        goal = self._navigator.goal
        self._planner = self._surroundings.planner(self._radius)
        self._navigator = self._make_navigator()
        if goal is not None:
            self._navigator.set_goal(goal, rospy.get_time())
        self._map_teller.tell(self._surroundings.map.checksum)

    def _limit_speed(self, message: Float32) -> None:
        if math.isnan(message.data):
            rospy.logwarn_throttle(10, "a speed limit that is not a number is ignored")
            return
        self._follower.speed_limit = message.data if message.data > 0 else math.inf

    def _round(self) -> None:
        now = rospy.Time.now()
        pose, scan = self._senses.pose(), self._senses.scan()
        if pose is None or scan is None:
            self._stand_blind(now)
            return
        self._blind_since = now
        self._navigator.stationary = self._senses.arm_at_work
        tick = self._navigator.tick(now.to_sec(), pose, scan, self._surroundings.heard)
        self._drive(tick.velocity)
        self._announce(now, tick.announcement)
        self._path_teller.tell(self._navigator.path, now)
        self._report(now, pose, tick.outcome)

    def _stand_blind(self, now: rospy.Time) -> None:
        """Stop while scan or pose are missing; abort the goal if they do not return."""
        self._drive(STOP)
        missing = self._senses.missing()
        rospy.logwarn_throttle(10, missing)
        if self._server.is_active() and (now - self._blind_since).to_sec() > _BLIND_FOR:
            self._navigator.cancel()
            self._server.set_aborted(MoveBaseResult(), f"{missing}; waited {_BLIND_FOR:g} s")

    def _drive(self, velocity: Velocity) -> None:
        """Command the base; at a standstill send nothing, so that others may drive the robot."""
        if velocity != STOP or self._last_velocity != STOP:
            self._cmd_vel.publish(twist_from(velocity))
        self._last_velocity = velocity

    def _announce(self, now: rospy.Time, announcement: Announcement) -> None:
        # That it is idle now it says at once: the others expect one that is not in every round.
        idle = self._navigator.path is None and self._navigator.goal is None
        silent = (now - self._announced_at).to_sec()
        if not (idle and self._announced_idle) or silent >= _IDLE_PERIOD:
            self._announced_at, self._announced_idle = now, idle
            self._surroundings.announce(announcement, _MAP_FRAME)

    def _report(self, now: rospy.Time, pose: Pose, outcome: GoalOutcome | None) -> None:
        if not self._server.is_active():
            return
        if outcome is not None:
            end = self._server.set_succeeded if outcome.reached else self._server.set_aborted
            end(MoveBaseResult(), outcome.text)
        elif (now - self._fed_back_at).to_sec() >= _FEEDBACK_PERIOD:
            self._fed_back_at = now
            self._server.publish_feedback(MoveBaseFeedback(pose_to_msg(pose, _MAP_FRAME, now)))

    def _take_goal(self) -> None:
        """Take up the newest goal; actionlib marks the one before as preempted."""
        if not self._server.is_new_goal_available():
            return
        goal = self._server.accept_new_goal()
        try:
            pose = self._in_map(goal.target_pose)
        except ValueError as error:
            self._navigator.cancel()
            self._server.set_aborted(MoveBaseResult(), f"goal rejected: {error}")
            return
        self._blind_since = rospy.Time.now()
        self._navigator.set_goal(pose, rospy.get_time())

    def _preempt(self) -> None:
        if self._server.is_active() and not self._server.is_new_goal_available():
            self._navigator.cancel()
            self._server.set_preempted(MoveBaseResult(), "cancelled; the robot stops")

    def _in_map(self, stamped: PoseStamped) -> Pose:
        """Return a pose in the map frame; raise ValueError if it or its frame is unusable."""
        pose = pose_from_msg(stamped.pose)
        frame = stamped.header.frame_id.lstrip("/")
        if frame == _MAP_FRAME:
            return pose
        try:
            return compose(self._senses.lookup(_MAP_FRAME, frame), pose)
        except tf2_ros.TransformException as error:
            raise ValueError(
                f"no transform from its frame {frame[:60]!r} to {_MAP_FRAME!r}: {error}; "
                f"send it in {_MAP_FRAME!r}"
            ) from None

    def _pass_on(self, stamped: PoseStamped) -> None:
        """Forward a simple goal to the action server, as the navigation stack does."""
        goal = MoveBaseActionGoal(goal=MoveBaseGoal(stamped))
        goal.header.stamp = rospy.Time.now()
        self._goals.publish(goal)

    def _make_plan(self, request: GetPlanRequest) -> GetPlanResponse:
        path = self._inbox.ask(lambda: self._planned(request), None)
        if path is None:
            raise rospy.ServiceException("make_plan timed out; retry")
        return GetPlanResponse(path)

    def _planned(self, request: GetPlanRequest) -> PathMsg:
        """Return a plan; if there is none, warn and return an empty one."""
        try:
            goal = self._in_map(request.goal)
            here = not request.start.header.frame_id
            start = self._senses.here() if here else self._in_map(request.start)
            points = self._planner.plan_near(start[:2], goal[:2], request.tolerance)
        except (ValueError, PlanError, tf2_ros.TransformException) as error:
            rospy.logwarn(f"make_plan: {error}")
            points = []
        return path_to_msg(points, _MAP_FRAME, rospy.Time.now())

    def _clear(self, _request: EmptyRequest) -> EmptyResponse:
        self._inbox.put(self._navigator.forget_obstacles)
        return EmptyResponse()


def main() -> int:
    """Run one robot's `move_base`; see `MoveBase`. Return the exit code."""
    return run_node("move_base", _run)


def _run() -> None:
    names = own_names()
    surroundings = Surroundings(names.hive)
    MoveBase(names, surroundings).start()
    surroundings.run()
