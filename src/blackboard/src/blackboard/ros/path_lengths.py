# SPDX-License-Identifier: BSD-3-Clause
"""Path lengths on the hive's map topic."""

from __future__ import annotations

from typing import TYPE_CHECKING

import rospy
from nav_msgs.msg import OccupancyGrid
from rospy.numpy_msg import numpy_msg

from blackboard.costing.path_lengths import EuclideanLengths, GridPathLengths
from hive_common.ros.conversions import grid_from_msg

if TYPE_CHECKING:
    from blackboard.domain.path_lengths import PathLengths
    from blackboard.domain.settings import PathSettings
    from blackboard.ros.talker import RosTalker
    from hive_common.grid_map import GridMap

_PATIENCE = 5.0
"""Wall time between two warnings that the map is missing [s]."""


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
        topic = f"{hive}map"
        first = None
        while first is None:
            first = _next_map(topic)
        self._grid = grid_from_msg(first)
        rospy.Subscriber(
            topic,
            numpy_msg(OccupancyGrid),
            lambda msg: talker.call(lambda: self._use(grid_from_msg(msg))),
            queue_size=1,
        )

    def of(self, radius: float) -> PathLengths:
        """Return the path lengths of a robot that keeps a radius [m] from what is blocked."""
        if self._grid is None:
            return EuclideanLengths()
        if radius not in self._made:
            self._made[radius] = GridPathLengths(self._grid, radius)
        return self._made[radius]

    def _use(self, grid: GridMap) -> None:
        self._grid = grid
        for lengths in self._made.values():
            lengths.use(grid)


def _next_map(topic: str) -> OccupancyGrid | None:
    """Return the next map, or None after a while and a warning."""
    try:
        return rospy.wait_for_message(topic, numpy_msg(OccupancyGrid), timeout=_PATIENCE)
    except rospy.ROSInterruptException:
        raise
    except rospy.ROSException:
        rospy.logwarn(f"no map on {topic} yet; start a map server, or set ~distance to euclidean")
        return None
