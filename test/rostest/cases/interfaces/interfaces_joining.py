# SPDX-License-Identifier: BSD-3-Clause
"""A robot that finds itself by laser, one that joins, and a second fleet are as recorded."""

from pathlib import Path

from interface_nodes import check_system, wait_for_parameter

HERE = Path(__file__).resolve().parents[2]


def test_robots_that_join_and_a_second_fleet_are_those_that_are_recorded(launches):
    fleet = HERE / "fleets" / "plain.yaml"
    launches.start("fleet_manager", "fleet_manager.launch", fleet=fleet, rviz="false", gui="false")
    wait_for_parameter("/fleet/distance")
    launches.start("fleet_manager", "robot.launch", name="robot2", model="ld60", x=2.6, y=4.0)
    launches.run("roslaunch", str(HERE / "launch" / "second_fleet.launch"))
    check_system("joining")
