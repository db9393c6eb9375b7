# SPDX-License-Identifier: BSD-3-Clause
"""Puts one robot into the running simulator, then ends.

ROS Services called:
    simenv/spawn (simenv/Spawn)
ROS Parameters:
    ~name, ~model, ~x, ~y [m, frame map], ~yaw [rad] (0), ~timeout [s, wall clock] (60)
"""

from __future__ import annotations

import rospy

from hive_common.errors import HiveError
from hive_common.pose import Pose
from hive_common.ros.params import number, text
from hive_common.ros.refusal import forget_refusal, refuse_to_start
from hive_common.ros.signals import init_node
from simenv.ros.spawning import spawn, wait_for_simulator


def main() -> int:
    """Run the node; return its exit code."""
    init_node("spawn", anonymous=True)
    try:
        name, model = text("name"), text("model")
        x, y = (number(axis, least=-1000.0, most=1000.0) for axis in ("x", "y"))
        yaw = number("yaw", least=-1000.0, most=1000.0, default=0.0)
        timeout = number("timeout", least=0.1, most=3600.0, default=60.0)
    except HiveError as error:
        rospy.logfatal(str(error))
        return 1
    try:
        wait_for_simulator(timeout)
        spawn(name, model, Pose(x, y, yaw))
    except rospy.ROSInterruptException:
        return 1
    except HiveError as error:
        told = f"{error}. {name} takes no part: end its nodes before it is tried again"
        refuse_to_start(told, rospy.resolve_name(name))
        return 1
    forget_refusal(rospy.resolve_name(name))
    return 0
