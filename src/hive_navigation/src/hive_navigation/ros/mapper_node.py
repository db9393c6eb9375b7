# SPDX-License-Identifier: BSD-3-Clause
"""Maps while a robot drives, with the topics and the service of ROS's `gmapping`."""

from __future__ import annotations

import math
import time
from typing import TYPE_CHECKING

import rospy
import tf2_ros
from nav_msgs.msg import MapMetaData, Odometry
from nav_msgs.msg import OccupancyGrid as OccupancyGridMsg
from nav_msgs.srv import GetMap, GetMapRequest, GetMapResponse
from rospy.numpy_msg import numpy_msg
from sensor_msgs.msg import LaserScan
from std_msgs.msg import Header
from std_srvs.srv import Trigger, TriggerRequest, TriggerResponse

from hive_common.pose import Pose
from hive_common.ros.conversions import map_msg, pose_from_msg, transform_to_msg
from hive_common.ros.inbox import Inbox
from hive_common.ros.names import own_names
from hive_navigation.localization.odometry_history import OdometryHistory
from hive_navigation.mapping.mapper import Mapper
from hive_navigation.mapping.mapper_settings import WITHOUT_EFFECT, MapperSettings
from hive_navigation.mapping.occupancy import OccupancyGrid
from hive_navigation.ros.scan_reader import ScanReader
from hive_navigation.ros.startup import read_model, read_settings, run_node
from hive_navigation.ros.topic_monitor import TopicMonitor

if TYPE_CHECKING:
    from robot_description.scan import Scan

MAP_FRAME = "map"

REFINE_TIMEOUT = 600.0  # how long a request to refine the map may take [s, wall clock]


class MapperNode:
    """Maps the surroundings of one robot.

    ROS Subscribers: `scan` (sensor_msgs/LaserScan), `odom` (nav_msgs/Odometry), of the robot.
    ROS Publishers: `map` (nav_msgs/OccupancyGrid), `map_metadata` (nav_msgs/MapMetaData), of the
        hive, latched; tf from map to the robot's odom, with every scan.
    ROS Services: `dynamic_map` (nav_msgs/GetMap), of the hive: the current map; `refine_map`
        (std_srvs/Trigger), of the hive: match all scans to each other and redraw the map.
    ROS Parameters: see config/mapper.yaml.
    """

    def __init__(self, hive: str, name: str, mount: Pose, settings: MapperSettings) -> None:
        """Start with an empty map.

        `hive` is its namespace and ends in a slash; the laser is at `mount` in the base frame.
        """
        self._hive = hive
        self._odom_frame = f"{name}/odom"
        self._settings = settings
        corner = settings.xmin, settings.ymin
        self._grid = OccupancyGrid(settings.size, corner, settings.delta)
        self._mapper = Mapper(
            mount,
            settings.initial_pose,
            self._grid,
            settings.linearUpdate,
            settings.angularUpdate,
        )
        self._reader = ScanReader(rospy.resolve_name("scan"))
        self._history = OdometryHistory()
        self._scan: tuple[rospy.Time, Scan] | None = None
        self._stamp, self._published_at = rospy.Time(), -math.inf
        self._inbox = Inbox()
        self._monitor = TopicMonitor(self._inbox)

    def run(self) -> None:
        """Map until the node is shut down."""
        self._broadcaster = tf2_ros.TransformBroadcaster()
        self._map, self._metadata = (
            rospy.Publisher(f"{self._hive}{topic}", kind, queue_size=1, latch=True)
            for topic, kind in (("map", OccupancyGridMsg), ("map_metadata", MapMetaData))
        )
        rospy.Service(f"{self._hive}dynamic_map", GetMap, self._map_called)
        rospy.Service(f"{self._hive}refine_map", Trigger, self._refine_called)
        monitor, scan = self._monitor, numpy_msg(LaserScan)
        monitor.subscribe("odom", Odometry, self._drive, 20, "start the robot's base")
        monitor.subscribe("scan", scan, self._look, 20, "start the robot's laser")
        while not rospy.is_shutdown():
            self._inbox.wait(timeout=0.5)
            self._see()
            self._monitor.warn()

    def _drive(self, msg: Odometry) -> None:
        try:
            self._history.add(msg.header.stamp.to_sec(), pose_from_msg(msg.pose.pose))
        except ValueError as error:
            rospy.logwarn_throttle_identical(10, f"odometry is ignored: {error}")

    def _look(self, msg: LaserScan) -> None:
        scan = self._reader.read(msg)
        if scan is not None:
            # Only the latest waits: a mapper that falls behind skips scans rather than lag.
            self._scan = (msg.header.stamp, scan.within(self._settings.maxUrange))

    def _see(self) -> None:
        """Use the latest scan, once the odometry of its time has come."""
        if self._scan is None:
            return
        stamp, scan = self._scan
        odometry = self._history.at(stamp.to_sec())
        if odometry is None:
            return
        if not self._mapper.scans:
            beams = len(scan.ranges)
            rospy.loginfo(f"mapping starts at {self._settings.initial_pose} with {beams} beams")
        self._scan, self._stamp = None, stamp
        self._draw(odometry, scan)

    def _draw(self, odometry: Pose, scan: Scan) -> None:
        self._mapper.see(odometry, scan)
        ahead = rospy.Duration.from_sec(self._settings.tf_delay)
        self._broadcaster.sendTransform(
            transform_to_msg(
                self._mapper.correction, MAP_FRAME, self._odom_frame, self._stamp + ahead
            )
        )
        now = self._stamp.to_sec()
        if not self._published_at <= now < self._published_at + self._settings.map_update_interval:
            self._published_at = now
            self._publish()
        if self._grid.full:
            rospy.logwarn_once("the map has reached its maximum size; set a larger ~delta")

    def _publish(self) -> None:
        message = self._message()
        self._map.publish(message)
        self._metadata.publish(message.info)

    def _message(self) -> OccupancyGridMsg:
        return map_msg(Header(stamp=self._stamp, frame_id=MAP_FRAME), self._grid.as_map())

    def _map_called(self, _request: GetMapRequest) -> GetMapResponse:
        return self._inbox.ask(lambda: GetMapResponse(self._message()), GetMapResponse())

    def _refine_called(self, _request: TriggerRequest) -> TriggerResponse:
        return self._inbox.ask(
            self._refine, TriggerResponse(False, "refining goes on; wait"), REFINE_TIMEOUT
        )

    def _refine(self) -> TriggerResponse:
        mapper, begun = self._mapper, time.monotonic()
        if not mapper.scans:
            return TriggerResponse(False, "no scan yet; start the robot's laser")
        mapper.refine()
        self._publish()
        summary = f"matched {mapper.scans} scans to each other in {time.monotonic() - begun:.0f} s"
        rospy.loginfo(summary)
        return TriggerResponse(True, summary)


def main() -> int:
    """Run a mapper; see `MapperNode`. Return the exit code."""
    return run_node("mapper", _run)


def _run() -> None:
    names = own_names()
    settings = read_settings(MapperSettings, without_effect=WITHOUT_EFFECT)
    MapperNode(*names, Pose(*read_model(names).laser.pose), settings).run()
