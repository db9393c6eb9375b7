# SPDX-License-Identifier: BSD-3-Clause
"""Ways on the hive's map topic."""

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
    from hive_common.map_file import GridMap

_PATIENCE = 5.0
"""Wall time after which it is said again that there is no map yet [s]."""


class RosPathLengths:
    """The ways of robots of any radius, on one copy of the map.

    Making it waits for the map where the settings need one.

    Args:
        talker: Whose thread later maps are taken in by.
        hive: Namespace of the hive, ending in a slash.
        settings: How the length of a way is measured.

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
        """Return the ways of a robot whose middle comes so close to what is blocked [m]."""
        if self._grid is None:
            return EuclideanLengths()
        if radius not in self._made:
            self._made[radius] = GridPathLengths(self._grid, radius)
        return self._made[radius]

    def _use(self, grid: GridMap) -> None:
        self._grid = grid
        for ways in self._made.values():
            ways.use(grid)


def _next_map(topic: str) -> OccupancyGrid | None:
    """Return a map, or None after a while, having said what is missing."""
    try:
        return rospy.wait_for_message(topic, numpy_msg(OccupancyGrid), timeout=_PATIENCE)
    except rospy.ROSInterruptException:
        raise
    except rospy.ROSException:
        rospy.logwarn(f"no map on {topic} yet; start a map server, or set ~distance to euclidean")
        return None
