# SPDX-License-Identifier: BSD-3-Clause
"""The simulated fleet has the nodes, topics, services and parameters that are recorded."""

from interface_nodes import check_system, rosrun


def test_the_simulated_fleet_is_the_one_that_is_recorded(launches):
    launches.start("fleet_manager", "fleet_manager.launch", rviz="false", processes="each")
    launches.run(*rosrun("task_entry"))
    launches.run(*rosrun("task_view"))
    launches.run("hive", "watch")
    check_system("fleet")
