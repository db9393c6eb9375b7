# SPDX-License-Identifier: BSD-3-Clause
"""The hive's map as a node of this package uses it: the first one, and those that replace it."""

from __future__ import annotations

import queue
import threading
import traceback
from typing import TYPE_CHECKING

import rospy
from nav_msgs.msg import OccupancyGrid
from robot_description.msg import MapInUse
from rospy.numpy_msg import numpy_msg

from hive_common.errors import MapError
from hive_common.map_id import checksum_of
from hive_common.ros.conversions import map_from_msg

if TYPE_CHECKING:
    from collections.abc import Callable

    from hive_common.grid_map import GridMap
    from hive_common.ros.names import RobotNames

_LOOK = 0.02  # time between two looks whether the node is shut down [s, wall clock]
_PATIENCE = 5.0  # time between two warnings that there is no map [s, wall clock]


class MapTopic:
    """The latched topic `map` of a hive.

    A map that cannot be used ends a node that waits for its first one, and is ignored later.

    Attributes:
        checksum: Of the map as it is now; empty before there is one.

    ROS Subscribers: `map` (nav_msgs/OccupancyGrid) of the hive.
    """

    def __init__(self, hive: str) -> None:
        """Listen; `hive` is the hive's namespace and ends in a slash."""
        self.checksum = ""
        self._topic = f"{hive}map"
        self._came = threading.Event()
        self._chart: GridMap | MapError | None = None
        self._followers: list[Callable[[GridMap], None]] = []
        self._heard: queue.Queue[OccupancyGrid] = queue.Queue()
        # A process may read all topics in one thread, which must not wait for a large map.
        threading.Thread(target=self._work, name="map", daemon=True).start()
        rospy.Subscriber(self._topic, numpy_msg(OccupancyGrid), self._heard.put, queue_size=1)

    def chart(self, go_on: Callable[[], None] = lambda: None) -> GridMap:
        """Return the map as it is now; wait for the first one, and warn while there is none.

        `go_on` is called again and again meanwhile.

        Raises:
            MapError: The first one cannot be used.
            rospy.ROSInterruptException: The node was shut down.
        """
        waited = 0.0
        while not self._came.wait(_LOOK):
            if rospy.is_shutdown():
                raise rospy.ROSInterruptException
            go_on()
            waited += _LOOK
            if waited >= _PATIENCE:
                waited = 0.0
                rospy.logwarn(f"no map on {self._topic} yet; start a map server")
        if isinstance(self._chart, MapError):
            raise self._chart
        assert self._chart is not None  # noqa: S101  (it has come)
        return self._chart

    def follow(self, take: Callable[[GridMap], None]) -> None:
        """Have each later map taken in, in a thread of its own."""
        self._followers.append(take)

    def _work(self) -> None:
        while True:
            msg = self._heard.get()
            try:
                if self._heard.empty():  # otherwise there is a newer one
                    self._take(msg)
            except Exception:  # noqa: BLE001  (a defect, which must not keep the next map out)
                rospy.logerr(f"a map could not be taken in: {traceback.format_exc()}")
            finally:
                self._heard.task_done()

    def _take(self, msg: OccupancyGrid) -> None:
        is_first = not self._came.is_set()
        try:
            chart = map_from_msg(msg)
        except MapError as error:
            if is_first:
                self._chart = error
            else:
                rospy.logerr(f"a new map is ignored: {error}")
        else:
            checksum = checksum_of(chart)
            if checksum == self.checksum:
                return  # it comes again with each new connection
            self._chart, self.checksum = chart, checksum
            for take in () if is_first else self._followers:
                take(chart)
        self._came.set()


class MapTeller:
    """Tells which map one part of a robot uses.

    ROS Publishers: `map_in_use` (robot_description/MapInUse, latched) of the robot.
    """

    def __init__(self, names: RobotNames, part: str) -> None:
        self._part = part
        self._publisher = rospy.Publisher(
            names.of("map_in_use"), MapInUse, queue_size=1, latch=True
        )

    def tell(self, checksum: str) -> None:
        """Tell that it uses the map of a checksum from now on."""
        self._publisher.publish(MapInUse(node=self._part, checksum=checksum))
