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
from robot_description.msg import Traffic

from hive_navigation.ros.map_topic import MapTopic

if TYPE_CHECKING:
    from collections.abc import Iterator

_QUEUE = 1000  # announcements that wait to be read; a robot sends a dozen a second


class Ears:
    """What robots announce, and the map.

    Callbacks only fill queues; all methods belong to the main thread.

    Attributes:
        map: The map.
        since: When a robot was heard for the first time [s]; infinite before.
    """

    def __init__(self, hive: str) -> None:
        """Listen in a hive's namespace, which ends in a slash."""
        self.since = math.inf
        self.map = MapTopic(hive)
        self._said: queue.Queue[tuple[float, Traffic]] = queue.Queue()
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
