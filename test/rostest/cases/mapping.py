# SPDX-License-Identifier: BSD-3-Clause
"""A robot explores a room alone; its map agrees with the room, and is saved and served."""

import os
import pty
import select
import subprocess
import time
from pathlib import Path

import pytest
import rospy
import tf2_ros
from geometry_msgs.msg import Twist
from nav_msgs.msg import MapMetaData, OccupancyGrid, Odometry
from nav_msgs.srv import GetMap
from rosgraph_msgs.msg import Clock
from std_msgs.msg import Bool

from hive_common.map_file import load_map
from hive_common.pose import compose
from hive_common.ros.conversions import map_from_msg, pose_from_msg, pose_from_transform
from hive_lab.bench.mapping import compare
from hive_lab.runner.limits import PATIENCE

ROOM = str(Path(__file__).resolve().parents[1] / "worlds" / "room.yaml")


@pytest.fixture(scope="module", autouse=True)
def node():
    rospy.init_node("mapping_cases")
    while not rospy.get_rostime():
        rospy.wait_for_message("/clock", Clock, timeout=PATIENCE)


@pytest.fixture(scope="module")
def explored():
    """The map when the explorer says that it has seen everything."""
    end = time.monotonic() + PATIENCE
    while not rospy.wait_for_message("/robot1/explored", Bool, timeout=PATIENCE).data:
        assert time.monotonic() < end, "the room was not explored in time"
        time.sleep(0.2)  # it is latched, so it can be asked again and again
    rospy.wait_for_service("/dynamic_map", PATIENCE)
    return map_from_msg(rospy.ServiceProxy("/dynamic_map", GetMap)().map)


@pytest.fixture(scope="module")
def characteristics():
    """What robot1 is."""
    return rospy.get_param("/robot1/characteristics")


@pytest.fixture(scope="module", autouse=True)
def lonely(characteristics, tmp_path_factory):
    """What a mapper of another hive says, whose robot is not there."""
    rospy.set_param("/other/robot2/characteristics", characteristics)
    log = tmp_path_factory.mktemp("lonely") / "mapper.log"
    with log.open("w") as file:
        mapper = subprocess.Popen(
            ["rosrun", "hive_navigation", "mapper", "__ns:=/other/robot2"],
            stdin=subprocess.DEVNULL,
            stdout=file,
            stderr=subprocess.STDOUT,
        )
    yield log
    mapper.terminate()
    mapper.wait(PATIENCE)


def run(*words):
    return subprocess.run(
        words,
        capture_output=True,
        text=True,
        timeout=PATIENCE,
        check=False,
        stdin=subprocess.DEVNULL,
    )


def test_the_map_agrees_with_the_room(explored):
    agreement = compare(explored, ROOM)

    assert agreement.share > 0.97
    assert agreement.known > 0.9
    assert agreement.wall_error <= 0.1


@pytest.mark.usefixtures("explored")
def test_whoever_comes_late_is_told_the_map_and_where_the_robot_is_on_it():
    grid = rospy.wait_for_message("/map", OccupancyGrid, timeout=PATIENCE)
    size = rospy.wait_for_message("/map_metadata", MapMetaData, timeout=PATIENCE)
    frames = tf2_ros.Buffer()
    listener = tf2_ros.TransformListener(frames)
    rospy.wait_for_message("/robot1/scan", rospy.AnyMsg, timeout=PATIENCE)
    frame = frames.lookup_transform("map", "robot1/odom", rospy.Time(0), rospy.Duration(PATIENCE))
    odometry = rospy.wait_for_message("/robot1/odom", Odometry, timeout=PATIENCE)
    truth = rospy.wait_for_message("/robot1/ground_truth", Odometry, timeout=PATIENCE)
    listener.unregister()
    here = compose(pose_from_transform(frame.transform), pose_from_msg(odometry.pose.pose))

    assert grid.header.frame_id == "map"
    assert (grid.info.width, grid.info.height) == (size.width, size.height)
    assert here[:2] == pytest.approx(pose_from_msg(truth.pose.pose)[:2], abs=0.1)


@pytest.mark.usefixtures("explored")
def test_a_map_that_is_saved_can_be_served(tmp_path):
    saved = run("rosrun", "hive_navigation", "map_saver", "-f", str(tmp_path / "room"))
    assert saved.returncode == 0, saved.stdout + saved.stderr
    before = load_map(str(tmp_path / "room.yaml"))
    server = subprocess.Popen(
        [
            "rosrun",
            "hive_navigation",
            "map_server",
            f"_map:={tmp_path / 'room.yaml'}",
            "map:=/served",
        ]
    )
    try:
        served = map_from_msg(rospy.wait_for_message("/served", OccupancyGrid, timeout=PATIENCE))
    finally:
        server.terminate()
        server.wait(PATIENCE)

    assert (served.cells == before.cells).all()
    assert served.origin == before.origin
    assert compare(served, ROOM).share > 0.97


def test_a_saver_without_a_map_says_so_in_a_line():
    saved = run("rosrun", "hive_navigation", "map_saver", "--timeout", "1", "map:=/nowhere")

    assert saved.returncode == 1
    assert "no map on /nowhere within 1 s; start a mapper" in saved.stdout + saved.stderr
    assert "Traceback" not in saved.stderr


def test_a_parameter_that_the_mapper_does_not_know_is_named():
    rospy.set_param("/robot1/other_mapper/resolution", 0.1)
    started = run("rosrun", "hive_navigation", "mapper", "__ns:=/robot1", "__name:=other_mapper")
    rospy.delete_param("/robot1/other_mapper")

    assert started.returncode == 1
    assert "parameter ~resolution is unknown; allowed: angularUpdate" in (
        started.stdout + started.stderr
    )


def test_a_key_that_is_held_drives_the_robot(characteristics):
    # A robot of its own: robot1 is still held by its explorer.
    rospy.set_param("/robot2/characteristics", characteristics)
    keyboard, terminal = pty.openpty()
    teleop = subprocess.Popen(
        ["rosrun", "hive_navigation", "teleop", "__ns:=/robot2"], stdin=terminal, stdout=terminal
    )
    os.close(terminal)
    speeds = []
    rospy.Subscriber("/robot2/cmd_vel", Twist, lambda command: speeds.append(command.linear.x))
    end = time.monotonic() + PATIENCE
    try:
        while max(speeds, default=0.0) == 0.0:
            assert time.monotonic() < end, "no command came"
            os.write(keyboard, b"i")
            if select.select([keyboard], [], [], 0.1)[0]:
                os.read(keyboard, 4096)
    finally:
        teleop.terminate()
        teleop.wait(PATIENCE)
        os.close(keyboard)

    assert max(speeds) == pytest.approx(0.5)


def test_a_mapper_without_scans_and_odometry_says_so_in_a_line_each(lonely):
    end = time.monotonic() + PATIENCE
    while lonely.read_text().count("nothing on") < 2:
        assert time.monotonic() < end, lonely.read_text()
        time.sleep(0.2)  # a file tells nobody that it has grown

    told = lonely.read_text()
    assert "nothing on /other/robot2/scan for 10 s: start the robot's laser" in told
    assert "nothing on /other/robot2/odom for 10 s: start the robot's base" in told
