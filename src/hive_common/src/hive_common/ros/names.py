# SPDX-License-Identifier: BSD-3-Clause
"""The names of one robot's topics, services and parameters, wherever its parts run.

A process that hosts many robots cannot use its own namespace for them, so the parts of a robot are
given its names (docs/decisions/092).
"""

from __future__ import annotations

from typing import NamedTuple

import rosgraph.names
import rospy

from hive_common.errors import ParameterError

OUR_PLAN = "move_base/plan"
"""Where our `move_base` publishes its planned path, in the robot's namespace."""

_MOST_LETTERS = 64


class RobotNames(NamedTuple):
    """A robot and its hive."""

    hive: str  # namespace of the hive, ending in a slash
    robot: str  # the robot's name below it

    def of(self, name: str) -> str:
        """Return the full name of a topic, service, node or parameter of the robot."""
        return f"{self.hive}{self.robot}/{name}"

    @property
    def node(self) -> str:
        """The node of the robot's part of the hive, which has its parameters wherever it runs."""
        return self.of("robot")


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


def plan_topic(robot: RobotNames) -> str:
    """Return the full name of the topic of a robot's planned path (nav_msgs/Path).

    ROS Parameters: `plan_topic` of the robot, a name in its namespace, or with a slash in front
        wherever it is; where it is not set, or no topic can be called so, that of our `move_base`.
    """
    name = robot.of("plan_topic")
    given = str(rospy.get_param(name, OUR_PLAN))
    if not given or not rosgraph.names.is_legal_name(given) or given.startswith("~"):
        rospy.logwarn(
            f"{name}: {given[:_MOST_LETTERS]!r}; allowed: a topic, such as "
            f"move_base/NavfnROS/plan; {OUR_PLAN} is taken"
        )
        given = OUR_PLAN
    return given if given.startswith("/") else robot.of(given)
