# SPDX-License-Identifier: BSD-3-Clause
"""The traffic planner: a coordinator with the topics of the hive.

The member that leads starts it as a child process with its epoch, and ends it when it stops
leading. It keeps nothing that it cannot rebuild from what robots announce, but for the zones that
an operator has closed: these it tells on `traffic_state`, and gets them back as a parameter.
"""

from __future__ import annotations

import itertools
import math
import time
from typing import TYPE_CHECKING

import attrs
import rospy
from diagnostic_msgs.msg import DiagnosticArray
from robot_description.msg import Routes, TrafficState, ZoneCommand
from std_msgs.msg import Header
from visualization_msgs.msg import Marker, MarkerArray

from hive_common.map_id import checksum_of
from hive_common.ros.inbox import Inbox
from hive_common.ros.onward_clock import SetBack
from hive_navigation.mapf.reachability import unreached
from hive_navigation.mapf.roadmap_builder import build_roadmap
from hive_navigation.planning.clearance import ClearanceField
from hive_navigation.ros.conversions import routes_to_msg, traffic_from_msg
from hive_navigation.ros.traffic_markers import lanes_marker, traffic_markers
from hive_navigation.ros.traffic_parameters import TrafficParameters
from hive_navigation.ros.traffic_report import TrafficReport, Waiting, out_of_reach
from hive_navigation.ros.traffic_told import diagnostics_of, state_to_msg
from hive_navigation.traffic.deadlock import LockWatch
from hive_navigation.traffic.landmarks import Landmarks
from hive_navigation.traffic.lock_resolver import ResolvingCoordinator

if TYPE_CHECKING:
    from hive_navigation.mapf.route import Route
    from hive_navigation.ros.planner_progress import ProgressTeller
    from hive_navigation.ros.traffic_ears import Ears
    from hive_navigation.traffic.right_of_way import Announcement

_MAP_FRAME = "map"

_PERIOD = 0.25  # time between two steps of the coordinator [s]
_TELL_PERIOD = 1.0  # time between two messages that tell the state [s, wall clock]
_LOOK = 0.02  # time between two looks at the clock and the inbox [s, wall clock]

_LISTEN = 0.6
"""How long the planner listens before its first plan [s]: idle robots announce twice a second."""

_SILENT = 5.0  # a robot that has not announced itself for longer is no longer told of [s]


class TrafficPlanner:
    """Plans for all robots of the hive.

    Callbacks only fill queues, which the main loop empties before each step. The constructor
    waits for the map and until robots were heard.

    ROS Subscribers: `map` (nav_msgs/OccupancyGrid), `traffic` (robot_description/Traffic),
        `zone_command` (robot_description/ZoneCommand), of the hive.
    ROS Publishers: `routes` (robot_description/Routes), once a second and when a robot gets a
        goal; `traffic_state` (robot_description/TrafficState), 1 Hz, latched;
        `traffic_lanes` (visualization_msgs/Marker), latched, and `traffic_markers`
        (visualization_msgs/MarkerArray), 1 Hz while somebody listens, for RViz; `/diagnostics`
        (diagnostic_msgs/DiagnosticArray), 1 Hz: WARN while robots cannot go on or wait for long,
        or cannot reach a place.
    ROS Parameters: `~epoch`, higher than that of any planner before, 1 by default; `~zones` as in
        a fleet file, none by default; `~closed`, the names of those that are closed, by default
        those that say so; `~places`, a list of landmarks, each with `name`, `at`, [x, y], and
        `is_goal`, whether robots are sent there (true by default); none by default.

    Raises:
        ParameterError: A parameter has a value that is not allowed.
        rospy.ROSInterruptException: The node was shut down.
    """

    def __init__(self, hive: str, ears: Ears, progress: ProgressTeller) -> None:
        """Listen and make the roadmap; `hive` is the hive's namespace and ends in a slash."""
        self._inbox = Inbox()
        self._ears = ears
        self._robots: dict[str, Announcement] = {}
        self._news: dict[str, Announcement] = {}  # what the coordinator has not heard yet
        self._routes: dict[str, Route] = {}
        self._tell_at = 0.0  # [s, monotonic]
        self._stepped_at = -math.inf
        given = TrafficParameters.read()
        self._epoch = given.epoch
        self._goals = {place.name: place.at for place in given.landmarks if place.is_goal}
        self._zones = given.zones
        watch = LockWatch()
        self._report = TrafficReport(Landmarks(given.landmarks, given.zones), watch)
        self._publisher = rospy.Publisher(f"{hive}routes", Routes, queue_size=10)
        state = f"{hive}traffic_state"
        self._state = rospy.Publisher(state, TrafficState, queue_size=1, latch=True)
        self._lanes = rospy.Publisher(f"{hive}traffic_lanes", Marker, queue_size=1, latch=True)
        self._markers = rospy.Publisher(f"{hive}traffic_markers", MarkerArray, queue_size=1)
        self._diagnostics = rospy.Publisher("/diagnostics", DiagnosticArray, queue_size=10)
        chart = ears.map.chart(lambda: progress.go_on("waits for the map"))
        self._checksum = checksum_of(chart)
        progress.say("works out where on the map there is room")
        self._field = ClearanceField.of(chart.free_or_blocked())
        self._listen(progress)
        radii = sorted({robot.radius for robot in self._news.values()})
        self._least_radius = radii[0]
        # On a large map each of these takes seconds.
        steps = itertools.count(2)
        progress.say("makes the roadmap, step 1")
        roadmap = build_roadmap(
            self._field,
            radii,
            given.zones,
            lambda: progress.say(f"makes the roadmap, step {next(steps)}"),
        )
        progress.say("makes its first plan")
        self._coordinator = ResolvingCoordinator(self._field, roadmap, self._epoch, watch=watch)
        self._show_lanes()
        rospy.Subscriber(f"{hive}zone_command", ZoneCommand, self._obey, queue_size=10)

    def run(self) -> None:
        """Plan until the node is shut down, ROS time is set back, or there is another map."""
        self._was_set_back = SetBack(rospy.get_time)
        while not rospy.is_shutdown():
            now = rospy.get_time()
            if self._was_set_back():
                rospy.logwarn("ROS time was set back: the next traffic planner begins anew")
                return
            if self._ears.map.checksum != self._checksum:
                rospy.logwarn("there is a new map: the next traffic planner begins anew on it")
                return
            self._inbox.empty()
            self._hear()
            if _is_due(now, self._stepped_at, _PERIOD):
                self._stepped_at = now
                self._step(now)
            self._tell(now)
            rospy.rostime.wallsleep(_LOOK)

    def _listen(self, progress: ProgressTeller) -> None:
        """Wait until robots have been heard for so long that all were."""
        self._hear()
        while not self._news or not _is_due(rospy.get_time(), self._ears.since, _LISTEN):
            if rospy.is_shutdown():
                raise rospy.ROSInterruptException
            rospy.rostime.wallsleep(_LOOK)
            self._hear()
            progress.go_on("waits for robots")

    def _hear(self) -> None:
        """Take in what robots have announced since the last time."""
        for msg in self._ears.news():
            try:
                announcement = traffic_from_msg(msg, rospy.get_time())
            except ValueError as error:
                rospy.logwarn_throttle_identical(10, str(error))
            else:
                self._news[announcement.name] = announcement

    def _obey(self, msg: ZoneCommand) -> None:
        self._inbox.put(lambda: self._switch(msg.zone, closed=msg.closed))

    def _switch(self, zone: str, *, closed: bool) -> None:
        """Close or open a zone, and tell it at once, so that everybody remembers it."""
        names = [each.name for each in self._zones]
        if zone not in names:
            known = ", ".join(names) or "none; a fleet file names them under zones"
            rospy.logwarn(f"there is no zone {zone[:40]!r}; there are: {known}")
            return
        if closed:
            self._coordinator.close(zone)
        else:
            self._coordinator.open(zone)
        shut = self._coordinator.roadmap.closed
        self._zones = tuple(attrs.evolve(each, closed=each.name in shut) for each in self._zones)
        self._report.unreached.clear()
        self._show_lanes()
        self._tell_state()

    def _show_lanes(self) -> None:
        roadmap = self._coordinator.roadmap
        self._lanes.publish(lanes_marker(roadmap, self._least_radius, _header()))

    def _step(self, now: float) -> None:
        """Do one step of the coordinator, and tell what has changed."""
        for announcement in self._news.values():
            self._coordinator.hear(announcement)
        self._robots |= self._news
        self._news = {}
        routes = self._coordinator.step(now)
        if routes:
            self._routes = {route.robot: route for route in routes}
            self._publisher.publish(routes_to_msg(routes[0].plan, routes, now, _MAP_FRAME))
        self._check_reach()
        waiting = self._coordinator.waiting()
        self._report.note(
            now,
            [Waiting(w.robot, w.waits_for, *w.at, w.since) for w in waiting],
            {name: (robot.x, robot.y) for name, robot in self._robots.items()},
        )

    def _check_reach(self) -> None:
        """Find out which landmarks the robots that are new cannot reach, and say so."""
        reached = self._report.unreached
        for name in reached.keys() - self._robots.keys():
            del reached[name]
        new = self._robots.keys() - reached.keys()
        for name in new:
            robot = self._robots[name]
            here = (robot.x, robot.y)
            roadmap = self._coordinator.roadmap
            reached[name] = unreached(roadmap, self._field, robot.radius, here, self._goals)
        for text in out_of_reach({name: reached[name] for name in new}):
            rospy.logwarn(
                f"{text}: the way there is too narrow, or a zone keeps robots out; move the "
                "place, change the zone, or send other robots"
            )

    def _tell(self, now: float) -> None:
        """Tell the state once a second on the wall, also while a simulation is paused.

        Whoever started this process takes it to be alive as long as it does.
        """
        if time.monotonic() < self._tell_at:
            return
        self._tell_at = time.monotonic() + _TELL_PERIOD
        self._robots = {
            name: each for name, each in self._robots.items() if now - each.time < _SILENT
        }
        self._tell_state()
        self._diagnostics.publish(diagnostics_of(self._report, len(self._robots), _header()))
        if self._markers.get_num_connections():
            waits = self._report.waits
            shown = traffic_markers(self._routes, self._robots, waits, self._zones, _header())
            self._markers.publish(shown)

    def _tell_state(self) -> None:
        zones = [zone.name for zone in self._zones]
        closed = sorted(zone.name for zone in self._zones if zone.closed)
        robots = sorted(self._robots)
        self._state.publish(
            state_to_msg(self._report, self._epoch, robots, zones, closed, _header())
        )


def _header() -> Header:
    return Header(stamp=rospy.Time.now(), frame_id=_MAP_FRAME)


def _is_due(now: float, last: float, period: float) -> bool:
    """Return whether a period has passed [s], or the clock was set back."""
    return not last <= now < last + period
