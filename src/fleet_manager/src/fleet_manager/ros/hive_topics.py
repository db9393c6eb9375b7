# SPDX-License-Identifier: BSD-3-Clause
"""The hive's topics for operators: turns messages into facts, and requests into messages.

Every program of the operator's listens and speaks through `HiveTopics`.
"""

from __future__ import annotations

import time
from functools import partial
from threading import Lock
from typing import TYPE_CHECKING, Any

import rosgraph.names
import rospy

from blackboard.domain import talker as topics
from blackboard.domain.characteristics import RobotState, RobotStatus
from fleet_manager.client.reports import HiveMessage
from fleet_manager.client.topics import AUCTIONS, CHANGES, ZONE_COMMAND, superseded
from fleet_manager.client.traffic import ZoneCommand
from fleet_manager.codec.operator_wires import OPERATOR_WIRES
from fleet_manager.desk.facts import CancelTask, PostTask

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Mapping

    from fleet_manager.desk.facts import Request
    from fleet_manager.desk.inbox import FactSink

QUEUE_SIZE = 1000
_SOON = 1.0  # [s] in which everyone who listens has connected to a new publisher


class HiveTopics:
    """Listens to the hive and speaks to it. A callback converts its message and puts it away.

    Args:
        put: Takes in facts.
        met: Called from ROS's threads with the name of every robot that reports for the first
            time. It must not wait for the master, so `advertise_to` is for another thread.

    Attributes:
        heard: Robots whose status has been heard.
        robots_of: The robots of each node that has told which it speaks for.

    ROS Subscribers:
        bb_sync, task_state, robot_status, bb_backup, traffic_state: the hive's state.
        new_task, task_cost: what is posted and bid.

    ROS Publishers:
        new_task (blackboard/TaskMsg), task_cancel (std_msgs/String), zone_command
        (robot_description/ZoneCommand), and ROBOT/set_state (std_msgs/String) of every robot in
        `advertise_to`.
    """

    def __init__(self, put: FactSink, met: Callable[[str], None] = lambda _robot: None) -> None:
        self._put, self._met = put, met
        self._publishers: dict[str, rospy.Publisher] = {}
        self._late: dict[str, LateSubscribers] = {}
        self._robots: set[str] = set()
        self._followed: set[str] = set()
        self.heard: set[str] = set()
        self.robots_of: dict[str, frozenset[str]] = {}
        self._raw_list: rospy.AnyMsg | None = None

    def listen_to_all(self) -> None:
        """Follow everything that the hive says; task lists wait for `read_list`."""
        self.listen((*CHANGES, *AUCTIONS))
        rospy.Subscriber(topics.SYNC, rospy.AnyMsg, self._hear_list, queue_size=1)

    def listen(self, names: Iterable[str]) -> None:
        """Follow topics of the hive; those that are followed already stay as they are."""
        for topic in names:
            if topic in self._followed:
                continue
            self._followed.add(topic)
            message = OPERATOR_WIRES[topic].message
            rospy.Subscriber(topic, message, partial(self._hear, topic), queue_size=QUEUE_SIZE)

    def read_list(self) -> None:
        """Read the newest task list, if one has come since the last call.

        A list of thousands of tasks may come several times a second, and reading one takes longer
        than all other messages together. Single changes come at once on task_state, so it is
        enough to read the list now and then.
        """
        raw, self._raw_list = self._raw_list, None
        if raw is not None:
            msg = OPERATOR_WIRES[topics.SYNC].message()
            self._hear(topics.SYNC, msg.deserialize(raw._buff))  # noqa: SLF001  (AnyMsg's only field)

    def advertise(self) -> None:
        """Prepare to post and cancel tasks; `speak` does so too, when it has to."""
        for topic in (topics.NEW_TASK, topics.TASK_CANCEL):
            self._advertise(topic, topic)

    def advertise_to(self, robot: str) -> None:
        """Prepare to command a robot."""
        if rosgraph.names.is_legal_base_name(robot):
            self._advertise(f"{robot}/{topics.SET_STATE}", topics.SET_STATE)
        else:
            rospy.logwarn(f"robot {robot[:64]!r} cannot be commanded: ROS allows no such name")

    def speak(self, request: Request) -> None:
        """Publish a request, once; also to those who connect within a second."""
        if isinstance(request, PostTask):
            self._publish(topics.NEW_TASK, topics.NEW_TASK, request.task)
        elif isinstance(request, CancelTask):
            self._publish(topics.TASK_CANCEL, topics.TASK_CANCEL, request.task_id)
        elif isinstance(request, ZoneCommand):
            self._publish(ZONE_COMMAND, ZONE_COMMAND, request)
        else:
            name = f"{request.robot}/{topics.SET_STATE}"
            self._publish(name, topics.SET_STATE, request.word)

    def _advertise(self, name: str, topic: str) -> None:
        late = self._late[name] = LateSubscribers()
        message = OPERATOR_WIRES[topic].message
        self._publishers[name] = rospy.Publisher(name, message, late, queue_size=QUEUE_SIZE)

    def _publish(self, name: str, topic: str, value: object) -> None:
        if name == topic and name not in self._publishers:
            self._advertise(name, topic)
        if name in self._publishers:
            msg = OPERATOR_WIRES[topic].to_msg(value, rospy.get_time())
            self._late[name].publish(self._publishers[name].publish, msg)

    def _hear(self, topic: str, msg: Any) -> None:  # noqa: ANN401  (of the topic's type)
        try:
            report = OPERATOR_WIRES[topic].from_msg(msg)
        except ValueError as error:
            rospy.logerr_throttle_identical(10, f"a message on {topic} was refused: {error}")
            return
        message = HiveMessage(report, msg.header.stamp.to_sec())
        self._put(message, superseded(topic, report))
        if isinstance(report, RobotStatus):
            self._note_robot(report, msg._connection_header)  # noqa: SLF001  (rospy has no other way)

    def _note_robot(self, status: RobotStatus, header: Mapping[str, str]) -> None:
        if status.robot_id not in self._robots:
            self._robots.add(status.robot_id)
            self._met(status.robot_id)
        if status.state is not RobotState.OFFLINE:
            self.heard.add(status.robot_id)
        if robots := header.get("robots"):
            self.robots_of[header["callerid"]] = frozenset(robots.split())

    def _hear_list(self, raw: rospy.AnyMsg) -> None:
        self._raw_list = raw


class LateSubscribers(rospy.SubscribeListener):  # type: ignore[misc]  # rospy is not typed
    """Gives a message to those who connect soon after it was published.

    A publisher knows nobody when it is made, and what it publishes then is lost.
    """

    def __init__(self) -> None:
        self._lock = Lock()  # rospy has one buffer for what it sends, and does not lock it here
        self._kept: tuple[float, object] = (-_SOON, None)

    def publish(self, publish: Callable[[object], None], msg: object) -> None:
        """Publish a message and keep it; nobody who connects meanwhile misses it."""
        with self._lock:
            self._kept = (time.monotonic(), msg)
            publish(msg)

    def peer_subscribe(
        self, _name: str, _publish: Callable[[object], None], tell: Callable[[object], None]
    ) -> None:
        """Give the message to a new subscriber; rospy calls this."""
        with self._lock:
            since, msg = self._kept
            if time.monotonic() - since < _SOON:
                tell(msg)
