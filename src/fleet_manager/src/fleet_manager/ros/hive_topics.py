# SPDX-License-Identifier: BSD-3-Clause
"""The hive's topics for operators: turns messages into facts, and requests into messages.

Every program of the operator's listens and speaks through `HiveTopics`.
"""

from __future__ import annotations

from functools import partial
from typing import TYPE_CHECKING, Any, Protocol

import rosgraph.names
import rospy
from geometry_msgs.msg import PointStamped, PoseStamped, PoseWithCovarianceStamped
from nav_msgs.msg import OccupancyGrid, Path
from rospy.numpy_msg import numpy_msg

from blackboard.domain import talker as topics
from blackboard.domain.characteristics import RobotStatus
from blackboard.ros.codec.tables import WIRES, yaw_of
from fleet_manager.desk.facts import (
    CancelTask,
    Clicked,
    HiveMessage,
    MapBounds,
    PlannedPath,
    PostTask,
    RobotPose,
)
from hive_common.pose import Pose

if TYPE_CHECKING:
    from collections.abc import Callable, Hashable, Iterable

    from fleet_manager.desk.facts import Fact, Request

QUEUE_SIZE = 1000
_STATE = (topics.TASK_STATE, topics.ROBOT_STATUS, topics.BACKUP)
_AUCTIONS = (topics.NEW_TASK, topics.TASK_COST)


class FactSink(Protocol):
    """Takes in facts from ROS's threads; see `desk.inbox.Inbox.put`."""

    def __call__(self, fact: Fact, supersedes: Hashable = None, /) -> None:
        """Take in a fact, which replaces an older one of the same name."""


class HiveTopics:
    """Listens to the hive and speaks to it. A callback converts its message and puts it away.

    Args:
        put: Takes in facts.
        met: Called from ROS's threads with the name of every robot that reports for the first
            time. It must not wait for the master, so `advertise_to` is for another thread.

    ROS Subscribers:
        bb_sync, task_state, robot_status, bb_backup: the hive's state.
        new_task, task_cost: what is posted and bid.

    ROS Publishers:
        new_task (blackboard/TaskMsg), task_cancel (std_msgs/String), and
        ROBOT/set_state (std_msgs/String) of every robot in `advertise_to`.
    """

    def __init__(self, put: FactSink, met: Callable[[str], None] = lambda _robot: None) -> None:
        self._put, self._met = put, met
        self._publishers: dict[str, rospy.Publisher] = {}
        self._robots: set[str] = set()
        self._raw_list: rospy.AnyMsg | None = None

    def listen_to_state(self) -> None:
        """Follow the hive's state, every task list included."""
        self._listen((*_STATE, topics.SYNC))

    def listen_to_all(self) -> None:
        """Follow everything that the hive says; task lists wait for `read_list`."""
        self._listen((*_STATE, *_AUCTIONS))
        rospy.Subscriber(topics.SYNC, rospy.AnyMsg, self._hear_list, queue_size=1)

    def _listen(self, names: Iterable[str]) -> None:
        for topic in names:
            message = WIRES[topic].message
            rospy.Subscriber(topic, message, partial(self._hear, topic), queue_size=QUEUE_SIZE)

    def read_list(self) -> None:
        """Read the newest task list, if one has come since the last call.

        A list of thousands of tasks may come several times a second, and reading one takes longer
        than all other messages together. Single changes come at once on task_state, so it is
        enough to read the list now and then.
        """
        raw, self._raw_list = self._raw_list, None
        if raw is not None:
            msg = WIRES[topics.SYNC].message()
            self._hear(topics.SYNC, msg.deserialize(raw._buff))  # noqa: SLF001  (AnyMsg's only field)

    def listen_to_person(self) -> None:
        """Follow where a person points in RViz, and where the map ends.

        ROS Subscribers:
            clicked_point (geometry_msgs/PointStamped), move_base_simple/goal
            (geometry_msgs/PoseStamped), map (nav_msgs/OccupancyGrid).
        """
        rospy.Subscriber("clicked_point", PointStamped, self._hear_point)
        rospy.Subscriber("move_base_simple/goal", PoseStamped, self._hear_goal)
        rospy.Subscriber("map", numpy_msg(OccupancyGrid), self._hear_map)

    def listen_to_drive(self, robot: str) -> None:
        """Follow a robot's pose and its planned path.

        ROS Subscribers:
            ROBOT/amcl_pose (geometry_msgs/PoseWithCovarianceStamped), ROBOT/move_base/plan
            (nav_msgs/Path).
        """
        if rosgraph.names.is_legal_base_name(robot):
            hear = partial(self._hear_path, robot)
            rospy.Subscriber(f"{robot}/move_base/plan", Path, hear, queue_size=1)
            locate = partial(self._hear_pose, robot)
            rospy.Subscriber(f"{robot}/amcl_pose", PoseWithCovarianceStamped, locate, queue_size=1)

    def advertise(self) -> None:
        """Prepare to post and cancel tasks."""
        for topic in (topics.NEW_TASK, topics.TASK_CANCEL):
            self._advertise(topic, topic)

    def advertise_to(self, robot: str) -> None:
        """Prepare to command a robot."""
        if rosgraph.names.is_legal_base_name(robot):
            self._advertise(f"{robot}/{topics.SET_STATE}", topics.SET_STATE)
        else:
            rospy.logwarn(f"robot {robot[:64]!r} cannot be commanded: ROS allows no such name")

    def speak(self, request: Request) -> None:
        """Publish a request, once."""
        if isinstance(request, PostTask):
            self._publish(topics.NEW_TASK, topics.NEW_TASK, request.task)
        elif isinstance(request, CancelTask):
            self._publish(topics.TASK_CANCEL, topics.TASK_CANCEL, request.task_id)
        else:
            name = f"{request.robot}/{topics.SET_STATE}"
            self._publish(name, topics.SET_STATE, request.state.name.lower())

    def _advertise(self, name: str, topic: str) -> None:
        message = WIRES[topic].message
        self._publishers[name] = rospy.Publisher(name, message, queue_size=QUEUE_SIZE)

    def _publish(self, name: str, topic: str, value: object) -> None:
        if name in self._publishers:
            self._publishers[name].publish(WIRES[topic].to_msg(value))

    def _hear(self, topic: str, msg: Any) -> None:  # noqa: ANN401  (of the topic's type)
        try:
            report = WIRES[topic].from_msg(msg)
        except ValueError as error:
            rospy.logerr_throttle_identical(10, f"a message on {topic} was refused: {error}")
            return
        message = HiveMessage(report, msg.header.stamp.to_sec())
        self._put(message, _superseded(topic, report))
        if isinstance(report, RobotStatus) and report.robot_id not in self._robots:
            self._robots.add(report.robot_id)
            self._met(report.robot_id)

    def _hear_list(self, raw: rospy.AnyMsg) -> None:
        self._raw_list = raw

    def _hear_point(self, msg: PointStamped) -> None:
        pose = Pose(msg.point.x, msg.point.y)
        self._put(Clicked(pose, msg.header.frame_id, has_heading=False))

    def _hear_goal(self, msg: PoseStamped) -> None:
        position = msg.pose.position
        pose = Pose(position.x, position.y, yaw_of(msg.pose.orientation))
        self._put(Clicked(pose, msg.header.frame_id, has_heading=True))

    def _hear_map(self, msg: OccupancyGrid) -> None:
        corner, size = msg.info.origin.position, msg.info.resolution
        far = (corner.x + size * msg.info.width, corner.y + size * msg.info.height)
        self._put(MapBounds(corner.x, corner.y, *far), "map")

    def _hear_pose(self, robot: str, msg: PoseWithCovarianceStamped) -> None:
        position, turn = msg.pose.pose.position, msg.pose.pose.orientation
        pose = Pose(position.x, position.y, yaw_of(turn))
        self._put(RobotPose(robot, pose), ("pose", robot))

    def _hear_path(self, robot: str, msg: Path) -> None:
        points = tuple((pose.pose.position.x, pose.pose.position.y) for pose in msg.poses)
        self._put(PlannedPath(robot, points), ("path", robot))


def _superseded(topic: str, report: object) -> Hashable:
    """Return the name under which a newer report replaces an older one; None where all count."""
    if isinstance(report, RobotStatus):
        return topic, report.robot_id
    return topic if topic in {topics.SYNC, topics.BACKUP} else None
