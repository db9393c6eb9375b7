# SPDX-License-Identifier: BSD-3-Clause
"""Puts one robot into the running simulator, and ends.

ROS Services called:
    simenv/spawn (simenv/Spawn)
ROS Parameters:
    ~name, ~model, ~x, ~y [m, frame map], ~yaw [rad] (0), ~timeout [s, wall clock] (60)
"""

from __future__ import annotations

import rospy
from geometry_msgs.msg import Pose2D

from simenv.errors import SimenvError
from simenv.ros.params import spawn_params
from simenv.srv import Spawn

_SERVICE = "simenv/spawn"


def main() -> int:
    """Run the node; return its exit code."""
    rospy.init_node("spawn", anonymous=True)
    try:
        wanted = spawn_params()
    except SimenvError as error:
        rospy.logfatal(str(error))
        return 1
    try:
        rospy.wait_for_service(_SERVICE, wanted.timeout)
        answer = rospy.ServiceProxy(_SERVICE, Spawn)(
            wanted.name, wanted.model, Pose2D(*wanted.pose)
        )
    except rospy.ROSInterruptException:
        return 1
    except rospy.ROSException:
        rospy.logfatal(
            f"no simulator answered on {rospy.resolve_name(_SERVICE)} within "
            f"{wanted.timeout:g} s; start one with: roslaunch simenv simulator.launch"
        )
        return 1
    except rospy.ServiceException as error:
        rospy.logfatal(f"the simulator ended while {wanted.name} was being spawned: {error}")
        return 1
    if not answer.success:
        rospy.logfatal(answer.message)
        return 1
    rospy.loginfo(answer.message)
    return 0
