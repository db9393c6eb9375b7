# SPDX-License-Identifier: BSD-3-Clause
"""The client's way to the hive on ROS; see `fleet_manager.client.client.Link`."""

from __future__ import annotations

import contextlib
import os
import queue
import time
from functools import partial
from typing import TYPE_CHECKING, Any

import rosgraph
import rospy
from nav_msgs.msg import Odometry
from sensor_msgs.msg import BatteryState
from std_msgs.msg import UInt32

from blackboard.domain import talker as topics
from blackboard.ros.codec.conversions import WIRES
from fleet_manager.client.client import DEFAULT_URI
from fleet_manager.client.samples import BatteryReading, Collisions, TruePlace
from fleet_manager.errors import NoHiveError

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Sequence

    from blackboard.domain.task import Task
    from fleet_manager.client.hive_view import Report

_LISTENS = (topics.SYNC, topics.TASK_STATE, topics.ROBOT_STATUS, topics.BACKUP)
_SPEAKS: tuple[str, ...] = (topics.NEW_TASK, topics.TASK_CANCEL)
_QUEUE_SIZE = 1000


@contextlib.contextmanager
def connect(record: Sequence[str] = ()) -> Iterator[HiveLink]:
    """Open a link to the hive whose ROS master is at ROS_MASTER_URI; close it at the end.

    Args:
        record: Robots of which ground truth and battery are handed over too, with the
            collisions that the simulator counts.

    Raises:
        NoHiveError: No ROS master answers.
    """
    os.environ.setdefault("ROS_MASTER_URI", DEFAULT_URI)
    if not rosgraph.is_master_online():
        raise NoHiveError(
            f"no ROS master answers at {rosgraph.get_master_uri()}; start a hive with "
            "`roslaunch fleet_manager fleet_manager.launch`, or set ROS_MASTER_URI"
        )
    rospy.init_node("hive", anonymous=True, disable_signals=True, log_level=rospy.ERROR)
    link = HiveLink()
    link.start()
    link.record(record)
    try:
        yield link
    finally:
        rospy.signal_shutdown("the command has ended")


class HiveLink:
    """Hands over what the hive says, one report at a time.

    ROS Subscribers:
        bb_sync, task_state, robot_status, bb_backup: what the hive says.
        ROBOT/ground_truth (nav_msgs/Odometry), ROBOT/battery_state (sensor_msgs/BatteryState),
        simenv/collisions (std_msgs/UInt32): of the robots that are recorded.

    ROS Publishers:
        new_task (blackboard/TaskMsg), task_cancel (std_msgs/String).
    """

    def __init__(self) -> None:
        self._reports: queue.SimpleQueue[Report] = queue.SimpleQueue()
        self._publishers: dict[str, rospy.Publisher] = {}

    def start(self) -> None:
        """Begin to listen, and make the publishers."""
        for topic in _SPEAKS:
            self._publishers[topic] = rospy.Publisher(
                topic, WIRES[topic].message, queue_size=_QUEUE_SIZE
            )
        for topic in _LISTENS:
            self._listen(topic, WIRES[topic].message, WIRES[topic].from_msg)

    def record(self, robots: Sequence[str]) -> None:
        """Hand over, from now on, what the simulator and these robots tell a recorder."""
        for robot in robots:
            self._listen(f"{robot}/ground_truth", Odometry, partial(_place, robot))
            self._listen(f"{robot}/battery_state", BatteryState, partial(_battery, robot))
        if robots:
            self._listen("simenv/collisions", UInt32, lambda msg: Collisions(msg.data))

    def now(self) -> float:
        """Return a clock that never jumps [s]."""
        return time.monotonic()

    def hive_time(self) -> float:
        """Return the hive's time [s]."""
        return float(rospy.get_time())

    def post(self, task: Task) -> None:
        """Publish a task on `new_task`, once."""
        self._publishers[topics.NEW_TASK].publish(WIRES[topics.NEW_TASK].to_msg(task))

    def cancel(self, task_id: str) -> None:
        """Publish a task's id on `task_cancel`, once."""
        self._publishers[topics.TASK_CANCEL].publish(WIRES[topics.TASK_CANCEL].to_msg(task_id))

    def receive(self, timeout: float) -> Report | None:
        """Return the next thing the hive said, or None after `timeout` [s]."""
        try:
            return self._reports.get(timeout=max(timeout, 0.0))
        except queue.Empty:
            return None

    def _listen(self, topic: str, message: type, from_msg: Callable[[Any], Report]) -> None:
        def receive(msg: Any) -> None:  # noqa: ANN401  (of the topic's type)
            try:
                self._reports.put(from_msg(msg))
            except ValueError as error:
                rospy.logerr_throttle_identical(10, f"a message on {topic} is refused: {error}")

        rospy.Subscriber(topic, message, receive, queue_size=_QUEUE_SIZE)


def _place(robot: str, msg: Odometry) -> TruePlace:
    position = msg.pose.pose.position
    return TruePlace(robot, position.x, position.y)


def _battery(robot: str, msg: BatteryState) -> BatteryReading:
    return BatteryReading(robot, msg.voltage, msg.charge)
