# SPDX-License-Identifier: BSD-3-Clause
"""Starts a robot's `move_base`, once there is a map and the parameters are found to be good."""

from __future__ import annotations

import sys

import rospy

from hive_common.errors import HiveError
from hive_common.ros.conversions import grid_from_msg
from hive_common.ros.links import mend_links
from robot_navigation.planning.ompl_planner import OmplPlanner
from robot_navigation.ros.map_topic import wait_for_map
from robot_navigation.ros.move_base import MoveBase
from robot_navigation.ros.params import hive_and_robot, read_move_base_params


def main() -> None:
    """Run one robot's `move_base` until the node is shut down; see `MoveBase`."""
    rospy.init_node("move_base")
    mend_links()
    try:
        hive, name = hive_and_robot()
        params = read_move_base_params()
        grid = grid_from_msg(wait_for_map(f"{hive}map"))
        planner = OmplPlanner(grid, params.model.base.circumscribed_radius)
    except HiveError as error:
        rospy.logfatal(str(error))
        sys.exit(1)
    except rospy.ROSInterruptException:
        return
    MoveBase(name, hive, params, planner).run()
