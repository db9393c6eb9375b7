# SPDX-License-Identifier: BSD-3-Clause
"""What makes, drives for and saves a map has the topics and parameters that are recorded."""

import os
import pty
import subprocess

import pytest
from interface_nodes import MASTER, check_system, rosrun, wait_for_parameter
from launching import TIME_TO_STOP


@pytest.fixture
def keyboard():
    """Return the end of a terminal that a program takes for a keyboard; nobody types."""
    ours, terminal = pty.openpty()
    yield terminal
    os.close(ours)
    os.close(terminal)


def test_a_robot_that_maps_is_the_one_that_is_recorded(launches, keyboard, tmp_path):
    launches.start("simenv", "mapping.launch", explore="true")
    wait_for_parameter("/robot1/characteristics")
    # A robot of its own: robot1 is driven by the explorer.
    MASTER.setParam("/robot2/characteristics", MASTER.getParam("/robot1/characteristics"))
    saver = rosrun("map_saver", "-f", str(tmp_path / "chart"), "map:=/chart", "--timeout", "600")
    launches.run(*saver)
    teleop = subprocess.Popen(rosrun("teleop", "__ns:=/robot2"), stdin=keyboard)
    try:
        check_system("mapping")
    finally:
        teleop.terminate()
        teleop.wait(TIME_TO_STOP)
