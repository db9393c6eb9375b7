# SPDX-License-Identifier: BSD-3-Clause
"""A fleet with a traffic planner has the nodes, topics and parameters that are recorded."""

from pathlib import Path

from interface_nodes import check_system

HERE = Path(__file__).resolve().parents[2]


def test_a_fleet_with_a_traffic_planner_is_the_one_that_is_recorded(launches):
    fleet = HERE / "fleets" / "plain.yaml"
    arguments = {"fleet": fleet, "traffic": "planned", "rviz": "false", "gui": "false"}
    launches.start("fleet_manager", "fleet_manager.launch", **arguments)
    check_system("planned")
