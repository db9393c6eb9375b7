# SPDX-License-Identifier: BSD-3-Clause
"""Asks the simulator to put robots into its world, for every node that has some."""

from __future__ import annotations

from typing import TYPE_CHECKING

import rospy
from geometry_msgs.msg import Pose2D

from hive_common.ros.refusal import forget_refusal, refuse_to_start
from simenv.errors import SimenvError, SpawnError
from simenv.srv import Spawn

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable
    from typing import TypeVar

    from hive_common.pose import Pose

    T = TypeVar("T")

_SERVICE = "simenv/spawn"


def wait_for_simulator(timeout: float) -> None:
    """Wait until a simulator runs in this node's namespace, at most `timeout` [s, wall clock].

    Raises:
        SimenvError: None answered in time.
        rospy.ROSInterruptException: The node was shut down first.
    """
    try:
        rospy.wait_for_service(_SERVICE, timeout)
    except rospy.ROSInterruptException:
        raise
    except rospy.ROSException:
        raise SimenvError(
            f"no simulator answered on {rospy.resolve_name(_SERVICE)} within "
            f"{timeout:g} s; start one with: roslaunch simenv simulator.launch"
        ) from None


def spawn(name: str, model: str, pose: Pose) -> None:
    """Put a robot into the simulator's world, at a pose in the frame map, and log where it stands.

    Raises:
        SpawnError: The simulator refuses it, with the reason and what is allowed, or has ended.
    """
    try:
        answer = rospy.ServiceProxy(_SERVICE, Spawn)(name, model, Pose2D(*pose))
    except rospy.ServiceException as error:
        raise SpawnError(f"the simulator ended while {name} was being spawned: {error}") from None
    if not answer.success:
        raise SpawnError(answer.message)
    rospy.loginfo(answer.message)


def spawn_each(
    robots: Iterable[T], of: Callable[[T], tuple[str, str, Pose]], timeout: float
) -> list[T]:
    """Put robots into the simulator's world; return those that stand there.

    One that is refused is told as a node that did not start, and the others go on without it.

    Args:
        robots: Any descriptions of them.
        of: Returns the name, the model and the pose of one, frame map.
        timeout: How long to wait for the simulator [s, wall clock].

    Raises:
        SimenvError: There is no simulator, or it refuses every robot.
        rospy.ROSInterruptException: The node was shut down first.
    """
    wanted = list(robots)
    if not wanted:
        return []
    wait_for_simulator(timeout)
    standing = []
    for robot in wanted:
        name, model, pose = of(robot)
        node = rospy.resolve_name(name)
        forget_refusal(node)
        try:
            spawn(name, model, pose)
        except SpawnError as error:
            text = f"{error}; its part of the hive is not started, all others go on"
            refuse_to_start(text, node)
        else:
            standing.append(robot)
    if not standing:
        raise SpawnError("none of this node's robots can start; each reason is in the log above")
    return standing
