# SPDX-License-Identifier: BSD-3-Clause
"""A robot's `move_base` on ROS without a master."""

from __future__ import annotations

import contextlib
import math
from concurrent.futures import ThreadPoolExecutor
from types import SimpleNamespace
from typing import TYPE_CHECKING, Any

import pytest

try:
    import numpy as np
    import rospy
    import tf2_ros
    from actionlib_msgs.msg import GoalStatus, GoalStatusArray
    from move_base_msgs.msg import MoveBaseGoal
    from nav_msgs.srv import GetPlanRequest
    from sensor_msgs.msg import LaserScan
    from std_msgs.msg import Float32

    from hive_common.grid_map import GridMap
    from hive_common.map_id import checksum_of
    from hive_common.pose import STOP, Pose
    from hive_common.ros.conversions import pose_to_msg, transform_to_msg
    from hive_common.ros.inbox import Inbox
    from hive_common.ros.names import RobotNames
    from hive_navigation.control.goal_tracker import NavigationSettings
    from hive_navigation.mapf.route import PlanNumber, Route, Wait
    from hive_navigation.planning.zoned_planner import ZonedPlanner
    from hive_navigation.ros import move_base_node
    from hive_navigation.ros.conversions import routes_from_msg, routes_to_msg
    from hive_navigation.ros.move_base_node import MoveBase
    from hive_navigation.traffic.neighbourhood import Neighbourhood
    from robot_description.models import load_model
except ImportError:  # no ROS, or no OMPL
    collect_ignore_glob = ["test_move_base_*.py"]

if TYPE_CHECKING:
    from collections.abc import Callable

    from geometry_msgs.msg import TransformStamped

    from hive_common.zone import Zone
    from hive_navigation.traffic.right_of_way import Announcement

SIDE = 10.0  # of the hall, which has a wall of 0.2 m around it [m]


def hall() -> GridMap:
    blocked = np.zeros((200, 200), dtype=bool)
    blocked[:4] = blocked[-4:] = True
    blocked[:, :4] = blocked[:, -4:] = True
    return GridMap.of_blocked(blocked, 0.05)


class Server:
    """An action server with at most one goal."""

    def __init__(self) -> None:
        self.outcome: tuple[str, str] | None = None
        self._new: MoveBaseGoal | None = None
        self._is_active = False

    def register_goal_callback(self, callback: Callable[[], None]) -> None:
        self._has_goal = callback

    def register_preempt_callback(self, callback: Callable[[], None]) -> None:
        self._preempted = callback

    def send(self, goal: MoveBaseGoal) -> None:
        self._new, self.outcome = goal, None
        if self._is_active:
            self._preempted()
        self._has_goal()

    def start(self) -> None: ...

    def is_active(self) -> bool:
        return self._is_active

    def is_new_goal_available(self) -> bool:
        return self._new is not None

    def accept_new_goal(self) -> MoveBaseGoal | None:
        goal, self._new, self._is_active = self._new, None, True
        return goal

    def set_succeeded(self, _result: object, text: str) -> None:
        self._is_active, self.outcome = False, ("succeeded", text)

    def set_aborted(self, _result: object, text: str) -> None:
        self._is_active, self.outcome = False, ("aborted", text)

    def publish_feedback(self, _feedback: object) -> None: ...


class Robot:
    """A robot's `move_base` on ROS without a master: it stands in the hall, at (2, 2)."""

    def __init__(self, monkeypatch: pytest.MonkeyPatch) -> None:
        self.model, self.side, self.hall = load_model("ld60"), SIDE, hall()
        self.now = 100.0
        self.pose: Pose | None = Pose(2.0, 2.0, 0.0)
        self.odd_transform: TransformStamped | None = None
        self.published: dict[str, list[Any]] = {}
        self.warned: list[str] = []
        self.announced: list[Announcement] = []
        self.services: dict[str, Callable[[Any], Any]] = {}
        self.velocity = STOP
        self._hear: dict[str, Callable[[Any], None]] = {}
        self._inbox = Inbox()
        self.map = SimpleNamespace(checksum="")
        monkeypatch.setattr(rospy, "Publisher", self._publisher)
        monkeypatch.setattr(rospy, "Subscriber", self._subscribe)
        monkeypatch.setattr(rospy, "Service", lambda name, _, serve: self._serve(name, serve))
        monkeypatch.setattr(rospy, "on_shutdown", lambda _: None)
        monkeypatch.setattr(rospy, "get_name", lambda: "/robot1/move_base")
        monkeypatch.setattr(rospy, "get_time", lambda: self.now)
        monkeypatch.setattr(rospy.Time, "now", lambda: rospy.Time.from_sec(self.now))
        for name in (
            "logwarn",
            "logwarn_throttle",
            "logwarn_throttle_identical",
            "logerr_throttle_identical",
        ):
            monkeypatch.setattr(rospy, name, lambda *said: self.warned.append(said[-1]))
        monkeypatch.setattr(
            move_base_node, "read_settings", lambda *_: NavigationSettings(settle=0.0)
        )
        monkeypatch.setattr(move_base_node, "read_model", lambda _: self.model)
        self._use(self.hall)
        surroundings: Any = SimpleNamespace(
            inbox=self._inbox,
            transforms=SimpleNamespace(
                lookup_transform=self._transform, get_latest_common_time=self._common_time
            ),
            heard=Neighbourhood(),
            planner=lambda _: self._planner,
            announce=lambda announcement, _: self.announced.append(announcement),
            give_routes_to=lambda take: setattr(self, "_take_routes", take),
            every=lambda _, act: setattr(self, "_round", act),
            when_set_back=lambda act: setattr(self, "_begin_anew", act),
            when_map_changes=lambda act: setattr(self, "_change_map", act),
            when_zones_change=lambda act: setattr(self, "_change_zones", act),
            map=self.map,
            catch_up_with=lambda until: setattr(self, "_recent_until", until),
        )
        self.server = Server()
        monkeypatch.setattr(
            move_base_node.actionlib, "SimpleActionServer", lambda *_, **__: self.server
        )
        monkeypatch.setattr(move_base_node.action_servers, "start", lambda _: None)
        MoveBase(RobotNames("/", "robot1"), surroundings).start()

    def change_map(self, grid: GridMap) -> None:
        """Have the map server serve another map."""
        self._use(grid)
        self._change_map()

    def change_zones(self, *zones: Zone) -> None:
        """Have the traffic planner tell of other zones."""
        self._planner.use(self._planner.around(zones))
        self._change_zones()

    def _use(self, grid: GridMap) -> None:
        self._planner = ZonedPlanner(grid, self.model.base.circumscribed_radius)
        self.map.checksum = checksum_of(grid)

    def set_clock_back(self, now: float) -> None:
        """Set ROS time back, and have the control loop notice it."""
        self.now = now
        self._begin_anew()

    def _publisher(self, topic: str, *_: object, **__: object) -> SimpleNamespace:
        return SimpleNamespace(publish=self.published.setdefault(topic, []).append)

    def _subscribe(self, topic: str, _: type, hear: Callable[[Any], None], **__: object) -> None:
        self._hear[topic] = hear

    def _serve(self, name: str, serve: Callable[[Any], Any]) -> None:
        self.services[name] = serve

    def _transform(self, _parent: str, child: str, _time: rospy.Time) -> TransformStamped:
        if self.odd_transform is not None:
            return self.odd_transform
        if self.pose is None or child != "robot1/base_footprint":
            raise tf2_ros.LookupException("nothing known")
        return transform_to_msg(self.pose, "map", child, rospy.Time.from_sec(self.now))

    def _common_time(self, parent: str, child: str) -> rospy.Time:
        return self._transform(parent, child, rospy.Time(0)).header.stamp

    @property
    def recent_until(self) -> dict[str, float]:
        """Until when what it senses counts as recent [s]."""
        self._inbox.empty()
        return self._recent_until()

    def send(self, x: float, y: float) -> None:
        goal = pose_to_msg(Pose(x, y, 0.0), "map", rospy.Time.from_sec(self.now))
        self.server.send(MoveBaseGoal(goal))

    def hear(self, topic: str, message: object) -> None:
        self._hear[topic](message)

    def measure(self, **fields: object) -> None:
        """Have the laser measure that nothing is in range, or something else."""
        nothing = {
            "angle_min": 0.0,
            "angle_increment": math.tau / 360,
            "range_min": 0.1,
            "range_max": 8.0,
            "ranges": np.full(360, math.inf, dtype=np.float32),
        }
        scan = LaserScan(**nothing | fields)
        scan.header.stamp = rospy.Time.from_sec(self.now)
        self.hear("/robot1/scan", scan)

    def transform_at(self, time: float) -> TransformStamped:
        """Return where the robot is, as a transform of a time [s]."""
        assert self.pose is not None
        stamp = rospy.Time.from_sec(time)
        return transform_to_msg(self.pose, "map", "robot1/base_footprint", stamp)

    @property
    def failures(self) -> int:
        """How many messages could not be handled."""
        return self._inbox.failures

    @property
    def good(self) -> dict[str, Any]:
        """What the robot hears and is asked, by topic, service or other name."""
        goal = pose_to_msg(Pose(6.0, 3.0, 0.0), "map", rospy.Time.from_sec(self.now))
        plan = PlanNumber(2, 1)
        places = ((2.0, 2.0), (4.0, 2.5), (6.0, 3.0))
        route = Route("robot1", plan, (6.0, 3.0), 0, places, (Wait(1, "robot2", 3),), True)
        scan = LaserScan(
            angle_increment=math.tau / 16, range_min=0.1, range_max=8.0, ranges=[3.0] * 16
        )
        scan.header.stamp = rospy.Time.from_sec(self.now)
        return {
            "/robot1/scan": scan,
            "/robot1/pick/status": GoalStatusArray(status_list=[GoalStatus(status=1)]),
            "/robot1/move_base_simple/goal": goal,
            "/robot1/speed_limit": Float32(0.5),
            "goal": MoveBaseGoal(goal),
            "/robot1/move_base/make_plan": GetPlanRequest(start=goal, goal=goal, tolerance=0.1),
            "transform": self.transform_at(self.now),
            "routes": routes_to_msg(plan, [route], self.now, "map"),
        }

    def take(self, kind: str, message: Any) -> None:
        """Have the robot hear or be asked something; see `good`."""
        if kind == "goal":
            self.server.send(message)
        elif kind == "transform":
            self.odd_transform = message
        elif kind == "routes":
            with contextlib.suppress(ValueError):  # which the process logs
                self._take_routes(routes_from_msg(message)[1])
        elif kind in self.services:
            self.ask(kind, message)
        else:
            if isinstance(message, LaserScan):  # as it arrives at the node
                message.ranges = np.array(message.ranges, dtype=np.float32)
            self.hear(kind, message)

    def ask(self, service: str, request: object) -> Any:
        """Return the answer of a service."""
        with ThreadPoolExecutor(1) as caller:
            answer = caller.submit(self.services[service], request)
            while not answer.done():
                self._inbox.wait(timeout=0.01)
            self._inbox.empty()
            return answer.result()

    def measure_box(self) -> None:
        """Have the laser see a box of 0.2 m at (4, 2), as long as the robot looks along y = 2."""
        assert self.pose is not None
        angles = np.arange(360) * math.tau / 360 + self.pose.yaw
        ahead = 4.0 - self.pose.x
        with np.errstate(divide="ignore"):
            reach = ahead / np.cos(angles)
        hit = (reach > 0) & (np.abs(self.pose.y + reach * np.sin(angles) - 2.0) < 0.1)
        self.measure(ranges=np.where(hit, reach, np.inf).astype(np.float32))

    def drive(self, seconds: float, measure: Callable[[], None] | None = None) -> float:
        """Run the control loop at 10 Hz with a scan before each round; return the way driven."""
        way = 0.0
        for _ in range(round(10 * seconds)):
            (measure or self.measure)()
            self.round()
            way += self._move()
        return way

    def round(self) -> None:
        """Run the control loop once."""
        sent = self.published["/robot1/cmd_vel"]
        sent.clear()
        self._inbox.empty()
        self._round()
        if sent:
            twist = sent[-1]
            self.velocity = (twist.linear.x, twist.linear.y, twist.angular.z)

    def _move(self) -> float:
        """Move as commanded for 0.1 s."""
        vx, _, wz = self.velocity
        if self.pose is not None:
            x, y, yaw = self.pose
            yaw += 0.05 * wz
            self.pose = Pose(x + 0.1 * vx * math.cos(yaw), y + 0.1 * vx * math.sin(yaw), yaw)
            self.pose = Pose(self.pose.x, self.pose.y, yaw + 0.05 * wz)
        self.now += 0.1
        return abs(0.1 * vx)


@pytest.fixture
def robot(monkeypatch: pytest.MonkeyPatch) -> Robot:
    return Robot(monkeypatch)
