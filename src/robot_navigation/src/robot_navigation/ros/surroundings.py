# SPDX-License-Identifier: BSD-3-Clause
"""What the robots of one process share: map and planners, transforms, traffic, the control loop.

A process of one robot shares with nobody; one that hosts many (docs/decisions/092) reads /tf,
`traffic` and the map once for all of them.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

import rospy
from robot_description.msg import Routes, Traffic

from hive_common.ros.conversions import grid_from_msg
from hive_common.ros.inbox import Inbox
from hive_common.ros.onward_clock import SetBack
from hive_common.ros.transforms import Transforms
from robot_navigation.planning.ompl_planner import OmplPlanner
from robot_navigation.ros.conversions import (
    routes_from_msg,
    traffic_from_msg,
    traffic_to_msg,
)
from robot_navigation.ros.startup import wait_for_map
from robot_navigation.traffic.neighbourhood import Neighbourhood

if TYPE_CHECKING:
    from collections.abc import Callable

    from nav_msgs.msg import OccupancyGrid

    from robot_navigation.mapf.route import Route
    from robot_navigation.traffic.right_of_way import Announcement


_ROUNDING = 1e-6  # a multiple of a period may come out a little less than whole


class Surroundings:
    """The world around the robots of this process.

    Everything belongs to the thread that calls `run`; what comes in goes through `inbox`.

    Attributes:
        inbox: Actions for the control loop.
        transforms: The transforms of the last five seconds.
        heard: What every robot announces, those of this process included.

    ROS Subscribers: `map` (nav_msgs/OccupancyGrid), `traffic` (robot_description/Traffic),
        `routes` (robot_description/Routes), of the hive; tf.
    ROS Publishers: `traffic`.
    """

    def __init__(self, hive: str) -> None:
        """Listen; `hive` is the hive's namespace and ends in a slash."""
        self.inbox = Inbox()
        self.transforms = Transforms(cache_time=5.0)
        self.heard = Neighbourhood()
        self._hive = hive
        self._chart: OccupancyGrid | None = None
        self._planners: dict[float, OmplPlanner] = {}
        self._rounds: list[_Rounds] = []
        self._route_takers: list[Callable[[tuple[Route, ...]], None]] = []
        self._was_set_back = SetBack(rospy.get_time)
        self._anew: list[Callable[[], None]] = []
        self._traffic = rospy.Publisher(f"{hive}traffic", Traffic, queue_size=10)
        rospy.Subscriber(f"{hive}traffic", Traffic, self._hear, queue_size=50)
        rospy.Subscriber(f"{hive}routes", Routes, self._hear_routes, queue_size=10)

    def chart(self) -> OccupancyGrid:
        """Return the map; wait for it the first time.

        Raises:
            rospy.ROSInterruptException: The node was shut down.
        """
        if self._chart is None:
            self._chart = wait_for_map(f"{self._hive}map")
        return self._chart

    def planner(self, radius: float) -> OmplPlanner:
        """Return the planner for robots of a radius [m]; wait for the map the first time.

        Raises:
            rospy.ROSInterruptException: The node was shut down.
        """
        if radius not in self._planners:
            self._planners[radius] = OmplPlanner(grid_from_msg(self.chart()), radius)
        return self._planners[radius]

    def announce(self, announcement: Announcement, frame: str) -> None:
        """Tell the robots of this process and all others what one of them is about to do."""
        self.heard.hear(announcement)
        self._traffic.publish(traffic_to_msg(announcement, frame))

    def _hear(self, msg: Traffic) -> None:
        if msg._connection_header["callerid"] == rospy.get_name():  # noqa: SLF001  (rospy has no other way)
            return
        try:
            announcement = traffic_from_msg(msg, rospy.get_time())
        except ValueError as error:
            rospy.logwarn_throttle_identical(10, str(error))
            return
        self.inbox.put(lambda: self.heard.hear(announcement))

    def give_routes_to(self, take: Callable[[tuple[Route, ...]], None]) -> None:
        """Pass on each plan of the traffic planner from now on, in the control loop's thread."""
        self._route_takers.append(take)

    def _hear_routes(self, msg: Routes) -> None:
        try:
            _, routes = routes_from_msg(msg)
        except ValueError as error:
            rospy.logwarn_throttle_identical(10, str(error))
            return
        self.inbox.put(lambda: self._pass_on(routes))

    def _pass_on(self, routes: tuple[Route, ...]) -> None:
        for take in self._route_takers:
            take(routes)

    def every(self, period: float, action: Callable[[], None]) -> None:
        """Have the control loop do something repeatedly, first at once [s, ROS time].

        Rounds of one period fall due at the same moments in all processes, so that simulated time,
        which waits for the commands of each round, waits once.
        """
        self._rounds.append(_Rounds(period, action))

    def when_set_back(self, action: Callable[[], None]) -> None:
        """Have the control loop do something when ROS time was set back."""
        self._anew.append(action)

    def run(self) -> None:
        """Run the control loop until the node is shut down."""
        while not rospy.is_shutdown():
            self.inbox.empty()
            if self._was_set_back():
                rospy.logwarn("ROS time was set back; the navigation begins anew")
                self.heard = Neighbourhood()
                for action in self._anew:
                    action()
            for rounds in self._rounds:
                rounds.call_if_due(rospy.get_time())
            wait = min(rounds.due for rounds in self._rounds) - rospy.get_time()
            try:
                rospy.sleep(max(wait, 0.0))
            except rospy.ROSTimeMovedBackwardsException:
                continue
            except rospy.ROSInterruptException:
                return


@dataclass
class _Rounds:
    period: float  # [s]
    action: Callable[[], None]
    due: float = 0.0  # when the next is due [s]

    def call_if_due(self, now: float) -> None:
        """Do a round if it is due; rounds that were missed are left out."""
        if self.due - self.period * (1 + _ROUNDING) <= now < self.due:
            return
        self.due = self.period * (math.floor(now / self.period + _ROUNDING) + 1)
        self.action()
