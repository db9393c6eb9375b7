# SPDX-License-Identifier: BSD-3-Clause
"""The gateway: shows a hive that speaks over Zenoh on this machine's ROS master.

Windows, `hive`, RViz, `rosbag` and programs of others see the hive's topics as if it ran here.
What they post, cancel and command reaches the hive under the gateway's certificate.
"""

from __future__ import annotations

import re
from functools import partial
from typing import TYPE_CHECKING, Any

import rospy

from blackboard.codec.tables import WIRES
from blackboard.domain import talker as topics
from blackboard.domain.characteristics import RobotState, RobotStatus
from blackboard.errors import SettingsError
from blackboard.ros.recap import Recap
from blackboard.ros.startup import run_node
from blackboard.ros.traffic_kinds import TRAFFIC_KINDS, TRAFFIC_STATE, ZONE_COMMAND
from blackboard.ros.transport import PARAMETER, join_network, talker_on, zenoh_settings
from fleet_manager.ros.hive_topics import QUEUE_SIZE
from fleet_manager.ros.remote_drives import RemoteDrives

if TYPE_CHECKING:
    from collections.abc import Callable

    from blackboard.process.talker import ProcessTalker
    from blackboard.zenoh.link import ZenohLink

ASKED = (topics.NEW_TASK, topics.TASK_CANCEL)
"""What operators say to the hive."""

SHOWN = tuple(
    topics.Topic[Any](topic) for topic in WIRES if topic not in {*ASKED, topics.SET_STATE}
)
"""What the hive says."""

_NAME = re.compile(r"[A-Za-z][A-Za-z0-9_]*")
"""What ROS allows as a part of a topic's name."""


class Gateway:
    """Publishes on ROS what the hive says, and tells the hive what is published for it on ROS.

    Args:
        talker: Of this process.
        link: Of the talker.
        hive: Namespace of the hive on this machine, ending in a slash.
        drives: Shows where robots are and drive; None where this machine's ROS does already.

    ROS Subscribers: `new_task`, `task_cancel`, and of every robot ROBOT/set_state.
    ROS Publishers: all other topics of the hive, with the types in `codec.tables.WIRES`.
    """

    def __init__(
        self,
        talker: ProcessTalker,
        link: ZenohLink,
        hive: str,
        drives: RemoteDrives | None = None,
    ) -> None:
        self._talker = talker
        self._link = link
        self._hive = hive
        self._drives = drives
        self._robots: set[str] = set()
        self._recap = Recap()
        self._shown: dict[str, rospy.Publisher] = {
            topic: self._advertise(topic) for topic in SHOWN
        }

    def start(self) -> None:
        """Begin to listen on both sides."""
        member = self._talker.member(rospy.get_name())
        for topic in SHOWN:
            member.subscribe(topic, partial(self._show, topic))
        for topic in ASKED:
            self._pass_on(topic, topic, partial(member.publish, topic))

    def _advertise(self, topic: str) -> rospy.Publisher:
        wire = WIRES[topic]
        recap = self._recap if topic == topics.ROBOT_STATUS else None
        publisher = rospy.Publisher(
            self._hive + topic, wire.message, recap, latch=wire.latched, queue_size=QUEUE_SIZE
        )
        if recap is not None:
            recap.attach(publisher)
        return publisher

    def _show(self, topic: str, value: object) -> None:
        if isinstance(value, RobotStatus):
            self._meet(value)
            self._recap.note(value)
        self._shown[topic].publish(WIRES[topic].to_msg(value, rospy.get_time()))

    def _meet(self, status: RobotStatus) -> None:
        """Pass on from now on what a robot is told.

        One that the leader alone tells of may not exist, and ROS allows fewer names.
        """
        robot = status.robot_id
        is_new = robot not in self._robots and status.state is not RobotState.OFFLINE
        if not (is_new and _NAME.fullmatch(robot)):
            return
        self._robots.add(robot)
        self._recap.meet(robot)
        tell = partial(self._link.publish_to_robot, robot, topics.SET_STATE)
        self._pass_on(f"{robot}/{topics.SET_STATE}", topics.SET_STATE, tell)
        if self._drives is not None:
            self._drives.show(robot)

    def _pass_on(self, name: str, topic: str, tell: Callable[[Any], None]) -> None:
        """Tell the hive what is published on ROS under a name below the hive."""
        wire = WIRES[topic]

        def take(msg: Any) -> None:  # noqa: ANN401  (of the topic's type)
            try:
                value = wire.from_msg(msg)
            except ValueError as error:
                self._talker.refuse(topic, str(error))
            else:
                tell(value)

        rospy.Subscriber(
            self._hive + name,
            wire.message,
            self._talker.take(topic, take),
            queue_size=QUEUE_SIZE,
            tcp_nodelay=True,
        )


def main() -> None:
    """Run the gateway until the node is shut down.

    ROS Parameters: `zenoh`, see `blackboard.zenoh.settings`; its certificate is an operator's, or
        a viewer's, whose tasks and commands the hive does not take.
    """
    run_node("hive_gateway", _run)


def _run() -> None:
    settings = zenoh_settings(rospy.get_name())
    if settings is None:
        raise SettingsError(
            f"the parameter {PARAMETER} is missing; give it at least one endpoint of the hive, "
            'for example _zenoh:="{connect: [tls/192.168.1.12:7447], certificates: DIR}"'
        )
    hive = rospy.get_namespace()
    joined = join_network(settings, hive, "", ASKED)
    talker = talker_on(hive, joined.link)
    drives = None
    if settings.own_master:
        relay = joined.relay(hive, talker)
        relay.bring_in(TRAFFIC_STATE, TRAFFIC_KINDS[TRAFFIC_STATE])
        relay.take_out(ZONE_COMMAND, TRAFFIC_KINDS[ZONE_COMMAND])
        drives = RemoteDrives(relay, hive)
    Gateway(talker, joined.link, hive, drives).start()
    talker.spin()
