# SPDX-License-Identifier: BSD-3-Clause
"""Starts a robot's `move_base`, once there is a map and the parameters are found to be good."""

from __future__ import annotations

import sys
from typing import TYPE_CHECKING

import rospy
from nav_msgs.msg import OccupancyGrid
from rospy.numpy_msg import numpy_msg

from robot_description.errors import RobotDescriptionError
from robot_description.ompl_planner import OmplPlanner
from robot_description.ros.conversions import grid_from_msg
from robot_description.ros.links import mend_links
from robot_description.ros.move_base import MoveBase
from robot_description.ros.params import hive_and_robot, read_move_base_params

if TYPE_CHECKING:
    from robot_description.grid_map import GridMap

_PATIENCE = 5.0
"""Wall time after which it is said again what is missing [s]."""


def main() -> None:
    """Run one robot's `move_base` until the node is shut down; see `MoveBase`."""
    rospy.init_node("move_base")
    mend_links()
    try:
        hive, name = hive_and_robot()
        params = read_move_base_params()
        planner = OmplPlanner(_wait_for_map(f"{hive}map"), params.model.base.circumscribed_radius)
    except RobotDescriptionError as error:
        rospy.logfatal(str(error))
        sys.exit(1)
    except rospy.ROSInterruptException:
        return
    MoveBase(name, hive, params, planner).run()


def _wait_for_map(topic: str) -> GridMap:
    """Return the map; say what is missing while there is none."""
    while True:
        try:
            msg = rospy.wait_for_message(topic, numpy_msg(OccupancyGrid), timeout=_PATIENCE)
            return grid_from_msg(msg)
        except rospy.ROSInterruptException:
            raise
        except rospy.ROSException:
            rospy.logwarn(f"no map on {topic} yet; start a map server")
