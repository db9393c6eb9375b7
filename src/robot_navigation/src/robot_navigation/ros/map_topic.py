# SPDX-License-Identifier: BSD-3-Clause
"""Waits for the map that a node cannot begin without."""

from __future__ import annotations

import rospy
from nav_msgs.msg import OccupancyGrid
from rospy.numpy_msg import numpy_msg

PATIENCE = 5.0
"""Time after which it is said again what is missing [s]."""


def wait_for_map(topic: str) -> OccupancyGrid:
    """Return the map with its data as an array; say what is missing while there is none.

    Args:
        topic: Of the latched nav_msgs/OccupancyGrid.

    Raises:
        rospy.ROSInterruptException: The node is shut down meanwhile.
    """
    while True:
        try:
            return rospy.wait_for_message(topic, numpy_msg(OccupancyGrid), timeout=PATIENCE)
        except rospy.ROSInterruptException:
            raise
        except rospy.ROSException:
            rospy.logwarn(f"no map on {topic} yet; start a map server")
