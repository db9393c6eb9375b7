# SPDX-License-Identifier: BSD-3-Clause
"""Which transport carries a node's messages: ROS, or Zenoh where the parameter `zenoh` is set."""

from __future__ import annotations

import atexit
from functools import partial
from typing import TYPE_CHECKING, Any, NamedTuple

import rospy

from blackboard.domain.talker import VOTER_TOPICS
from blackboard.errors import NoRouterError, SettingsError
from blackboard.process.talker import ProcessTalker
from blackboard.ros.talker import RosRuntime, RosTalker
from blackboard.ros.traffic_kinds import ROUTES, TRAFFIC, TRAFFIC_KINDS, TRAFFIC_STATE
from blackboard.zenoh.settings import ZenohSettings
from hive_common.ros.names import RobotNames
from hive_common.ros.params import structured

if TYPE_CHECKING:
    from collections.abc import Collection, Iterable, Mapping

    import zenoh

    from blackboard.ros.relay import Relay
    from blackboard.zenoh.link import ZenohLink
    from blackboard.zenoh.session import Own

PARAMETER = "zenoh"
"""Below the node, or below a namespace above it, as ROS looks for parameters."""

_TRY_AGAIN = 0.3
"""Time before routers that did not answer are asked again [s]."""

_PATIENCE = 5.0
"""Time between two warnings that no router answers [s]."""


def make_talker(
    hive: str, advertises: Iterable[str], robots: Collection[str] = ()
) -> ProcessTalker:
    """Return the talker of this process. Call it after `rospy.init_node`.

    Args:
        hive: Namespace of the hive, ending in a slash.
        advertises: The topics that may be published on.
        robots: The robots of this process.

    Raises:
        ParameterError: A value of the parameter `zenoh` is not allowed.
        SettingsError: Zenoh cannot start; or the process has several robots, which over Zenoh
            speak each for itself.

    ROS Parameters: `zenoh`, see `blackboard.zenoh.settings`; where it is not set, ROS is used.
    """
    settings = zenoh_settings()
    if settings is None:
        return RosTalker(hive, advertises, robots)
    if len(robots) > 1:
        named = ", ".join(robots)
        raise SettingsError(
            f"this process has several robots ({named}), and the parameter {PARAMETER} is set; "
            "over Zenoh each robot needs a process of its own: `processes: each` in the fleet file"
        )
    topics = tuple(advertises)
    name = next(iter(robots), rospy.get_name().removeprefix(hive))
    joined = join_network(settings, hive, name, topics)
    # Who may lead may speak for the traffic planner, which runs beside the leader.
    leads = set(VOTER_TOPICS) <= set(topics)
    said = [*((TRAFFIC,) if robots else ()), *((ROUTES, TRAFFIC_STATE) if leads else ())]
    talker = joined.talker(hive)
    if not settings.own_master:
        return talker
    relay = joined.relay(hive, talker)
    for robot in robots:
        joined.tell_drive(RobotNames(hive, robot), talker, relay)
    for topic, kind in TRAFFIC_KINDS.items():
        relay.bring_in(topic, kind)
        if topic in said:
            relay.take_out(topic, kind)
    return talker


def zenoh_settings() -> ZenohSettings | None:
    """Return what the parameter `zenoh` says; None where it is not set.

    Raises:
        ParameterError: A value is not allowed.
    """
    found = rospy.search_param(PARAMETER)
    return None if found is None else structured(found, ZenohSettings, {})


class Joined(NamedTuple):
    """How a process takes part in a hive over Zenoh."""

    session: zenoh.Session
    own: Own  # the hive, and as whom it speaks
    link: ZenohLink

    def talker(self, hive: str) -> ProcessTalker:
        """Return the talker of this process; `hive` is the hive's namespace."""
        talker = ProcessTalker(hive, self.link, RosRuntime())
        # Wakes `spin`, so that it sees the shutdown.
        rospy.on_shutdown(lambda: talker.call(lambda: None))
        return talker

    def relay(self, hive: str, talker: ProcessTalker) -> Relay:
        """Return what carries topics that are not the core's; see `talker`."""
        from blackboard.ros.relay import Relay  # noqa: PLC0415  (see `join_network`)

        return Relay(self.session, self.own, hive, partial(_refuse, talker))

    def tell_drive(self, robot: RobotNames, talker: ProcessTalker, relay: Relay) -> None:
        """Tell others where a robot of this process is, and where it drives."""
        from blackboard.ros.drives import DriveTeller  # noqa: PLC0415  (see `join_network`)

        DriveTeller(relay, robot, partial(_refuse, talker))


def _refuse(talker: ProcessTalker, topic: str, why: str) -> None:
    """Note in the talker's thread why a message was refused; any thread may call this."""
    talker.call(lambda: talker.refuse(topic, why))


def join_network(
    settings: ZenohSettings, hive: str, name: str, advertises: Iterable[str]
) -> Joined:
    """Open a session, which ends with this process.

    Args:
        settings: How it takes part.
        hive: Namespace of the hive, ending in a slash.
        name: Who this process has to be; empty if anyone.
        advertises: The topics that may be published on.

    Raises:
        SettingsError: An endpoint or the certificate is not allowed, or Zenoh cannot start.
        rospy.ROSInterruptException: The node was shut down before one of its routers answered.
    """
    # On demand: a hive on ROS does not need the engine, which takes 10 MB.
    from blackboard.zenoh.link import ZenohLink  # noqa: PLC0415

    own = settings.own(name)
    session = _open(settings.session())
    atexit.register(session.close)
    link = ZenohLink(
        session,
        own.hive,
        own.name,
        advertises,
        namespace=hive,
        is_member=bool(name),
        address=settings.address,
        date=rospy.get_time,
    )
    return Joined(session, own, link)


def _open(config: Mapping[str, Any]) -> zenoh.Session:
    """Open a session, once one of its routers answers if it has any."""
    from blackboard.zenoh.opening import open_session  # noqa: PLC0415  (see `join_network`)

    while True:
        try:
            return open_session(config)
        except NoRouterError as error:
            rospy.logwarn_throttle(_PATIENCE, str(error))
            rospy.rostime.wallsleep(_TRY_AGAIN)
            if rospy.is_shutdown():
                raise rospy.ROSInterruptException from None
