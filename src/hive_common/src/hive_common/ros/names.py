# SPDX-License-Identifier: BSD-3-Clause
"""The names of one robot's topics, services and parameters, wherever its parts run.

A process that hosts many robots cannot use its own namespace for them, so the parts of a robot are
given its names (docs/decisions/092).
"""

from __future__ import annotations

from typing import NamedTuple

import rospy

from hive_common.errors import ParameterError


class RobotNames(NamedTuple):
    """A robot and its hive."""

    hive: str  # namespace of the hive, ending in a slash
    robot: str  # the robot's name below it

    def of(self, name: str) -> str:
        """Return the full name of a topic, service, node or parameter of the robot."""
        return f"{self.hive}{self.robot}/{name}"


def own_names() -> RobotNames:
    """Return the names of the robot in whose namespace this node runs.

    Raises:
        ParameterError: The node is not in a robot's namespace.
    """
    namespace = rospy.get_namespace()
    robot = namespace.strip("/").rpartition("/")[2]
    if not robot:
        raise ParameterError(
            f"{rospy.get_name()} has to run in its robot's namespace, for example robot1; "
            "start it with a launch file of its package, such as robot.launch name:=robot1"
        )
    return RobotNames(namespace[: -len(robot) - 1], robot)
