# SPDX-License-Identifier: BSD-3-Clause
"""Tells machines with other ROS masters where this machine's robot is, and where it drives.

They only show it. So the newest pose and the newest path cross the network, at most a few times a
second, and again after a while for those that have come since.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

import genpy
import rospy
from nav_msgs.msg import Path

from blackboard.codec.drive_kinds import KINDS, PLAN, POSE
from blackboard.zenoh.link import serialized
from hive_common.machine_clock import machine_time
from hive_common.ros.names import plan_topic

if TYPE_CHECKING:
    from collections.abc import Callable

    import zenoh

    from blackboard.ros.relay import Relay
    from hive_common.ros.names import RobotNames

MOST_POINTS = 200
"""Poses of a path that are told; a display shows no more of a building."""

_LOOK = 0.2
"""Time between two looks whether something has to be told [s]."""

_PERIODS = {POSE: (0.0, 2.0), PLAN: (1.0, 10.0)}
"""The shortest time between two tellings, and the time until the same is told again [s]. A pose
that has changed is told at each look."""

_STAMP_END = 12
"""A message begins with its number and its stamp [B]."""


class Newest:
    """What was heard last on a topic, and when it has to be told. Any thread may use it.

    Args:
        period: Shortest time between two tellings [s].
        again: Time until what has not changed is told again [s].
    """

    def __init__(self, period: float, again: float) -> None:
        self._period, self._again = period, again
        self._heard = self._told = b""
        self._told_at = -math.inf

    def hear(self, payload: bytes) -> None:
        """Note a message, as ROS sends it."""
        self._heard = payload

    def take(self, now: float) -> bytes:
        """Return what has to be told now; empty if nothing has."""
        heard = self._heard
        is_same = heard[_STAMP_END:] == self._told[_STAMP_END:]
        if not heard or now - self._told_at < (self._again if is_same else self._period):
            return b""
        self._told, self._told_at = heard, now
        return heard


class DriveTeller:
    """Takes a robot's pose and path out of its machine.

    It has a thread of its own, because reading a long path would hold the robot's messages up.

    Args:
        relay: Of the robot's process.
        robot: The robot's names.
        refuse: Notes a topic, and why a message on it was refused.

    ROS Subscribers: `amcl_pose` (geometry_msgs/PoseWithCovarianceStamped) of the robot, and its
        path (nav_msgs/Path), see `hive_common.ros.names.plan_topic`.
    """

    def __init__(
        self, relay: Relay, robot: RobotNames, refuse: Callable[[str, str], None]
    ) -> None:
        self._refuse = refuse
        self._newest = {topic: Newest(*periods) for topic, periods in _PERIODS.items()}
        self._publishers: dict[str, zenoh.Publisher] = {
            topic: relay.advertise(f"{robot.robot}/{topic}", for_display=True)
            for topic in self._newest
        }
        # A process gets each topic in one type, and the robot itself needs its poses.
        rospy.Subscriber(robot.of(POSE), KINDS[POSE], self._hear_pose, queue_size=1)
        rospy.Subscriber(plan_topic(robot), rospy.AnyMsg, self._hear_path, queue_size=1)
        rospy.Timer(rospy.Duration.from_sec(_LOOK), self._look, reset=True)

    def _hear_pose(self, msg: Any) -> None:  # noqa: ANN401  (a PoseWithCovarianceStamped)
        self._newest[POSE].hear(serialized(msg))

    def _hear_path(self, msg: rospy.AnyMsg) -> None:
        self._newest[PLAN].hear(msg._buff)  # noqa: SLF001  (AnyMsg's only field)

    def _look(self, _event: rospy.timer.TimerEvent) -> None:
        now = machine_time()
        for topic, newest in self._newest.items():
            if not (payload := newest.take(now)) or rospy.is_shutdown():
                continue
            try:
                payload = thinned(payload) if topic == PLAN else payload
            except (ValueError, genpy.DeserializationError) as error:
                self._refuse(topic, str(error))
            else:
                self._publishers[topic].put(payload)


def thinned(payload: bytes) -> bytes:
    """Return a nav_msgs/Path of at most `MOST_POINTS` poses, the first and the last among them.

    Raises:
        ValueError, genpy.DeserializationError: The bytes are no path.
    """
    path = Path().deserialize(payload)
    count = len(path.poses)
    if count <= MOST_POINTS:
        return payload
    step = (count - 1) / (MOST_POINTS - 1)
    path.poses = [path.poses[round(number * step)] for number in range(MOST_POINTS)]
    return serialized(path)
