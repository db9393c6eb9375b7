# SPDX-License-Identifier: BSD-3-Clause
"""A robot's localization on a map by its laser, with the topics and services of ROS's `amcl`."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
import rospy
import tf2_ros
from geometry_msgs.msg import PoseArray, PoseWithCovarianceStamped
from nav_msgs.msg import Odometry
from rospy.numpy_msg import numpy_msg
from sensor_msgs.msg import LaserScan
from std_srvs.srv import Empty, EmptyRequest, EmptyResponse

from hive_common.errors import MapError
from hive_common.ros.conversions import (
    covariance_from_msg,
    covariance_to_msg,
    planar_pose,
    pose_from_msg,
    transform_to_msg,
)
from hive_common.ros.inbox import Inbox
from hive_common.ros.names import RobotNames, own_names
from hive_navigation.localization.amcl_settings import WITHOUT_EFFECT, AmclSettings
from hive_navigation.localization.likelihood_field import BeamChooser, LikelihoodField
from hive_navigation.localization.localizer import Localizer
from hive_navigation.localization.odometry_history import OdometryHistory
from hive_navigation.localization.particle_filter import ParticleFilter
from hive_navigation.ros.map_topic import MapTeller, MapTopic
from hive_navigation.ros.scan_reader import ScanReader
from hive_navigation.ros.startup import read_model, read_settings, run_node

if TYPE_CHECKING:
    from collections.abc import Callable

    from hive_common.geometry import Array
    from hive_common.grid_map import GridMap
    from hive_common.pose import Pose
    from robot_description.scan import Scan

MAP_FRAME = "map"

_MAX_SHOWN = 500  # maximum number of particles published for RViz


class Amcl:
    """Localizes one robot.

    On a new map it goes on from where it takes the robot to be.

    ROS Subscribers: `scan` (sensor_msgs/LaserScan), `odom` (nav_msgs/Odometry), `initialpose`
        (geometry_msgs/PoseWithCovarianceStamped, frame map).
    ROS Publishers: `amcl_pose` (geometry_msgs/PoseWithCovarianceStamped, latched, with every scan
        that is used), `particlecloud` (geometry_msgs/PoseArray), tf from map to the robot's odom
        with every scan; and that of `MapTeller`.
    ROS Services: `global_localization`, `request_nomotion_update` (std_srvs/Empty).
    ROS Parameters: see config/amcl.yaml.
    """

    def __init__(self, names: RobotNames, map_topic: MapTopic) -> None:
        """Start at the initial pose of the parameters.

        A mistake in the parameters ends it before it waits for the map.

        Raises:
            ParameterError: A parameter is missing, unknown or has a value that is not allowed.
            MapError: The map cannot be used.
        """
        model = read_model(names)
        base = "omni" if model.base.holonomic else "diff"
        settings = read_settings(
            AmclSettings, names.of("amcl"), WITHOUT_EFFECT, odom_model_type=base
        )
        self._names = names
        self._odom_frame = f"{names.robot}/odom"
        self._tolerance = rospy.Duration.from_sec(settings.transform_tolerance)
        chart = map_topic.chart()
        self._make_field: Callable[[GridMap], LikelihoodField] = lambda chart: LikelihoodField(
            chart.cells, chart.resolution, chart.origin[:2], settings
        )
        self._filter = ParticleFilter(self._make_field(chart), settings, np.random.default_rng())
        chooser = BeamChooser(model.laser, settings.laser_max_beams)
        self._localizer = Localizer(self._filter, chooser, settings)
        self._chart = chart
        self._begin_at(settings.initial_pose, settings.initial_covariance)
        self._history = OdometryHistory()
        self._reader = ScanReader(names.of("scan"))
        self._scan: tuple[rospy.Time, Scan] | None = None  # until the odometry of its time comes
        self._inbox = Inbox()
        self._map_topic = map_topic
        map_topic.follow(self._take_map)

    def run(self) -> None:
        """Localize until the node is shut down."""
        self._broadcaster = tf2_ros.TransformBroadcaster()
        self._poses = rospy.Publisher(
            self._names.of("amcl_pose"), PoseWithCovarianceStamped, queue_size=1, latch=True
        )
        self._map_teller = MapTeller(self._names, "amcl")
        self._map_teller.tell(self._map_topic.checksum)
        self._cloud = rospy.Publisher(self._names.of("particlecloud"), PoseArray, queue_size=1)
        topics: dict[str, tuple[type, Callable[..., None]]] = {
            "odom": (Odometry, self._drive),
            "scan": (numpy_msg(LaserScan), self._see),
            "initialpose": (PoseWithCovarianceStamped, self._restart_at),
        }
        for topic, (kind, handle) in topics.items():
            rospy.Subscriber(self._names.of(topic), kind, self._later(handle), queue_size=5)
        self._serve("global_localization", self._restart_anywhere)
        self._serve("request_nomotion_update", self._localizer.update_once)
        while not rospy.is_shutdown():
            self._inbox.wait(timeout=0.5)

    def _take_map(self, chart: GridMap) -> None:
        """Prepare for a new map, in another thread than the main one, which then changes to it."""
        field = self._make_field(chart)

        def change() -> None:
            rospy.loginfo(f"{self._names.robot} is localized on a new map from now on")
            self._chart = chart
            self._localizer.change_map(field)
            self._map_teller.tell(self._map_topic.checksum)

        self._inbox.put(change)

    def _later(self, handle: Callable[..., None]) -> Callable[..., None]:
        """Return a callback that has the main thread handle a message."""
        return lambda msg: self._inbox.put(lambda: handle(msg))

    def _serve(self, name: str, action: Callable[[], None]) -> None:
        """Open a service that has the main thread do something."""

        def called(_request: EmptyRequest) -> EmptyResponse:
            self._inbox.put(action)
            return EmptyResponse()

        rospy.Service(self._names.of(name), Empty, called)

    def _restart_anywhere(self) -> None:
        try:
            self._localizer.restart_anywhere()
        except MapError as error:
            rospy.logerr(f"global_localization changes nothing: {error}")

    def _restart_at(self, msg: PoseWithCovarianceStamped) -> None:
        frame = msg.header.frame_id.lstrip("/")
        try:
            pose, covariance = pose_from_msg(msg.pose.pose), covariance_from_msg(msg.pose)
        except ValueError as error:
            rospy.logwarn(f"initialpose is ignored: {error}")
            return
        if frame not in {"", MAP_FRAME}:
            rospy.logwarn(f"initialpose in frame '{frame}' is ignored; send it in {MAP_FRAME}")
            return
        self._begin_at(pose, covariance)

    def _begin_at(self, pose: Pose, covariance: Array) -> None:
        """Localize from a pose on, and say so if no robot can stand there."""
        refusal = self._chart.refusal(pose)
        if refusal:
            rospy.logerr(
                f"{self._names.robot} is said to start at {pose}, which {refusal}; put x, y and "
                f"yaw right, or send the true pose on {self._names.of('initialpose')}"
            )
        self._localizer.restart_at(pose, covariance)

    def _drive(self, msg: Odometry) -> None:
        try:
            self._history.add(msg.header.stamp.to_sec(), pose_from_msg(msg.pose.pose))
        except ValueError as error:
            rospy.logwarn_throttle_identical(10, f"odometry is ignored: {error}")
            return
        if self._scan is not None:
            self._weigh(*self._scan)

    def _see(self, msg: LaserScan) -> None:
        scan = self._reader.read(msg)
        if scan is not None:
            self._scan = (msg.header.stamp, scan)
            self._weigh(*self._scan)

    def _weigh(self, stamp: rospy.Time, scan: Scan) -> None:
        """Use a scan, once the odometry of its time has come."""
        odometry = self._history.at(stamp.to_sec())
        if odometry is None:
            return
        self._scan = None
        if self._localizer.see(stamp.to_sec(), odometry, scan):
            self._publish(stamp)
        frame = self._localizer.map_to_odom
        if frame is not None:
            ahead = stamp + self._tolerance
            self._broadcaster.sendTransform(
                transform_to_msg(frame, MAP_FRAME, self._odom_frame, ahead)
            )

    def _publish(self, stamp: rospy.Time) -> None:
        estimate = self._localizer.estimate
        if estimate is None:
            return
        pose = PoseWithCovarianceStamped()
        pose.header.stamp, pose.header.frame_id = stamp, MAP_FRAME
        pose.pose.pose = planar_pose(estimate.pose)
        pose.pose.covariance = covariance_to_msg(estimate.covariance)
        self._poses.publish(pose)
        if not self._cloud.get_num_connections():
            return
        cloud = PoseArray()
        cloud.header.stamp, cloud.header.frame_id = stamp, MAP_FRAME
        every = max(1, len(self._filter.particles) // _MAX_SHOWN)
        cloud.poses = [planar_pose(pose) for pose in self._filter.particles[::every].tolist()]
        self._cloud.publish(cloud)


def main() -> int:
    """Run one robot's localization; see `Amcl`. Return the exit code."""
    return run_node("amcl", _run)


def _run() -> None:
    names = own_names()
    Amcl(names, MapTopic(names.hive)).run()
