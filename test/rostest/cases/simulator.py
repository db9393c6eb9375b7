# SPDX-License-Identifier: BSD-3-Clause
"""The simulator's topics, services and action are those of real robots; mistakes do not end it."""

import contextlib
import itertools
import math
import queue
import subprocess
import sys
import threading
import time

import actionlib
import pytest
import rospy
from actionlib_msgs.msg import GoalStatus
from blackboard.msg import PickAction, PickGoal, PickResult
from geometry_msgs.msg import Pose2D, Twist
from nav_msgs.msg import MapMetaData, OccupancyGrid, Odometry
from nav_msgs.srv import GetMap, LoadMap, LoadMapResponse
from rosgraph_msgs.msg import Clock
from sensor_msgs.msg import LaserScan
from simenv.srv import Remove, Spawn
from std_msgs.msg import Bool, Float64, UInt32
from std_srvs.srv import Empty, SetBool, Trigger
from tf2_msgs.msg import TFMessage
from visualization_msgs.msg import Marker, MarkerArray

from hive_common.ros.conversions import pose_from_msg
from hive_lab.runner.limits import PATIENCE

COMMAND_WAIT = 60.0  # `command_wait` of the launch file [s, wall clock]
STANDS = 1.0  # a clock that is silent for as long stands, or the machine does [s, wall clock]
FAST, SLOW = 5.0, 0.2  # real-time factors: that of the launch file, and one to be in time

DRIVER = """
import sys
import rospy
from geometry_msgs.msg import Twist

rospy.init_node("driver")
topic = rospy.Publisher(sys.argv[1], Twist, queue_size=1, headers={"control_period": "0.1"})
while not topic.get_num_connections():
    rospy.rostime.wallsleep(0.01)
turn = Twist()
turn.angular.z = 0.05
topic.publish(turn)
rospy.spin()
"""
"""A control loop that commands once, and then no more."""


@pytest.fixture(scope="module", autouse=True)
def node():
    rospy.init_node("simulator_cases")
    while not rospy.get_rostime():
        rospy.wait_for_message("/clock", Clock, timeout=PATIENCE)


class Topic:
    """Hands out the messages of a topic as they come in."""

    def __init__(self, name, kind):
        self._messages = queue.Queue()
        self._subscriber = rospy.Subscriber(name, kind, self._messages.put)

    def until(self, good, patience=PATIENCE):
        """Return the first message that is `good`; fail after silence [s]."""
        while True:
            message = self._messages.get(timeout=patience)
            if good(message):
                return message

    def last(self, message):
        """Return the last message, once it has been silent for a while; `message` came before."""
        end = time.monotonic() + PATIENCE
        with contextlib.suppress(queue.Empty):
            while time.monotonic() < end:
                message = self._messages.get(timeout=STANDS)
            pytest.fail(f"not silent within {PATIENCE:g} s")
        return message


def spawn(name, model, x, y, yaw=0.0):
    rospy.wait_for_service("simenv/spawn", PATIENCE)
    return rospy.ServiceProxy("simenv/spawn", Spawn)(name, model, Pose2D(x, y, yaw))


@pytest.fixture(scope="module")
def robot1():
    """The robot of the launch file, which may still be on its way into the simulator."""
    rospy.wait_for_message("robot1/odom", Odometry, timeout=PATIENCE)
    return "robot1"


@contextlib.contextmanager
def slow_motion():
    """Let simulated time pass slowly, so that a test that is held up is not late."""
    factor = rospy.Publisher("simenv/rtf", Float64, queue_size=1)
    while not factor.get_num_connections():
        rospy.sleep(0.01)
    factor.publish(SLOW)
    try:
        yield
    finally:
        factor.publish(FAST)


class Arm:
    """Gives orders; actionlib's simple client misses an answer that comes with the order."""

    def __init__(self, name):
        self._client = actionlib.ActionClient(name, PickAction)
        assert self._client.wait_for_server(rospy.Duration(100))

    def order(self, hear=lambda _: None, **fields):
        """Give an order; return its goal, and an event that is set when it has ended."""
        ended = threading.Event()

        def changed(goal):
            if goal.get_comm_state() == actionlib.CommState.DONE:
                ended.set()

        goal = self._client.send_goal(PickGoal(**fields), changed, lambda _, said: hear(said))
        return goal, ended


@pytest.fixture(scope="module")
def fetch():
    assert spawn("robot3", "fetch", 12.0, 3.0).success
    return Arm("robot3/pick")


def pick(arm, **fields):
    goal, ended = arm.order(**fields)
    assert ended.wait(PATIENCE)
    return goal.get_goal_status(), goal.get_result()


def test_odometry_starts_at_zero_in_the_robots_own_frames(robot1):
    odometry = rospy.wait_for_message(f"{robot1}/odom", Odometry, timeout=PATIENCE)

    assert (odometry.header.frame_id, odometry.child_frame_id) == (
        "robot1/odom",
        "robot1/base_footprint",
    )
    assert odometry.pose.pose.position.x == 0.0
    assert odometry.pose.pose.orientation.w == 1.0


def test_a_scan_is_complete_and_in_the_lasers_frame(robot1):
    scan = rospy.wait_for_message(f"{robot1}/scan", LaserScan, timeout=PATIENCE)

    assert scan.header.frame_id == "robot1/laser"
    assert len(scan.ranges) == 720
    assert (scan.range_min, scan.range_max) == pytest.approx((0.1, 3.0))
    assert scan.angle_max == pytest.approx(scan.angle_min + 719 * scan.angle_increment)
    assert min(scan.ranges) == pytest.approx(1.8, abs=0.01)


@pytest.mark.parametrize(
    ("headers", "waits"),
    [({"control_period": "0.1"}, True), (None, False)],
    ids=["on simulated time", "on another clock"],
)
def test_simulated_time_waits_for_a_control_loop_that_has_fallen_silent(robot1, headers, waits):
    clock = Topic("/clock", Clock)
    driver = rospy.Publisher(f"{robot1}/cmd_vel", Twist, queue_size=1, headers=headers)
    while not driver.get_num_connections():
        clock.until(lambda _: True)
    turn = Twist()
    turn.angular.z = 0.01
    driver.publish(turn)
    begins = clock.until(lambda _: True)
    if waits:
        stands = clock.last(begins).clock.to_sec()
        driver.publish(turn)
        went_on = clock.until(lambda message: message.clock.to_sec() > stands)
        stands_again = clock.last(went_on).clock.to_sec()

        assert stands_again - stands < 3.0
    else:
        # With a clock that stands, nothing would come for as long as simulated time waits.
        later = begins.clock.to_sec() + 3.0
        clock.until(lambda message: message.clock.to_sec() > later, 0.8 * COMMAND_WAIT)
    driver.unregister()
    clock.until(lambda _: True)


def test_simulated_time_does_not_wait_for_a_control_loop_whose_process_was_killed(robot1):
    clock, odometry = Topic("/clock", Clock), Topic(f"{robot1}/odom", Odometry)
    with subprocess.Popen([sys.executable, "-c", DRIVER, f"{robot1}/cmd_vel"]) as driver:
        odometry.until(lambda message: message.twist.twist.angular.z > 0.0)
        stands = clock.last(clock.until(lambda _: True)).clock.to_sec()
        driver.kill()

    later = stands + 3.0
    clock.until(lambda message: message.clock.to_sec() > later, 0.8 * COMMAND_WAIT)


def test_a_scan_comes_every_tenth_of_a_second(robot1):
    scans = Topic(f"{robot1}/scan", LaserScan)
    stamps = [scans.until(lambda _: True).header.stamp.to_nsec() for _ in range(30)]
    gaps = [late - early for early, late in itertools.pairwise(stamps)]

    assert {gap % 100_000_000 for gap in gaps} == {0}  # a listener that is held up misses some
    assert min(gaps) == 100_000_000


def test_no_stamp_is_ahead_of_the_clock(robot1):
    clock = Topic("/clock", Clock)
    for _ in range(5):
        stamp = rospy.wait_for_message(f"{robot1}/odom", Odometry, timeout=PATIENCE).header.stamp

        assert clock.until(lambda message, stamp=stamp: message.clock >= stamp)
        assert stamp <= rospy.get_rostime()


def test_a_robot_drives_while_it_is_told_to_and_stops_by_itself(robot1):
    truth = Topic(f"{robot1}/ground_truth", Odometry)
    start = truth.until(lambda _: True)
    commands = rospy.Publisher(f"{robot1}/cmd_vel", Twist, queue_size=1)
    forward = Twist()
    forward.linear.x = 0.5

    def driving(message):
        commands.publish(forward)
        return message.pose.pose.position.x > start.pose.pose.position.x + 0.5

    transforms = Topic("/tf", TFMessage)
    with slow_motion():
        truth.until(driving)
        end = truth.until(lambda message: message.twist.twist.linear.x == 0.0)

    assert start.header.frame_id == "map"
    assert start.pose.pose.position.x == pytest.approx(2.6)
    way = end.pose.pose.position.x - start.pose.pose.position.x
    assert 0.5 < way < 1.3
    transforms.until(
        lambda message: any(
            abs(transform.transform.translation.x - way) < 1e-6
            and transform.header.frame_id == "robot1/odom"
            and transform.child_frame_id == "robot1/base_footprint"
            for transform in message.transforms
        )
    )


@pytest.mark.usefixtures("robot1")
def test_a_collision_is_told_to_everyone():
    before = rospy.wait_for_message("simenv/collisions", UInt32, timeout=PATIENCE).data
    assert spawn("bumper", "youbot", 1.0, 7.0, math.pi).success
    commands = rospy.Publisher("bumper/cmd_vel", Twist, queue_size=1)
    truth = Topic("bumper/ground_truth", Odometry)
    count = Topic("simenv/collisions", UInt32)
    forward = Twist()
    forward.linear.x = 0.5

    def stuck(message):
        commands.publish(forward)
        return message.pose.pose.position.x < 0.5

    truth.until(stuck)

    assert count.until(lambda message: message.data > before).data == before + 1
    assert rospy.ServiceProxy("simenv/remove", Remove)("bumper").success


def test_a_load_is_picked_and_put_down(fetch):
    picked = pick(fetch, act=PickGoal.PICK, task_id="T1", payload=2.0)
    put_down = pick(fetch, act=PickGoal.PLACE, task_id="T1", payload=2.0)

    assert (picked[0], picked[1].outcome) == (GoalStatus.SUCCEEDED, PickResult.SUCCESS)
    assert (put_down[0], put_down[1].outcome) == (GoalStatus.SUCCEEDED, PickResult.SUCCESS)


def test_a_load_of_another_task_with_the_same_id_stays_on_board(fetch):
    load = {"task_id": "T4", "payload": 2.0, "posted": rospy.Time(7)}
    pick(fetch, act=PickGoal.PICK, **load)

    later = {**load, "posted": rospy.Time(9)}
    picked = pick(fetch, act=PickGoal.PICK, look=True, **later)
    placed = pick(fetch, act=PickGoal.PLACE, **later)
    put_down = pick(fetch, act=PickGoal.PLACE, **load)

    assert picked[1].outcome == PickResult.HOLDS_ANOTHER
    assert placed[1].outcome == PickResult.NOTHING_THERE
    assert put_down[1].outcome == PickResult.SUCCESS


def test_an_action_that_is_asked_for_again_is_done_once(fetch):
    order = {"task_id": "T5", "payload": 2.0}
    with slow_motion():
        first, ended = fetch.order(act=PickGoal.PICK, action_id="hive1/T5/1/1", **order)
        again, again_ended = fetch.order(act=PickGoal.PICK, action_id="hive1/T5/1/1", **order)
        assert ended.wait(PATIENCE)
    assert again_ended.wait(PATIENCE)
    put_down = [
        pick(fetch, act=PickGoal.PLACE, action_id="hive1/T5/1/3", **order) for _ in range(2)
    ]

    assert first.get_goal_status() == GoalStatus.PREEMPTED
    assert again.get_goal_status() == GoalStatus.SUCCEEDED
    assert [state for state, _ in put_down] == [GoalStatus.SUCCEEDED] * 2


def test_an_arm_that_looks_first_says_what_it_holds(fetch):
    pick(fetch, act=PickGoal.PICK, task_id="T6", payload=2.0)

    state, result = pick(fetch, act=PickGoal.PICK, task_id="T7", payload=1.0, look=True)

    assert (state, result.outcome) == (GoalStatus.ABORTED, PickResult.HOLDS_ANOTHER)


def test_a_load_that_is_too_heavy_aborts_with_the_reason(fetch):
    state, result = pick(fetch, act=PickGoal.PICK, task_id="T2", payload=50.0)

    assert (state, result.outcome) == (GoalStatus.ABORTED, PickResult.TOO_HEAVY)
    assert "50 kg is over the arm's 6 kg" in result.message


@pytest.mark.parametrize(("act", "payload"), [(7, 1.0), (0, math.nan), (0, -1.0)])
def test_an_order_that_makes_no_sense_is_rejected(fetch, act, payload):
    goal, ended = fetch.order(act=act, task_id="T3", payload=payload)

    assert ended.wait(PATIENCE)
    assert goal.get_goal_status() == GoalStatus.REJECTED
    assert goal.get_goal_status_text().startswith("robot3: ")


def test_a_cancelled_pick_is_preempted(fetch):
    begun = threading.Event()
    with slow_motion():
        goal, ended = fetch.order(lambda _: begun.set(), act=0, task_id="T4", payload=1.0)
        heard = begun.wait(PATIENCE)
        assert heard, (goal.get_comm_state(), goal.get_goal_status(), goal.get_goal_status_text())
        goal.cancel()
        assert ended.wait(PATIENCE)

    assert goal.get_goal_status() == GoalStatus.PREEMPTED


def test_a_robot_without_arm_has_no_pick_action(robot1):
    assert f"/{robot1}/pick/status" not in dict(rospy.get_published_topics())


@pytest.mark.usefixtures("robot1")
@pytest.mark.parametrize(
    ("name", "model", "x", "words"),
    [
        ("robot1", "mir100", 14.0, "the name is taken"),
        ("robot9", "moon_rover", 14.0, "robot model 'moon_rover': not known"),
        ("robot9", "mir100", 9.9, "'middle wall south' is there"),
        ("robot9", "mir100", -5.0, "outside the world 'lab'"),
        ("9robot", "mir100", 14.0, "letters, digits and _"),
    ],
)
def test_a_robot_that_cannot_be_put_down_is_refused_with_the_reason(name, model, x, words):
    answer = spawn(name, model, x, 2.2)

    assert not answer.success
    assert words in answer.message


def test_a_robot_can_be_removed_and_put_down_again():
    remove = rospy.ServiceProxy("simenv/remove", Remove)
    for _ in range(2):
        assert spawn("guest", "youbot", 14.0, 3.0).success
        rospy.wait_for_message("guest/odom", Odometry, timeout=PATIENCE)
        assert remove("guest").success

    assert not remove("guest").success
    assert not [name for name, _ in rospy.get_published_topics() if "guest/" in name]


def test_the_map_is_there_for_latecomers_and_agrees_with_the_service():
    grid = rospy.wait_for_message("map", OccupancyGrid, timeout=PATIENCE)
    figures = rospy.wait_for_message("map_metadata", MapMetaData, timeout=PATIENCE)
    served = rospy.ServiceProxy("static_map", GetMap)().map

    assert grid.header.frame_id == "map"
    assert (figures.width, figures.height) == (400, 240)
    assert figures.resolution == pytest.approx(0.05)
    assert grid.info == figures
    assert grid.data == served.data
    assert grid.data[0] == 100
    assert grid.data[20 * 400 + 20] == 0


def test_a_map_server_takes_a_file_as_argument_and_another_one_while_it_runs(tmp_path):
    (tmp_path / "hall.pgm").write_bytes(b"P5\n2 1\n255\n" + bytes([0, 254]))
    (tmp_path / "hall.yaml").write_text(
        "image: hall.pgm\nresolution: 0.5\norigin: [1, 2, 0]\nnegate: 0\n"
        "occupied_thresh: 0.65\nfree_thresh: 0.196\ncolour: blue\n"
    )
    names = [
        "__name:=hall_server",
        "map:=hall",
        "change_map:=change_hall",
        "static_map:=static_hall",
    ]
    server = subprocess.Popen(
        ["rosrun", "hive_navigation", "map_server", str(tmp_path / "hall.yaml"), *names],
        stderr=subprocess.PIPE,
        text=True,
    )
    try:
        maps = Topic("hall", OccupancyGrid)
        first = maps.until(lambda _: True)
        rospy.wait_for_service("change_hall", PATIENCE)
        change = rospy.ServiceProxy("change_hall", LoadMap)
        missing, changed = change("/nowhere/map.yaml"), change("lab")
        second = maps.until(lambda _: True)
    finally:
        server.terminate()
        said = server.communicate(timeout=PATIENCE)[1]

    assert list(first.data) == [100, 0]
    assert first.info.origin.position.x == 1.0
    assert missing.result == LoadMapResponse.RESULT_INVALID_MAP_METADATA
    assert changed.result == LoadMapResponse.RESULT_SUCCESS
    assert second.info.width == 400
    assert second.data == changed.map.data
    assert "colour: unknown, and ignored" in said


@contextlib.contextmanager
def turned_server(path):
    """Run a map server of its own for a file, on the topics and services turned/..."""
    topics = ("map", "map_metadata", "static_map", "change_map")
    names = [f"{topic}:=turned/{topic}" for topic in topics]
    server = subprocess.Popen(
        ["rosrun", "hive_navigation", "map_server", path, "__name:=turned_server", *names]
    )
    try:
        rospy.wait_for_service("turned/change_map", PATIENCE)
        yield
    finally:
        server.terminate()
        server.wait(timeout=PATIENCE)


def write_map(path, rows, resolution, origin, negate):
    """Write a map whose cells are 100 where there is a # and else 0; return its YAML file."""
    dark, bright = (254, 0) if negate else (0, 254)
    pixels = bytes(dark if cell == "#" else bright for row in rows for cell in row)
    header = f"P5\n{len(rows[0])} {len(rows)}\n255\n".encode()
    path.with_suffix(".pgm").write_bytes(header + pixels)
    path.write_text(
        f"image: {path.stem}.pgm\nresolution: {resolution}\norigin: {origin}\n"
        f"negate: {negate}\noccupied_thresh: 0.65\nfree_thresh: 0.196\n"
    )
    return str(path)


def test_a_map_with_a_yaw_is_served_with_its_cells_as_they_are_and_so_is_the_next(tmp_path):
    first = write_map(tmp_path / "first.yaml", ["#..", "##."], 0.1, [2.0, 3.0, 1.0], negate=0)
    rows = ["####", "#..#", "#.##"]
    second = write_map(tmp_path / "second.yaml", rows, 0.2, [-2.0, -3.0, -1.0], negate=1)
    with turned_server(first):
        maps = Topic("turned/map", OccupancyGrid)
        figures = Topic("turned/map_metadata", MapMetaData)
        serve = rospy.ServiceProxy("turned/static_map", GetMap)
        change = rospy.ServiceProxy("turned/change_map", LoadMap)
        told = []
        for path in ("", second, first):
            if path:
                assert change(path).result == LoadMapResponse.RESULT_SUCCESS
            told.append((maps.until(lambda _: True), serve().map, figures.until(lambda _: True)))

    for heard, asked, described in told:
        assert heard.info == asked.info == described
        assert heard.data == asked.data
        assert heard.header.frame_id == asked.header.frame_id == "map"
    before, after, again = (heard for heard, *_ in told)
    assert list(before.data) == list(again.data) == [100, 100, 0, 100, 0, 0]
    assert list(after.data) == [100, 0, 100, 100, 100, 0, 0, 100, 100, 100, 100, 100]
    assert place(before) == place(again) == pytest.approx((3, 2, 0.1, 2.0, 3.0, 1.0))
    assert place(after) == pytest.approx((4, 3, 0.2, -2.0, -3.0, -1.0))


def place(grid):
    """Return a map's width and height [cells], resolution [m], and origin [m, m, rad]."""
    info = grid.info
    return (info.width, info.height, info.resolution, *pose_from_msg(info.origin))


@pytest.mark.usefixtures("robot1")
@pytest.mark.parametrize(
    ("package", "node", "arguments", "words"),
    [
        ("simenv", "simulator", ["_world:=moon"], "world 'moon': not known"),
        (
            "simenv",
            "simulator",
            ["_rtf:=0"],
            "parameter ~rtf: 0; allowed: a number from 0.01 to 100",
        ),
        (
            "hive_navigation",
            "map_server",
            ["_map:=/nowhere/map.yaml"],
            "/nowhere/map.yaml: cannot be read",
        ),
        ("simenv", "spawn", ["_name:=robot9"], "parameter ~model is missing"),
        (
            "simenv",
            "spawn",
            ["_name:=robot1", "_model:=mir100", "_x:=5", "_y:=4"],
            "the name is taken",
        ),
    ],
)
def test_a_node_that_cannot_start_says_why_in_one_line_and_fails(package, node, arguments, words):
    name = f"bad_{abs(hash((node, *arguments)))}"
    done = subprocess.run(
        ["rosrun", package, node, *arguments, f"__name:={name}"],
        capture_output=True,
        text=True,
        timeout=PATIENCE,
        check=False,
    )

    assert done.returncode == 1
    assert words in done.stderr
    assert "Traceback" not in done.stderr


def test_time_is_stopped_stepped_and_let_go_on():
    def call(name, kind, *values):
        rospy.wait_for_service(f"simenv/{name}", PATIENCE)
        return rospy.ServiceProxy(f"simenv/{name}", kind)(*values)

    assert not call("step", Trigger).success
    assert call("pause", SetBool, True).success
    first = float(call("step", Trigger).message.split()[2])
    second = float(call("step", Trigger).message.split()[2])
    assert second - first == pytest.approx(0.025)
    assert call("pause", SetBool, False).success


def test_reset_puts_a_robot_back(robot1):
    rospy.wait_for_service("simenv/reset", PATIENCE)
    rospy.ServiceProxy("simenv/reset", Empty)()

    def is_back(odometry):
        where = odometry.pose.pose.position
        return (where.x, where.y) == pytest.approx((2.6, 2.0), abs=0.01)

    assert Topic(f"{robot1}/ground_truth", Odometry).until(is_back)


def test_the_bumper_says_that_nothing_is_touched(robot1):
    assert rospy.wait_for_message(f"{robot1}/bumper", Bool, timeout=PATIENCE).data is False


def test_the_world_is_shown_in_three_dimensions():
    markers = rospy.wait_for_message("simenv/world_markers", MarkerArray, timeout=PATIENCE).markers

    solid = [marker for marker in markers if marker.type == Marker.TRIANGLE_LIST]
    assert len(solid) == 22
    assert max(point.z for point in solid[0].points) == pytest.approx(1.5)
