# SPDX-License-Identifier: BSD-3-Clause
"""What the robots of one process share: map and planners, transforms, traffic, the control loop.

A process of one robot shares with nobody; one that hosts many (docs/decisions/092) reads /tf,
`traffic` and the map once for all of them.
"""

from __future__ import annotations

import math
import threading
import time
from dataclasses import dataclass
from typing import TYPE_CHECKING

import rospy
from robot_description.msg import Routes, Traffic, TrafficState

from hive_common.newest_epoch import NewestEpoch
from hive_common.ros.inbox import Inbox
from hive_common.ros.onward_clock import SetBack
from hive_common.ros.transforms import Transforms
from hive_common.ros.zones import zones_of
from hive_common.zone import with_closed
from hive_navigation.control.catching_up import ANNOUNCED, CatchingUp
from hive_navigation.planning.zoned_planner import ZonedPlanner
from hive_navigation.ros.conversions import (
    routes_from_msg,
    traffic_from_msg,
    traffic_to_msg,
)
from hive_navigation.ros.map_topic import MapTopic
from hive_navigation.traffic.neighbourhood import Neighbourhood

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from hive_common.grid_map import GridMap
    from hive_navigation.mapf.route import Route
    from hive_navigation.planning.zoned_planner import AroundZones
    from hive_navigation.traffic.right_of_way import Announcement


_HEARD = 2.0  # who has been silent for longer is not waited for [s, simulated time]
_LOOK = 0.3  # time between two looks whether the node is shut down [s, wall clock]
_ROUNDING = 1e-6  # a multiple of a period may come out a little less than whole


class Surroundings:
    """The world around the robots of this process.

    Everything belongs to the thread that calls `run`; what comes in goes through `inbox`.

    Attributes:
        inbox: Actions for the control loop.
        transforms: The transforms of the last five seconds.
        heard: What every robot announces, those of this process included.
        map: The map; see `when_map_changes`.

    ROS Subscribers: `map` (nav_msgs/OccupancyGrid), `traffic` (robot_description/Traffic),
        `routes` (robot_description/Routes), `traffic_state` (robot_description/TrafficState), of
        the hive; tf.
    ROS Publishers: `traffic`.
    ROS Parameters: `traffic_planner/zones` of the hive, read once.
    """

    def __init__(self, hive: str) -> None:
        """Listen; `hive` is the hive's namespace and ends in a slash."""
        self.inbox = Inbox()
        self.transforms = Transforms(cache_time=5.0)
        self.heard = Neighbourhood()
        self._hive = hive
        self.map = MapTopic(hive)
        self.map.follow(self._take_map)
        self._planners: dict[float, ZonedPlanner] = {}
        self._preparing = threading.Lock()  # for what threads of rospy's prepare
        self._prepared: dict[float, ZonedPlanner] = {}  # for the newest map
        self._zones = zones_of(hive)
        self._newest = NewestEpoch()
        self._rounds: list[_Rounds] = []
        self._route_takers: list[Callable[[tuple[Route, ...]], None]] = []
        self._was_set_back = SetBack(rospy.get_time)
        self._anew: list[Callable[[], None]] = []
        self._on_map: list[Callable[[], None]] = []
        self._on_zones: list[Callable[[], None]] = []
        self._own: set[str] = set()  # the robots of this process that have announced themselves
        self._catching_up = CatchingUp(rospy.get_time, time.monotonic)
        self._senses: list[Callable[[], dict[str, float]]] = []
        self._traffic = rospy.Publisher(f"{hive}traffic", Traffic, queue_size=10)
        rospy.Subscriber(f"{hive}traffic", Traffic, self._hear, queue_size=50)
        rospy.Subscriber(f"{hive}routes", Routes, self._hear_routes, queue_size=10)
        state = f"{hive}traffic_state"
        rospy.Subscriber(state, TrafficState, self._hear_state, queue_size=1)

    def planner(self, radius: float) -> ZonedPlanner:
        """Return the planner for robots of a radius [m]; wait for the map the first time.

        Raises:
            rospy.ROSInterruptException: The node was shut down.
        """
        if radius not in self._planners:
            grid = self.map.chart().free_or_blocked()
            with self._preparing:
                made = ZonedPlanner(grid, radius, self._zones)
                self._planners[radius] = self._prepared[radius] = made
        return self._planners[radius]

    def when_map_changes(self, action: Callable[[], None]) -> None:
        """Have the control loop do something as soon as `planner` returns those of a new map."""
        self._on_map.append(action)

    def when_zones_change(self, action: Callable[[], None]) -> None:
        """Have the control loop do something as soon as planners plan around other zones."""
        self._on_zones.append(action)

    def _take_map(self, chart: GridMap) -> None:
        """Prepare for a new map while the control loop goes on with the old one."""
        grid = chart.free_or_blocked()
        with self._preparing:
            made = {radius: ZonedPlanner(grid, radius, self._zones) for radius in self._planners}
            self._prepared = made
            self.inbox.put(lambda: self._change_map(made))

    def _change_map(self, planners: dict[float, ZonedPlanner]) -> None:
        rospy.loginfo("plans on a new map from now on")
        self._planners = planners
        for action in self._on_map:
            action()

    def _hear_state(self, msg: TrafficState) -> None:
        """Prepare for other zones in the same way as for another map."""
        with self._preparing:  # the old and the next planner may speak at once
            if not self._newest.admits(msg.epoch, rospy.get_time()):
                return
            zones = with_closed(self._zones, msg.closed)
            if zones == self._zones:
                return
            self._zones = zones
            around = [(each, each.around(zones)) for each in self._prepared.values()]
            self.inbox.put(lambda: self._change_zones(around))

    def _change_zones(self, around: Sequence[tuple[ZonedPlanner, AroundZones | None]]) -> None:
        for planner, zones in around:
            planner.use(zones)
        for action in self._on_zones:
            action()

    def announce(self, announcement: Announcement, frame: str) -> None:
        """Tell the robots of this process and all others what one of them is about to do."""
        self._own.add(announcement.name)
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

    def catch_up_with(self, recent_until: Callable[[], dict[str, float]]) -> None:
        """Have the control loop wait for the senses of a robot, in simulated time.

        The simulator waits for the commands of a robot that drives, and so for what it senses and
        hears. Real time waits for nobody, and then no round does.

        Args:
            recent_until: See `CatchingUp.wait`; the names differ from those of other robots.
        """
        self._senses.append(recent_until)

    def _catch_up(self) -> None:
        """Before a round that is due in simulated time, wait for what is late."""
        now = rospy.get_time()
        if not self._senses or rospy.rostime.is_wallclock():
            return
        if any(rounds.is_due(now) for rounds in self._rounds):
            late = self._catching_up.wait(self._recent_until, self.inbox.wait)
            if late:
                rospy.logwarn_throttle(10, f"nothing recent came in time from {', '.join(late)}")

    def _recent_until(self) -> dict[str, float]:
        """Return until when all that the robots of this process act on counts as recent [s]."""
        until: dict[str, float] = {}
        for senses in self._senses:
            until |= senses()
        for other in self.heard.others("", rospy.get_time(), _HEARD):
            # One that has no goal announces itself when it likes.
            if other.name not in self._own and (other.goal is not None or len(other.path) > 1):
                until[other.name] = other.time + ANNOUNCED
        return until

    def run(self) -> None:
        """Run the control loop until the node is shut down."""
        while not rospy.is_shutdown():
            self.inbox.empty()
            if self._was_set_back():
                rospy.logwarn("ROS time was set back; the navigation begins anew")
                self.heard = Neighbourhood()
                for action in self._anew:
                    action()
            self._catch_up()
            for rounds in self._rounds:
                rounds.call_if_due(rospy.get_time())
            try:
                _sleep_until(min(rounds.due for rounds in self._rounds))
            except rospy.ROSTimeMovedBackwardsException:
                continue
            except rospy.ROSInterruptException:
                return


def _sleep_until(due: float) -> None:
    """Sleep until a time [s, ROS time], or until that is set back.

    `rospy.sleep` counts from the time at which it looks at the clock. If that has gone on since
    the caller did, it sleeps past `due`, and a simulator that waits for the round waits in vain.
    """
    begun = rospy.get_time()
    if rospy.rostime.is_wallclock():
        rospy.sleep(max(due - begun, 0.0))
        return
    changed = rospy.rostime.get_rostime_cond()
    with changed:  # nobody changes the time between a look at it and the wait
        while begun <= rospy.get_time() < due and not rospy.is_shutdown():
            changed.wait(_LOOK)


@dataclass
class _Rounds:
    period: float  # [s]
    action: Callable[[], None]
    due: float = 0.0  # when the next is due [s]

    def is_due(self, now: float) -> bool:
        """Return whether a round is due; it is as well when the clock was set back."""
        return not self.due - self.period * (1 + _ROUNDING) <= now < self.due

    def call_if_due(self, now: float) -> None:
        """Do a round if it is due; rounds that were missed are left out."""
        if not self.is_due(now):
            return
        self.due = self.period * (math.floor(now / self.period + _ROUNDING) + 1)
        self.action()
