# SPDX-License-Identifier: BSD-3-Clause
"""What robots have learned, on the parameter server: for people, and for robots that join."""

from __future__ import annotations

import threading
from http.client import HTTPException
from typing import TYPE_CHECKING
from xmlrpc.client import Error as XmlRpcError

import rospy

from blackboard.costing.saved_experience import as_plain, saved_from
from hive_common.ros.names import RobotNames
from hive_common.structuring import NotAllowedError

if TYPE_CHECKING:
    from collections.abc import Iterator

    from blackboard.costing.saved_experience import SavedExperience

PARAMETER = "learned"
_BODY = "characteristics"
_NO_ANSWER = (OSError, HTTPException, XmlRpcError, rospy.ROSException)
"""What is raised where the master does not answer, or answers something else."""


class LearnedParameter:
    """One robot's parameter `learned`, which a thread of its own writes.

    A master that is slow, or gone, holds nobody up: the robot's journal has all of it.

    Args:
        names: The robot's.

    ROS Parameters: `learned` of the robot (written), and `characteristics` and `learned` of the
        hive's robots (read by `of_model`).
    """

    def __init__(self, names: RobotNames) -> None:
        self._names = names
        self._newest: SavedExperience | None = None
        self._lock = threading.Lock()
        self._busy = False

    def tell(self, saved: SavedExperience) -> None:
        """Write what the robot has learned, soon."""
        with self._lock:
            self._newest = saved
            if self._busy:
                return
            self._busy = True
        threading.Thread(target=self._write, name="learned", daemon=True).start()

    def _write(self) -> None:
        while True:
            with self._lock:
                saved, self._newest = self._newest, None
                if saved is None:
                    self._busy = False
                    return
            try:
                rospy.set_param(self._names.of(PARAMETER), as_plain(saved))
            except _NO_ANSWER as error:
                rospy.logdebug(f"{PARAMETER} was not written: {error}")

    def of_model(self) -> Iterator[SavedExperience]:
        """Yield what other robots with the same characteristics have learned."""
        try:
            own = rospy.get_param(self._names.of(_BODY), None)
            for name in rospy.get_param_names():
                robot, _, rest = name.removeprefix(self._names.hive).partition("/")
                if rest == f"{PARAMETER}/{PARAMETER}" and robot != self._names.robot:
                    other = RobotNames(self._names.hive, robot)
                    if rospy.get_param(other.of(_BODY), None) == own:
                        yield from _read(other)
        except _NO_ANSWER as error:
            rospy.logwarn(f"nothing is known of what other robots have learned: {error}")


def _read(names: RobotNames) -> Iterator[SavedExperience]:
    name = names.of(PARAMETER)
    try:
        yield saved_from(rospy.get_param(name, None))
    except NotAllowedError as error:
        rospy.logwarn(f"parameter {name} is ignored: {error}")
