# SPDX-License-Identifier: BSD-3-Clause
"""Path lengths on the hive's map topic."""

from __future__ import annotations

from typing import TYPE_CHECKING

import rospy
from nav_msgs.msg import OccupancyGrid
from rospy.numpy_msg import numpy_msg

from blackboard.costing.euclidean_lengths import EuclideanLengths
from blackboard.costing.traffic_conditions import NO_TRAFFIC
from blackboard.domain.settings import TrafficSettings
from blackboard.ros.startup import wait_for
from blackboard.ros.traffic_told import TrafficTold
from hive_common.errors import MapError
from hive_common.ros import params
from hive_common.ros.conversions import grid_from_msg

if TYPE_CHECKING:
    from blackboard.costing.grid_path_lengths import GridPathLengths
    from blackboard.costing.traffic_conditions import TrafficConditions
    from blackboard.domain.path_lengths import PathLengths
    from blackboard.domain.settings import PathSettings
    from blackboard.ros.talker import RosTalker
    from hive_common.grid_map import GridMap


class RosPathLengths:
    """Path lengths for robots of any radius, on one copy of the map.

    If the settings need a map, the constructor waits for it. With a traffic planner, paths lead
    around closed zones, and the time that robots lose in traffic is known.

    Args:
        talker: Its thread takes in later maps, and what the traffic planner tells.
        hive: Namespace of the hive, ending in a slash.
        settings: How path lengths are measured.

    Raises:
        rospy.ROSInterruptException: The node was shut down before there was a map.
        MapError: The map cannot be used.

    ROS Subscribers: `map` (nav_msgs/OccupancyGrid) in the hive's namespace; with a traffic
        planner `traffic_state` (robot_description/TrafficState).
    """

    def __init__(self, talker: RosTalker, hive: str, settings: PathSettings) -> None:
        self._grid: GridMap | None = None
        self._traffic = NO_TRAFFIC
        self._made: dict[float, GridPathLengths] = {}
        self._straight = EuclideanLengths()
        if settings.distance == "euclidean":
            return
        # This loads scipy, 6 MB, which only members with a map need; and it does so now, because
        # later a heartbeat might be missed.
        from blackboard.costing.grid_path_lengths import GridPathLengths  # noqa: PLC0415

        self._on_map = GridPathLengths
        topic = f"{hive}map"
        kind = numpy_msg(OccupancyGrid)
        remedy = "start a map server, or set ~distance to euclidean"
        self._grid = grid_from_msg(wait_for(topic, kind, "map", remedy))
        rospy.Subscriber(topic, kind, self._take, talker, queue_size=1)
        if params.read(TrafficSettings, f"{hive}blackboard").traffic == "planned":
            self._follow_traffic(talker, hive)

    def of(self, radius: float) -> PathLengths:
        """Return the path lengths of a robot that keeps a radius [m] from what is blocked."""
        if self._grid is None:
            return self._straight
        if radius not in self._made:
            self._made[radius] = self._on_map(self._grid, radius, self._traffic)
        return self._made[radius]

    def _follow_traffic(self, talker: RosTalker, hive: str) -> None:
        def use(traffic: TrafficConditions) -> None:
            talker.call(lambda: self._use(self._grid, traffic))

        told = TrafficTold(hive, talker.now, use)
        self._traffic = told.conditions

    def _take(self, msg: OccupancyGrid, talker: RosTalker) -> None:
        try:
            grid = grid_from_msg(msg)
        except MapError as error:
            rospy.logwarn(f"a new map is ignored: {error}")
            return
        talker.call(lambda: self._use(grid, self._traffic))

    def _use(self, grid: GridMap | None, traffic: TrafficConditions) -> None:
        self._grid, self._traffic = grid, traffic
        if grid is not None:
            for lengths in self._made.values():
                lengths.use(grid, traffic)
