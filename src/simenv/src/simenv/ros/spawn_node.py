# SPDX-License-Identifier: BSD-3-Clause
"""Puts one robot into the running simulator, then ends.

ROS Services called:
    simenv/spawn (simenv/Spawn)
ROS Parameters:
    ~name, ~model, ~x, ~y [m, frame map], ~yaw [rad] (0), ~timeout [s, wall clock] (60)
"""

from __future__ import annotations

import rospy
from geometry_msgs.msg import Pose2D

from hive_common.errors import HiveError
from hive_common.ros.params import number, text
from simenv.srv import Spawn

_SERVICE = "simenv/spawn"


def main() -> int:
    """Run the node; return its exit code."""
    rospy.init_node("spawn", anonymous=True)
    try:
        name, model = text("name"), text("model")
        x, y = (number(axis, least=-1000.0, most=1000.0) for axis in ("x", "y"))
        yaw = number("yaw", least=-1000.0, most=1000.0, default=0.0)
        timeout = number("timeout", least=0.1, most=3600.0, default=60.0)
    except HiveError as error:
        rospy.logfatal(str(error))
        return 1
    try:
        rospy.wait_for_service(_SERVICE, timeout)
        answer = rospy.ServiceProxy(_SERVICE, Spawn)(name, model, Pose2D(x, y, yaw))
    except rospy.ROSInterruptException:
        return 1
    except rospy.ROSException:
        rospy.logfatal(
            f"no simulator answered on {rospy.resolve_name(_SERVICE)} within "
            f"{timeout:g} s; start one with: roslaunch simenv simulator.launch"
        )
        return 1
    except rospy.ServiceException as error:
        rospy.logfatal(f"the simulator ended while {name} was being spawned: {error}")
        return 1
    if not answer.success:
        rospy.logfatal(answer.message)
        return 1
    rospy.loginfo(answer.message)
    return 0
