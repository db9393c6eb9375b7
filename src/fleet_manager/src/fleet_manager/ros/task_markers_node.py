# SPDX-License-Identifier: BSD-3-Clause
"""The node that shows tasks and robots in RViz."""

from __future__ import annotations

import math
import queue
import time
from typing import TYPE_CHECKING

import rospy
from geometry_msgs.msg import Point, Pose, Quaternion, Vector3
from std_msgs.msg import ColorRGBA, Header
from visualization_msgs.msg import Marker as MarkerMsg
from visualization_msgs.msg import MarkerArray

from fleet_manager.client.hive_state import HiveState
from fleet_manager.client.reports import HiveMessage
from fleet_manager.desk.facts import PlannedPath, RobotPose
from fleet_manager.desk.inbox import Inbox
from fleet_manager.desk.markers import MarkerBoard, Shape
from fleet_manager.ros.hive_topics import HiveTopics
from fleet_manager.ros.map_topics import MapTopics
from fleet_manager.ros.place_parameter import hive_places
from hive_common.ros.links import mend_links
from hive_common.ros.signals import init_node

if TYPE_CHECKING:
    from fleet_manager.desk.markers import Marker
    from hive_common.pose import Pose as MapPose

PERIOD = 0.2  # [s, wall] between two updates, quick enough for robots at walking pace
BATCH = 10_000  # facts processed at once
_LOOK_FOR_PLACES = 2.0  # [s, wall] between two looks for named places, until there are some

_TYPES = {
    Shape.ARROW: MarkerMsg.ARROW,
    Shape.TEXT: MarkerMsg.TEXT_VIEW_FACING,
    Shape.LINE: MarkerMsg.LINE_STRIP,
    Shape.DISC: MarkerMsg.CYLINDER,
}


class TaskMarkers:
    """Publishes markers for open tasks, robots and paths.

    ROS Subscribers:
        Those of `HiveTopics`, and of every robot ROBOT/move_base/plan (nav_msgs/Path; or the
        topic that its parameter `plan_topic` names) and ROBOT/amcl_pose
        (geometry_msgs/PoseWithCovarianceStamped).

    ROS Publishers:
        task_markers (visualization_msgs/MarkerArray): all markers at every change, latched.
    """

    def __init__(self) -> None:
        self._inbox = Inbox()
        self._met: queue.SimpleQueue[str] = queue.SimpleQueue()
        self._topics = HiveTopics(self._inbox.put, self._met.put)
        self._map = MapTopics(self._inbox.put)
        self._hive = HiveState(detailed=True)
        self._board = MarkerBoard()
        self._paths: dict[str, tuple[tuple[float, float], ...]] = {}
        self._poses: dict[str, MapPose] = {}
        self._places: dict[str, MapPose] = {}
        self._looked = float("-inf")
        self._last: tuple[list[Marker], list[tuple[str, int]]] | None = None
        self._publisher = rospy.Publisher("task_markers", MarkerArray, latch=True, queue_size=1)

    def start(self) -> None:
        """Start following the hive."""
        self._topics.listen_to_all()

    def update(self) -> None:
        """Process new messages, and publish the markers where they changed."""
        self._topics.read_list()
        now = time.monotonic()
        for fact in self._inbox.take(BATCH):
            if isinstance(fact, PlannedPath):
                self._paths[fact.robot] = fact.points
            elif isinstance(fact, RobotPose):
                self._poses[fact.robot] = fact.pose
            elif isinstance(fact, HiveMessage):
                self._hive.take_in(fact.report, now, fact.stamp)
        self._hive.tick(now)
        self._hive.take_changes()
        while not self._met.empty():
            self._map.listen_to_drive(self._met.get())
        self._read_places(now)
        hive = self._hive
        shown = self._board.update(hive.tasks, hive.robots, self._paths, self._poses, self._places)
        if shown != self._last:
            self._last = shown
            self._publisher.publish(_array(*shown))

    def _read_places(self, now: float) -> None:
        """Read the places of the building, which the fleet's launch may set after this start."""
        if not self._places and now - self._looked > _LOOK_FOR_PLACES:
            self._looked = now
            self._places = hive_places()


def _array(markers: list[Marker], gone: list[tuple[str, int]]) -> MarkerArray:
    header = Header(stamp=rospy.Time.now(), frame_id="map")
    deletions = [
        MarkerMsg(header=header, ns=space, id=number, action=MarkerMsg.DELETE)
        for space, number in gone
    ]
    return MarkerArray([*deletions, *(_message(marker, header) for marker in markers)])


def _message(marker: Marker, header: Header) -> MarkerMsg:
    half = marker.pose.yaw / 2
    turn = Quaternion(0.0, 0.0, math.sin(half), math.cos(half))
    return MarkerMsg(
        header=header,
        ns=marker.space,
        id=marker.number,
        type=_TYPES[marker.shape],
        action=MarkerMsg.ADD,
        pose=Pose(Point(marker.pose.x, marker.pose.y, marker.height), turn),
        scale=Vector3(*marker.size),
        color=ColorRGBA(*marker.color),
        text=marker.text,
        points=[Point(x, y, marker.height) for x, y in marker.points],
    )


def main() -> None:
    """Run until the node is shut down."""
    init_node("task_markers")
    mend_links()
    node = TaskMarkers()
    node.start()
    while not rospy.is_shutdown():
        node.update()
        time.sleep(PERIOD)
