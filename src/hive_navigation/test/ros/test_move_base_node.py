# SPDX-License-Identifier: BSD-3-Clause
"""The node `move_base` between what it hears and what it drives, answers and says."""

from __future__ import annotations

import contextlib
import math
from concurrent.futures import ThreadPoolExecutor
from random import Random
from types import SimpleNamespace
from typing import TYPE_CHECKING, Any

import pytest

pytest.importorskip("rospy", reason="the node needs ROS")
pytest.importorskip("ompl")

import numpy as np
import rospy
import tf2_ros
from actionlib_msgs.msg import GoalStatus, GoalStatusArray
from diagnostic_msgs.msg import DiagnosticStatus
from move_base_msgs.msg import MoveBaseGoal
from nav_msgs.srv import GetPlanRequest
from sensor_msgs.msg import LaserScan
from std_msgs.msg import Float32
from std_srvs.srv import EmptyRequest

from hive_common.grid_map import GridMap
from hive_common.map_id import checksum_of
from hive_common.pose import STOP, Pose
from hive_common.ros.conversions import pose_to_msg, transform_to_msg
from hive_common.ros.inbox import Inbox
from hive_common.ros.names import RobotNames
from hive_lab.fuzz.mutations import Mutations, as_bytes
from hive_navigation.control.goal_tracker import NavigationSettings
from hive_navigation.mapf.route import PlanNumber, Route, Wait
from hive_navigation.planning.ompl_planner import OmplPlanner
from hive_navigation.ros import move_base_node
from hive_navigation.ros.conversions import routes_from_msg, routes_to_msg
from hive_navigation.ros.move_base_node import MoveBase
from hive_navigation.traffic.neighbourhood import Neighbourhood
from robot_description.models import load_model

if TYPE_CHECKING:
    from collections.abc import Callable

    from geometry_msgs.msg import TransformStamped

    from hive_navigation.traffic.right_of_way import Announcement

MODEL = load_model("ld60")
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
        monkeypatch.setattr(move_base_node, "read_model", lambda _: MODEL)
        self._use(hall())
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

    def _use(self, grid: GridMap) -> None:
        self._planner = OmplPlanner(grid, MODEL.base.circumscribed_radius)
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


BLIND = {
    "all unknown": {"ranges": np.full(360, math.nan, dtype=np.float32)},
    "no ranges": {"ranges": np.zeros(0, dtype=np.float32)},
    "all covered": {"ranges": np.zeros(360, dtype=np.float32)},
    "no angle between beams": {"angle_increment": 0.0},
    "no range": {"range_max": 0.0},
}


@pytest.mark.parametrize("fields", BLIND.values(), ids=BLIND)
def test_a_robot_whose_laser_goes_blind_stops_and_says_why(
    robot: Robot, fields: dict[str, Any]
) -> None:
    robot.send(8.0, 2.0)
    assert robot.drive(3.0) > 0.3

    robot.drive(1.2, lambda: robot.measure(**fields))

    assert robot.velocity == (0.0, 0.0, 0.0)
    [wrong] = fields
    assert robot.warned[-1].startswith(f"no scan on /robot1/scan can be used: {wrong}: ")
    status = robot.published["/diagnostics"][-1].status[0]
    assert status.level == DiagnosticStatus.WARN
    assert status.message.startswith(f"a scan on /robot1/scan is skipped: {wrong}: ")


def test_a_single_bad_scan_does_not_stop_a_robot_but_is_counted(robot: Robot) -> None:
    robot.send(8.0, 2.0)
    robot.drive(3.0)

    robot.drive(0.1, lambda: robot.measure(range_max=math.nan))
    way = robot.drive(0.5)

    assert way > 0.2
    assert robot.published["/diagnostics"][-1].status[0].values[0].value == "1"


def test_a_robot_whose_laser_sees_again_drives_on_and_tells_so(robot: Robot) -> None:
    robot.send(8.0, 2.0)
    robot.drive(3.0)
    robot.drive(5.0, lambda: robot.measure(ranges=[]))

    assert robot.drive(2.0) > 0.3
    assert robot.published["/diagnostics"][-1].status[0].level == DiagnosticStatus.OK


def test_a_goal_of_a_robot_that_stays_blind_is_aborted_with_the_reason(robot: Robot) -> None:
    robot.send(8.0, 2.0)
    robot.drive(1.0)

    robot.drive(33.0, lambda: robot.measure(ranges=[]))

    assert robot.server.outcome is not None
    state, text = robot.server.outcome
    assert state == "aborted"
    assert text.startswith("no scan on /robot1/scan can be used: ranges: 0; allowed: ")


def test_a_robot_whose_laser_dies_after_a_scan_from_the_future_stops(robot: Robot) -> None:
    robot.send(8.0, 2.0)
    robot.drive(3.0)

    robot.now += 1000.0
    robot.measure()
    robot.now -= 1000.0
    robot.drive(2.0, lambda: None)

    assert robot.velocity == (0.0, 0.0, 0.0)


def test_a_robot_whose_localization_is_far_ahead_of_its_time_stops(robot: Robot) -> None:
    robot.send(8.0, 2.0)
    robot.drive(3.0)

    robot.odd_transform = robot.transform_at(robot.now + 1000.0)
    robot.drive(0.5)

    assert robot.velocity == (0.0, 0.0, 0.0)


def test_a_speed_limit_that_is_not_a_number_changes_nothing(robot: Robot) -> None:
    robot.hear("/robot1/speed_limit", Float32(0.1))
    robot.send(8.0, 2.0)
    robot.drive(2.0)

    robot.hear("/robot1/speed_limit", Float32(math.nan))
    robot.drive(2.0)

    assert 0.0 < robot.velocity[0] <= 0.1 + 1e-6


@pytest.mark.parametrize("seed", range(3))
def test_odd_messages_goals_and_requests_end_no_round_and_the_next_goal_is_reached(
    robot: Robot, seed: int
) -> None:
    random = Random(seed)
    mutations = Mutations(random, ["map", "robot1/base_footprint", "robot1/odom"])
    for _ in range(400):
        kind = random.choice(list(robot.good))
        message, what = mutations.mutate(as_bytes(robot.good[kind]), type(robot.good[kind]))
        try:
            robot.take(kind, message)
            robot.round()
        except Exception as error:
            raise AssertionError(f"{kind}: {what}") from error
        assert robot.failures == 0, f"{kind}: {what}: {robot.warned[-1]}"
        robot.odd_transform = None
        robot.drive(0.1)

    robot.pose = Pose(2.0, 2.0, 0.0)
    robot.hear("/robot1/speed_limit", Float32(0.0))
    robot.hear("/robot1/pick/status", GoalStatusArray())
    robot.ask("/robot1/move_base/clear_costmaps", EmptyRequest())
    robot.send(8.0, 2.0)
    robot.drive(30.0)
    assert robot.server.outcome is not None
    assert robot.server.outcome[0] == "succeeded"


def test_a_robot_drives_on_to_its_goal_when_the_clock_is_set_back(robot: Robot) -> None:
    robot.send(8.0, 2.0)
    robot.drive(2.0)

    robot.set_clock_back(5.0)
    robot.drive(20.0)

    assert robot.server.outcome is not None
    assert robot.server.outcome[0] == "succeeded"


def test_a_robot_that_is_stuck_gives_up_in_time_also_when_the_clock_is_set_back(
    robot: Robot,
) -> None:
    robot.send(8.0, 2.0)
    robot.drive(2.0)
    robot.set_clock_back(5.0)
    stuck = robot.pose

    def hold() -> None:
        robot.pose = stuck
        robot.measure()

    robot.drive(NavigationSettings.give_up + 5.0, hold)

    assert robot.server.outcome is not None
    assert robot.server.outcome[0] == "aborted"


def test_a_robot_without_a_goal_stands_still_when_the_clock_is_set_back(robot: Robot) -> None:
    robot.drive(1.0)

    robot.set_clock_back(5.0)

    assert robot.drive(2.0) == 0.0


def test_a_robot_whose_scans_end_when_the_clock_is_set_back_stops(robot: Robot) -> None:
    robot.send(8.0, 2.0)
    robot.drive(2.0)

    robot.set_clock_back(5.0)
    way = robot.drive(2.0, lambda: None)

    assert way < 0.3


def plan(robot: Robot, goal: tuple[float, float], tolerance: float = 0.0, **start: Any) -> Any:
    """Ask for a plan, from where the robot is unless told; return its points."""
    request = GetPlanRequest(tolerance=tolerance)
    request.goal = pose_to_msg(Pose(*goal, 0.0), "map", rospy.Time(0))
    if start:
        request.start = pose_to_msg(Pose(start["x"], start["y"], 0.0), "map", rospy.Time(0))
    answer = robot.ask("/robot1/move_base/make_plan", request)
    return [(pose.pose.position.x, pose.pose.position.y) for pose in answer.plan.poses]


def test_a_plan_with_an_empty_start_begins_where_the_robot_is(robot: Robot) -> None:
    assert plan(robot, (8.0, 3.0)) == [(2.0, 2.0), (8.0, 3.0)]
    assert plan(robot, (8.0, 3.0), x=5.0, y=5.0)[0] == (5.0, 5.0)


def test_a_plan_with_an_empty_start_of_a_robot_that_is_lost_is_empty_and_says_why(
    robot: Robot,
) -> None:
    robot.pose = None

    assert plan(robot, (8.0, 3.0)) == []
    assert robot.warned == ["make_plan: nothing known"]


def test_a_plan_to_a_wall_ends_at_the_nearest_place_within_the_tolerance(robot: Robot) -> None:
    in_the_wall = (9.9, 5.0)

    far = plan(robot, in_the_wall, tolerance=0.3)
    near = plan(robot, in_the_wall, tolerance=1.0)

    room = SIDE - 0.2 - MODEL.base.circumscribed_radius - near[-1][0]
    assert far == []
    assert near[0] == (2.0, 2.0)
    assert 0.05 <= room < 0.11
    assert near[-1][1] == pytest.approx(5.0, abs=0.03)


def test_a_plan_off_the_map_ends_on_it_and_one_to_a_free_place_ends_there(robot: Robot) -> None:
    assert plan(robot, (12.0, 5.0), tolerance=3.0)[-1][0] < SIDE
    assert plan(robot, (8.0, 3.0), tolerance=3.0)[-1] == (8.0, 3.0)


@pytest.mark.parametrize("tolerance", [math.nan, -1.0])
def test_a_tolerance_that_is_none_counts_as_0(robot: Robot, tolerance: float) -> None:
    assert plan(robot, (9.9, 5.0), tolerance) == []
    assert plan(robot, (8.0, 3.0), tolerance)[-1] == (8.0, 3.0)


@pytest.mark.parametrize("again", [False, True])
def test_clear_costmaps_lets_the_robot_plan_through_what_is_gone(
    robot: Robot, again: bool
) -> None:
    robot.send(8.0, 2.0)
    robot.drive(12.0, robot.measure_box)
    around = robot.published["/robot1/move_base/plan"][-1]

    robot.ask("/robot1/move_base/clear_costmaps", EmptyRequest())
    if again:
        robot.send(8.0, 2.0)
    robot.drive(1.0)

    straight = robot.published["/robot1/move_base/plan"][-1]
    assert len(around.poses) > 2
    assert len(straight.poses) == 2


def test_a_scan_is_recent_until_the_next_is_due_and_a_pose_as_long(robot: Robot) -> None:
    robot.measure()
    robot.odd_transform = robot.transform_at(99.9)
    robot.now += 0.05

    assert robot.recent_until == {
        "/robot1/scan": pytest.approx(100.0 + 1.0 / MODEL.laser.rate + 0.05),
        "robot1/base_footprint": pytest.approx(99.9 + 0.15),
    }


def test_a_scan_that_cannot_be_used_is_as_late_as_none(robot: Robot) -> None:
    robot.measure()
    before = robot.recent_until["/robot1/scan"]
    robot.now += 0.1
    robot.measure(range_max=math.nan)

    assert robot.recent_until["/robot1/scan"] == before


def test_nothing_is_late_of_a_robot_that_has_never_sensed_anything(robot: Robot) -> None:
    robot.pose = None

    assert robot.recent_until == {}


def test_a_transform_that_is_fixed_is_never_late(robot: Robot) -> None:
    robot.odd_transform = robot.transform_at(0.0)

    assert robot.recent_until == {}


def test_a_robot_says_at_once_that_it_has_a_goal_no_more(robot: Robot) -> None:
    robot.send(3.0, 2.0)
    robot.drive(0.5)
    assert robot.announced[-1].goal == (3.0, 2.0)

    while robot.server.outcome is None:
        robot.drive(0.1)

    assert (robot.announced[-1].goal, len(robot.announced[-1].path)) == (None, 1)


def test_an_idle_robot_announces_itself_twice_a_second(robot: Robot) -> None:
    robot.drive(5.0)

    assert len(robot.announced) == pytest.approx(10, abs=2)


def with_a_shelf() -> GridMap:
    """Return the hall with a shelf across its middle, 2 m short of its upper wall."""
    blocked = hall().blocked.copy()
    blocked[:160, 95:105] = True
    return GridMap.of_blocked(blocked, 0.05)


def test_a_robot_under_way_plans_anew_on_a_new_map_and_reaches_its_goal(robot: Robot) -> None:
    robot.send(8.0, 2.0)
    robot.drive(1.0)
    before = robot.published["/robot1/move_base/plan"][-1].poses
    robot.change_map(with_a_shelf())
    robot.drive(1.0)
    after = robot.published["/robot1/move_base/plan"][-1].poses
    robot.drive(60.0)

    assert max(pose.pose.position.y for pose in before) < 2.5
    assert max(pose.pose.position.y for pose in after) > 8.0
    assert robot.server.outcome is not None
    assert robot.server.outcome[0] == "succeeded"


def test_a_goal_that_a_new_map_cuts_off_is_aborted_and_a_robot_without_one_stays(
    robot: Robot,
) -> None:
    wall = hall().blocked.copy()
    wall[:, 95:105] = True
    robot.change_map(with_a_shelf())
    assert robot.drive(1.0) == 0.0

    robot.send(8.0, 2.0)
    robot.drive(1.0)
    robot.change_map(GridMap.of_blocked(wall, 0.05))
    robot.drive(15.0)

    assert robot.server.outcome is not None
    assert robot.server.outcome[0] == "aborted"
    assert robot.velocity == STOP


def test_move_base_tells_which_map_it_uses(robot: Robot) -> None:
    robot.change_map(with_a_shelf())

    told = [(each.node, each.checksum) for each in robot.published["/robot1/map_in_use"]]
    assert told == [
        ("move_base", checksum_of(hall())),
        ("move_base", checksum_of(with_a_shelf())),
    ]
