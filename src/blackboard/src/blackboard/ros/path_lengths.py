# SPDX-License-Identifier: BSD-3-Clause
"""Path lengths on the hive's map topic."""

from __future__ import annotations

from typing import TYPE_CHECKING

import rospy
from nav_msgs.msg import OccupancyGrid
from robot_description.msg import MapInUse
from rospy.numpy_msg import numpy_msg

from blackboard.costing.euclidean_lengths import EuclideanLengths
from blackboard.costing.traffic_conditions import NO_TRAFFIC
from blackboard.domain.settings import TrafficSettings
from blackboard.domain.validation import MAX_NAME
from blackboard.ros.startup import wait_for
from blackboard.ros.traffic_told import TrafficTold
from hive_common.errors import MapError
from hive_common.map_id import NO_MAP, MapId, checksum_of
from hive_common.ros import params
from hive_common.ros.conversions import map_from_msg

if TYPE_CHECKING:
    from collections.abc import Callable

    from blackboard.costing.grid_path_lengths import GridPathLengths
    from blackboard.costing.traffic_conditions import TrafficConditions
    from blackboard.domain.path_lengths import PathLengths
    from blackboard.domain.settings import PathSettings
    from blackboard.process.talker import ProcessTalker
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

    ROS Subscribers: `map` (nav_msgs/OccupancyGrid) and `map_in_use` (robot_description/MapInUse)
        in the hive's namespace; with a traffic planner `traffic_state`
        (robot_description/TrafficState).
    """

    def __init__(self, talker: ProcessTalker, hive: str, settings: PathSettings) -> None:
        self._grid: GridMap | None = None
        self._traffic = NO_TRAFFIC
        self._made: dict[float, GridPathLengths] = {}
        self._straight = EuclideanLengths()
        self._map = NO_MAP
        self._names: dict[str, str] = {}
        self._followers: list[Callable[[MapId], None]] = []
        if settings.distance == "euclidean":
            return
        # This loads scipy, 6 MB, which only members with a map need; and it does so now, because
        # later a heartbeat might be missed.
        from blackboard.costing.grid_path_lengths import GridPathLengths  # noqa: PLC0415

        self._on_map = GridPathLengths
        topic = f"{hive}map"
        kind = numpy_msg(OccupancyGrid)
        remedy = "start a map server, or set ~distance to euclidean"
        chart = map_from_msg(wait_for(topic, kind, "map", remedy))
        self._grid, self._map = chart.free_or_blocked(), MapId("", checksum_of(chart))
        rospy.Subscriber(topic, kind, self._take, talker, queue_size=1)
        rospy.Subscriber(f"{hive}map_in_use", MapInUse, self._learn_name, talker, queue_size=1)
        if params.read(TrafficSettings, f"{hive}blackboard").traffic == "planned":
            self._follow_traffic(talker, hive)

    def of(self, radius: float) -> PathLengths:
        """Return the path lengths of a robot that keeps a radius [m] from what is blocked."""
        if self._grid is None:
            return self._straight
        if radius not in self._made:
            self._made[radius] = self._on_map(self._grid, radius, self._traffic)
        return self._made[radius]

    def follow(self, tell: Callable[[MapId], None]) -> None:
        """Tell now, and whenever that changes, which map is used; in the talker's thread."""
        self._followers.append(tell)
        tell(self._map)

    def _learn_name(self, msg: MapInUse, talker: ProcessTalker) -> None:
        def learn() -> None:
            self._names = {msg.checksum: msg.name}
            self._note(self._map.checksum)

        talker.call(learn)

    def _note(self, checksum: str) -> None:
        known = self._map.name if checksum == self._map.checksum else ""
        used = MapId(self._names.get(checksum, known)[:MAX_NAME], checksum)
        if used != self._map:
            self._map = used
            for tell in self._followers:
                tell(used)

    def _follow_traffic(self, talker: ProcessTalker, hive: str) -> None:
        def use(traffic: TrafficConditions) -> None:
            talker.call(lambda: self._use(self._grid, traffic))

        told = TrafficTold(hive, talker.now, use)
        self._traffic = told.conditions

    def _take(self, msg: OccupancyGrid, talker: ProcessTalker) -> None:
        try:
            chart = map_from_msg(msg)
        except MapError as error:
            rospy.logwarn(f"a new map is ignored: {error}")
            return
        grid, checksum = chart.free_or_blocked(), checksum_of(chart)

        def take() -> None:
            if checksum != self._map.checksum:  # a latched map comes again with each connection
                rospy.loginfo(f"uses a new map from now on, {checksum}")
                self._use(grid, self._traffic)
                self._note(checksum)

        talker.call(take)

    def _use(self, grid: GridMap | None, traffic: TrafficConditions) -> None:
        self._grid, self._traffic = grid, traffic
        if grid is not None:
            for lengths in self._made.values():
                lengths.use(grid, traffic)
