# SPDX-License-Identifier: BSD-3-Clause
"""Drives a robot with the keys of the terminal that the node runs in.

ROS Publishers:
    cmd_vel (geometry_msgs/Twist): of the robot, 10 Hz.
ROS Parameters:
    characteristics: of the robot, see `roslaunch robot_description description.launch`.
"""

from __future__ import annotations

import os
import select
import sys
import termios
import time
import tty
from contextlib import contextmanager
from typing import TYPE_CHECKING

import rospy
from geometry_msgs.msg import Twist

from hive_common.errors import HiveError
from hive_common.pose import Velocity
from hive_common.ros.conversions import twist_from
from hive_common.ros.names import own_names
from hive_navigation.mapping.teleop import HELP, Teleop
from hive_navigation.ros.startup import read_model, run_node

if TYPE_CHECKING:
    from collections.abc import Iterator

PERIOD = 0.1  # between two commands [s, wall clock]

_CHUNK = 64


def main() -> int:
    """Run the node; return its exit code."""
    return run_node("teleop", _run)


def _run() -> None:
    names = own_names()
    base = read_model(names).base
    if not sys.stdin.isatty():
        raise HiveError("teleop reads the keyboard; start it in a terminal, without a pipe")
    commands = rospy.Publisher("cmd_vel", Twist, queue_size=1, tcp_nodelay=True)
    teleop = Teleop(base.max_speed, base.max_yaw_rate, holonomic=base.holonomic)
    sys.stdout.write(f"{names.robot}: {HELP}")
    _show_speeds(teleop)
    with _single_keys():
        _drive(teleop, commands)


def _drive(teleop: Teleop, commands: rospy.Publisher) -> None:
    """Turn keys into commands until the node is shut down."""
    rospy.on_shutdown(lambda: commands.publish(Twist()))
    while not rospy.is_shutdown():
        ready, _, _ = select.select([sys.stdin], [], [], PERIOD)
        now = time.monotonic()
        keys = os.read(sys.stdin.fileno(), _CHUNK).decode(errors="replace") if ready else ""
        if ready and not keys:
            rospy.logfatal("the terminal was closed")
            return
        changed = [teleop.press(key, now) for key in keys]
        if any(changed):
            _show_speeds(teleop)
        commands.publish(twist_from(Velocity(*teleop.command(now))))


def _show_speeds(teleop: Teleop) -> None:
    sys.stdout.write(f"\rspeed {teleop.speed:.2f} m/s, turning {teleop.turn:.2f} rad/s    ")
    sys.stdout.flush()


@contextmanager
def _single_keys() -> Iterator[None]:
    """Have the terminal pass on each key at once and echo none; Ctrl-C still works."""
    before = termios.tcgetattr(sys.stdin)
    try:
        tty.setcbreak(sys.stdin)
        yield
    finally:
        termios.tcsetattr(sys.stdin, termios.TCSADRAIN, before)
