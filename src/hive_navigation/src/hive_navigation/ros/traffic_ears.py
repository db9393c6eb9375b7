# SPDX-License-Identifier: BSD-3-Clause
"""Hears the robots and the map from the node's start on, while the planner is still being loaded.

To load the planner takes a second, and to hear everybody as long. A robot without a route waits
for both after a takeover, so they go on at the same time. That is why this module imports nothing
of the planner.
"""

from __future__ import annotations

import math
import queue
from typing import TYPE_CHECKING

import rospy
from nav_msgs.msg import OccupancyGrid
from robot_description.msg import Traffic
from rospy.numpy_msg import numpy_msg

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

_QUEUE = 1000  # announcements that wait to be read; a robot sends a dozen a second
_LOOK = 0.02  # time between two looks whether there is a map [s, wall clock]
_MAP_PATIENCE = 5.0  # time between two warnings that there is no map [s, wall clock]


class Ears:
    """What robots announce, and the map.

    Callbacks only fill queues; all methods belong to the main thread.

    Attributes:
        since: When a robot was heard for the first time [s]; infinite before.
    """

    def __init__(self, hive: str) -> None:
        """Listen in a hive's namespace, which ends in a slash."""
        self.since = math.inf
        self._topic = f"{hive}map"
        self._said: queue.Queue[tuple[float, Traffic]] = queue.Queue()
        self._maps: queue.Queue[OccupancyGrid] = queue.Queue()
        self._subscriber = rospy.Subscriber(
            self._topic, numpy_msg(OccupancyGrid), self._maps.put, queue_size=1
        )
        rospy.Subscriber(f"{hive}traffic", Traffic, self._hear, queue_size=_QUEUE)

    def _hear(self, msg: Traffic) -> None:
        self._said.put((rospy.get_time(), msg))

    def news(self) -> Iterator[Traffic]:
        """Yield the newest announcement of each robot that has spoken since the last call."""
        newest: dict[str, Traffic] = {}
        while not self._said.empty():
            time, msg = self._said.get()
            newest[msg.name] = msg
            self.since = min(time, self.since)
        yield from newest.values()

    def map(self, go_on: Callable[[], None] = lambda: None) -> OccupancyGrid:
        """Wait for the map and return it, its data as an array; warn while there is none.

        `go_on` is called again and again meanwhile.

        Raises:
            rospy.ROSInterruptException: The node was shut down.
        """
        waited = 0.0
        while self._maps.empty():
            if rospy.is_shutdown():
                raise rospy.ROSInterruptException
            go_on()
            rospy.rostime.wallsleep(_LOOK)
            waited += _LOOK
            if waited >= _MAP_PATIENCE:
                waited = 0.0
                rospy.logwarn(f"no map on {self._topic} yet; start a map server")
        self._subscriber.unregister()
        return self._maps.get()
