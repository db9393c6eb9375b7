# SPDX-License-Identifier: BSD-3-Clause
"""Path lengths on the hive's map topic."""

from __future__ import annotations

from typing import TYPE_CHECKING

import rospy
from nav_msgs.msg import OccupancyGrid
from rospy.numpy_msg import numpy_msg

from blackboard.costing.euclidean_lengths import EuclideanLengths
from blackboard.ros.startup import wait_for

if TYPE_CHECKING:
    from blackboard.costing.grid_path_lengths import GridPathLengths
    from blackboard.domain.path_lengths import PathLengths
    from blackboard.domain.settings import PathSettings
    from blackboard.ros.talker import RosTalker
    from hive_common.grid_map import GridMap


class RosPathLengths:
    """Path lengths for robots of any radius, on one copy of the map.

    If the settings need a map, the constructor waits for it.

    Args:
        talker: Its thread takes in later maps.
        hive: Namespace of the hive, ending in a slash.
        settings: How path lengths are measured.

    Raises:
        rospy.ROSInterruptException: The node was shut down before there was a map.

    ROS Subscribers: `map` (nav_msgs/OccupancyGrid) in the hive's namespace.
    """

    def __init__(self, talker: RosTalker, hive: str, settings: PathSettings) -> None:
        self._grid: GridMap | None = None
        self._made: dict[float, GridPathLengths] = {}
        if settings.distance == "euclidean":
            return
        # These load scipy, 6 MB, which only members with a map need; and they do it now, because
        # later a heartbeat might be missed.
        from blackboard.costing.grid_path_lengths import GridPathLengths  # noqa: PLC0415
        from hive_common.ros.conversions import grid_from_msg  # noqa: PLC0415

        self._on_map = GridPathLengths
        topic = f"{hive}map"
        kind = numpy_msg(OccupancyGrid)
        remedy = "start a map server, or set ~distance to euclidean"
        self._grid = grid_from_msg(wait_for(topic, kind, "map", remedy))
        rospy.Subscriber(
            topic,
            kind,
            lambda msg: talker.call(lambda: self._use(grid_from_msg(msg))),
            queue_size=1,
        )

    def of(self, radius: float) -> PathLengths:
        """Return the path lengths of a robot that keeps a radius [m] from what is blocked."""
        if self._grid is None:
            return EuclideanLengths()
        if radius not in self._made:
            self._made[radius] = self._on_map(self._grid, radius)
        return self._made[radius]

    def _use(self, grid: GridMap) -> None:
        self._grid = grid
        for lengths in self._made.values():
            lengths.use(grid)
