# SPDX-License-Identifier: BSD-3-Clause
"""The desk's way to the hive on ROS; see `fleet_manager.desk.facts.HiveLink`.

Whatever may wait (the master, a new publisher, a full socket) waits in this module's own thread
and never in the windows' event loop. A callback converts its message and puts it into the inbox.
"""

from __future__ import annotations

import queue
from functools import partial
from threading import Event, Thread
from typing import TYPE_CHECKING, Any

import rosgraph.names
import rospy
from geometry_msgs.msg import PointStamped, PoseStamped
from nav_msgs.msg import OccupancyGrid, Path
from rospy.numpy_msg import numpy_msg

from blackboard import talker as topics
from blackboard.characteristics import RobotStatus
from blackboard.pose import Pose
from blackboard.ros.conversions import WIRES, yaw_of
from fleet_manager.desk.facts import (
    CancelTask,
    Clicked,
    LinkChange,
    LinkState,
    MapBounds,
    PlacesKnown,
    PlannedPath,
    PostTask,
    Told,
)
from fleet_manager.desk.inbox import Inbox
from fleet_manager.ros.master_watch import MasterWatch
from fleet_manager.ros.world_places import world_places

if TYPE_CHECKING:
    from collections.abc import Hashable, Sequence

    from fleet_manager.desk.facts import Command, Fact

_QUEUE_SIZE = 1000
_WATCH_PERIOD = 1.0  # [s] between two looks at the master
_LISTENS = (
    topics.NEW_TASK,
    topics.SYNC,
    topics.TASK_STATE,
    topics.TASK_COST,
    topics.ROBOT_STATUS,
    topics.BACKUP,
)


class RosDeskLink:
    """Brings what the hive says to the desk, and what a person asks for to the hive.

    Args:
        name: Of the node; ROS adds a number, so that several desks can be open.
        argv: The node's arguments, for remapping.
        paths: Whether the robots' planned paths are wanted.

    ROS Subscribers:
        new_task, bb_sync, task_state, task_cost, robot_status, bb_backup: what the hive says.
        clicked_point (geometry_msgs/PointStamped), move_base_simple/goal
        (geometry_msgs/PoseStamped): where a person points in RViz.
        map (nav_msgs/OccupancyGrid): where the map ends.
        ROBOT/move_base/plan (nav_msgs/Path): with `paths`, of every robot that reports.

    ROS Publishers:
        new_task (blackboard/TaskMsg), task_cancel (std_msgs/String),
        ROBOT/set_state (std_msgs/String) of every robot that reports.

    ROS Parameters:
        ~world (string): World whose stations and chargers can be chosen; none by default.
    """

    def __init__(self, name: str, argv: list[str], *, paths: bool = False) -> None:
        self._name, self._argv, self._paths = name, argv, paths
        self._inbox = Inbox()
        self._work: queue.SimpleQueue[Command | str] = queue.SimpleQueue()
        self._stopped = Event()
        self._watch = MasterWatch(name)
        self._publishers: dict[str, rospy.Publisher] = {}
        self._robots: set[str] = set()

    def start(self) -> None:
        """Begin to connect, in the background."""
        Thread(target=self._run, name="hive link", daemon=True).start()

    def stop(self) -> None:
        """Disconnect, in the background where the master does not answer."""
        self._stopped.set()
        Thread(target=rospy.signal_shutdown, args=("closed",), daemon=True).start()

    def now(self) -> float:
        """Return the hive's time [s]; 0 before it is known."""
        return float(rospy.get_time()) if rospy.rostime.is_rostime_initialized() else 0.0

    def drain(self, limit: int) -> Sequence[Fact]:
        """Return at most `limit` facts that have arrived since the last call, oldest first."""
        return self._inbox.take(limit)

    def send(self, command: Command) -> None:
        """Hand over a command; it is sent as soon as the link allows."""
        self._work.put(command)

    def _run(self) -> None:
        """Connect, then send what is handed over, until stopped."""
        self._await_master()
        if self._stopped.is_set():
            return
        rospy.init_node(self._name, self._argv, anonymous=True, disable_signals=True)
        self._connect()
        self._report_master(LinkState.UP)
        while not self._stopped.is_set():
            try:
                self._do(self._work.get(timeout=_WATCH_PERIOD))
            except queue.Empty:
                self._look_at_master()

    def _await_master(self) -> None:
        self._report_master(LinkState.SEARCHING)
        while not self._watch.is_up() and not self._stopped.wait(_WATCH_PERIOD):
            pass

    def _look_at_master(self) -> None:
        for state in self._watch.look():
            self._report_master(state)

    def _report_master(self, state: LinkState) -> None:
        self._inbox.put(LinkChange(state, self._watch.address))

    def _connect(self) -> None:
        for topic in (topics.NEW_TASK, topics.TASK_CANCEL):
            self._advertise(topic, topic)
        for topic in _LISTENS:
            message = WIRES[topic].message
            rospy.Subscriber(topic, message, partial(self._hear, topic), queue_size=_QUEUE_SIZE)
        rospy.Subscriber("clicked_point", PointStamped, self._hear_point)
        rospy.Subscriber("move_base_simple/goal", PoseStamped, self._hear_goal)
        rospy.Subscriber("map", numpy_msg(OccupancyGrid), self._hear_map)
        places = world_places(rospy.get_param("~world", ""))
        self._inbox.put(PlacesKnown(places))

    def _do(self, work: Command | str) -> None:
        """Send one command, or meet the robot of this name."""
        if isinstance(work, str):
            self._meet(work)
        elif isinstance(work, PostTask):
            self._publish(topics.NEW_TASK, topics.NEW_TASK, work.task)
        elif isinstance(work, CancelTask):
            self._publish(topics.TASK_CANCEL, topics.TASK_CANCEL, work.task_id)
        else:
            name = f"{work.robot}/{topics.SET_STATE}"
            self._publish(name, topics.SET_STATE, work.state.name.lower())

    def _meet(self, robot: str) -> None:
        if not rosgraph.names.is_legal_base_name(robot):
            rospy.logwarn(
                f"robot {robot[:64]!r} has a name that ROS does not allow; it is skipped"
            )
            return
        self._advertise(f"{robot}/{topics.SET_STATE}", topics.SET_STATE)
        if self._paths:
            hear = partial(self._hear_path, robot)
            rospy.Subscriber(f"{robot}/move_base/plan", Path, hear, queue_size=1)

    def _advertise(self, name: str, topic: str) -> None:
        message = WIRES[topic].message
        self._publishers[name] = rospy.Publisher(name, message, queue_size=_QUEUE_SIZE)

    def _publish(self, name: str, topic: str, value: object) -> None:
        if name in self._publishers:
            self._publishers[name].publish(WIRES[topic].to_msg(value))

    def _hear(self, topic: str, msg: Any) -> None:  # noqa: ANN401  (of the topic's type)
        try:
            report = WIRES[topic].from_msg(msg)
        except ValueError as error:
            rospy.logwarn_throttle_identical(10, f"a message on {topic} is refused: {error}")
            return
        self._inbox.put(Told(report, msg.header.stamp.to_sec()), _superseded(topic, report))
        if isinstance(report, RobotStatus) and report.robot_id not in self._robots:
            self._robots.add(report.robot_id)
            self._work.put(report.robot_id)

    def _hear_point(self, msg: PointStamped) -> None:
        pose = Pose(msg.point.x, msg.point.y)
        self._inbox.put(Clicked(pose, msg.header.frame_id, has_heading=False))

    def _hear_goal(self, msg: PoseStamped) -> None:
        position = msg.pose.position
        pose = Pose(position.x, position.y, yaw_of(msg.pose.orientation))
        self._inbox.put(Clicked(pose, msg.header.frame_id, has_heading=True))

    def _hear_map(self, msg: OccupancyGrid) -> None:
        corner, size = msg.info.origin.position, msg.info.resolution
        far = (corner.x + size * msg.info.width, corner.y + size * msg.info.height)
        self._inbox.put(MapBounds(corner.x, corner.y, *far), "map")

    def _hear_path(self, robot: str, msg: Path) -> None:
        points = tuple((pose.pose.position.x, pose.pose.position.y) for pose in msg.poses)
        self._inbox.put(PlannedPath(robot, points), ("path", robot))


def _superseded(topic: str, report: object) -> Hashable:
    """Return the name of what a report is the newest of; None where every one counts."""
    if isinstance(report, RobotStatus):
        return topic, report.robot_id
    return topic if topic in {topics.SYNC, topics.BACKUP} else None
