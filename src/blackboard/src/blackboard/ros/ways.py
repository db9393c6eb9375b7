# SPDX-License-Identifier: BSD-3-Clause
"""Ways on the hive's map topic."""

from __future__ import annotations

from typing import TYPE_CHECKING

import rospy
from nav_msgs.msg import OccupancyGrid
from rospy.numpy_msg import numpy_msg

from blackboard.ros.conversions import grid_from_msg
from blackboard.ways import GridWays, StraightWays

if TYPE_CHECKING:
    from blackboard.ros.talker import RosTalker
    from blackboard.settings import WaysSettings
    from blackboard.ways import Ways

_PATIENCE = 5.0
"""Wall time after which it is said again that there is no map yet [s]."""


def make_ways(talker: RosTalker, hive: str, radius: float, settings: WaysSettings) -> Ways:
    """Make the ways that the settings name, waiting for the map where they need one.

    Args:
        talker: Whose thread later maps are taken in by.
        hive: Namespace of the hive, ending in a slash.
        radius: How close the middle of the robot may come to what is blocked [m].
        settings: How the length of a way is measured.

    Raises:
        rospy.ROSInterruptException: The node was shut down before there was a map.

    ROS Subscribers: `map` (nav_msgs/OccupancyGrid) in the hive's namespace.
    """
    if settings.distance == "euclidean":
        return StraightWays()
    topic = f"{hive}map"
    first = None
    while first is None:
        first = _next_map(topic)
    ways = GridWays(grid_from_msg(first), radius)
    rospy.Subscriber(
        topic,
        numpy_msg(OccupancyGrid),
        lambda msg: talker.call(lambda: ways.use(grid_from_msg(msg))),
        queue_size=1,
    )
    return ways


def _next_map(topic: str) -> OccupancyGrid | None:
    """Return a map, or None after a while, having said what is missing."""
    try:
        return rospy.wait_for_message(topic, numpy_msg(OccupancyGrid), timeout=_PATIENCE)
    except rospy.ROSInterruptException:
        raise
    except rospy.ROSException:
        rospy.logwarn(f"no map on {topic} yet; start a map server, or set ~distance to euclidean")
        return None
