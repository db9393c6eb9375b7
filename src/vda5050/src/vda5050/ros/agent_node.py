# SPDX-License-Identifier: BSD-3-Clause
"""The node `vda5050_agent`: AGVs that speak VDA 5050 as robots of the hive."""

from __future__ import annotations

import functools
import sys
import threading
import time
import traceback
from typing import TYPE_CHECKING, Any

import rospy
import tf2_ros

from blackboard.ros.path_lengths import RosPathLengths
from blackboard.ros.robot_node import topics_of
from blackboard.ros.startup import run_node
from blackboard.ros.transport import make_talker
from hive_common.errors import HiveError
from hive_common.ros.loopback import hear_own_topics
from hive_common.ros.names import RobotNames
from hive_common.ros.params import structured
from hive_navigation.control.goal_tracker import NavigationSettings
from hive_navigation.ros.surroundings import Surroundings
from robot_description.ros.fixed_links import links_of
from vda5050.agent.body import model_of
from vda5050.agent.inspection import FROM_AGVS
from vda5050.mqtt.link import BrokerSettings, Link
from vda5050.protocol.codec import prepare
from vda5050.protocol.topics import parse_topic
from vda5050.protocol.versions import Version
from vda5050.ros.agent_member import AgentMember
from vda5050.ros.newcomer import ASK_PERIOD, Newcomer
from vda5050.ros.vehicle_settings import AgentEntry

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping, Sequence

    from blackboard.domain.settings import PathSettings
    from vda5050.protocol.topics import Address

_SWITCH = 0.001  # how long a thread keeps the interpreter while others want it [s]
_LISTEN_PERIOD = 0.02
"""Between two looks at what came in [s]: an order must not wait for the next round."""
_JOIN_PERIOD = 0.5  # between two looks for AGVs that have come [s]


def main() -> None:
    """Run the agents until the node is shut down.

    ROS Parameters: `~robots`, a list of `AgentEntry`; `~broker`, see `BrokerSettings`; for each
        robot its `characteristics`, which may be missing, whole or in part, where no model is
        named, because then its factsheet fills the gaps; and those of `robot_node` under
        the name of its node.
    ROS Publishers, ROS Subscribers: those of `robot_node`, `Surroundings` and `AgentMember`;
        tf between the links of each robot.
    """
    run_node("vda5050_agent", _run)


def _run() -> None:
    sys.setswitchinterval(_SWITCH)
    hear_own_topics()
    hive = rospy.get_namespace()
    entries = structured("~robots", tuple[AgentEntry, ...], [])
    broker = structured("~broker", BrokerSettings, {})
    for version in {entry.version for entry in entries}:
        prepare(Version(version), FROM_AGVS)
    robots = {RobotNames(hive, entry.name): entry for entry in entries}
    desk = _Desk(Surroundings(hive), broker)
    for names, entry in robots.items():
        desk.expect(names, entry)
    broadcaster = tf2_ros.StaticTransformBroadcaster()
    # A factsheet says nothing of links.
    described = [names for names, entry in robots.items() if entry.model is not None]
    broadcaster.sendTransform([link for names in described for link in links_of(names)])
    _in_thread(desk.surroundings.run)
    desk.link.start()
    try:
        _join_hive(hive, list(robots), desk.members)
    finally:
        desk.link.stop()


class _Desk:
    """All AGVs of the node, and what comes for them from the broker.

    Once it has started, everything is done in the thread of its surroundings.

    Attributes:
        members: The AGVs whose model is known, by manufacturer and serial number.
    """

    def __init__(self, surroundings: Surroundings, broker: BrokerSettings) -> None:
        self.surroundings = surroundings
        self.members: dict[tuple[str, str], AgentMember] = {}
        self._newcomers: dict[Address, Newcomer] = {}
        put = surroundings.inbox.put
        self.link = Link(
            broker,
            f"robo-hive-agent-{time.time_ns():x}",
            lambda name, payload: put(lambda: self._hear(name, payload)),
            lambda connected: put(lambda: self._note_broker(connected)),
        )
        # The launch file starts it again, with nothing that was written down before.
        surroundings.when_set_back(lambda: rospy.signal_shutdown("ROS time was set back"))
        surroundings.every(_LISTEN_PERIOD, lambda: None)
        surroundings.every(ASK_PERIOD, self._ask)

    def expect(self, names: RobotNames, entry: AgentEntry) -> None:
        """Be there for an AGV; without a model, once its factsheet has come."""
        if entry.model is None:
            newcomer = Newcomer(names, entry, self.link)
            self._newcomers[newcomer.address] = newcomer
        else:
            file = rospy.get_param(names.of("characteristics"), {})
            self._welcome(names, entry, model_of(None, file))

    def _welcome(self, names: RobotNames, entry: AgentEntry, content: Mapping[str, Any]) -> None:
        member = AgentMember(names, entry, content, self.surroundings, self.link)
        member.agv.presence.note_broker(connected=self.link.connected, now=rospy.get_time())
        self.members[member.address.manufacturer, member.address.serial] = member
        self.link.subscribe([member.address.topic(topic) for topic in FROM_AGVS])
        self.surroundings.every(1 / NavigationSettings().control_rate, member.round)

    def _ask(self) -> None:
        for newcomer in self._newcomers.values():
            newcomer.ask()

    def _note_broker(self, connected: bool) -> None:
        for member in self.members.values():
            member.agv.presence.note_broker(connected=connected, now=rospy.get_time())

    def _hear(self, name: str, payload: bytes) -> None:
        found = parse_topic(name)
        if found is None:
            return
        address, topic = found
        newcomer = self._newcomers.get(address)
        member = self.members.get((address.manufacturer, address.serial))
        if newcomer is not None and (content := newcomer.read(payload)) is not None:
            del self._newcomers[address]
            self._welcome(newcomer.names, newcomer.entry, content)
        elif member is not None and address == member.address:
            member.hear(topic, payload)


def _join_hive(
    hive: str, robots: Sequence[RobotNames], members: Mapping[tuple[str, str], AgentMember]
) -> None:
    """Let each AGV join once it has told where it is, and run until the node is shut down."""
    talker = make_talker(hive, topics_of(robots))

    @functools.cache
    def lengths(settings: PathSettings) -> RosPathLengths:
        return RosPathLengths(talker, hive, settings)

    def look() -> None:
        for member in tuple(members.values()):
            if member.is_ready:
                member.join(talker, lengths)

    talker.world.every(_JOIN_PERIOD, look)
    talker.spin()


def _in_thread(run: Callable[[], None]) -> None:
    """Run something beside the main thread; an error in it ends the process."""

    def run_to_the_end() -> None:
        try:
            run()
        except rospy.ROSInterruptException:
            return
        except Exception as error:  # noqa: BLE001  (whatever it is, half an agent is no use)
            text = str(error) if isinstance(error, HiveError) else traceback.format_exc()
            rospy.logfatal(text)
            rospy.signal_shutdown(text)

    threading.Thread(target=run_to_the_end, daemon=True).start()
