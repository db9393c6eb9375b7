# SPDX-License-Identifier: BSD-3-Clause
"""Which transport carries a node's messages: ROS, or Zenoh where the parameter `zenoh` is set."""

from __future__ import annotations

import atexit
from functools import partial
from itertools import chain
from typing import TYPE_CHECKING, Any, NamedTuple

import rospy

from blackboard.domain.talker import VOTER_TOPICS
from blackboard.errors import NoRouterError, SettingsError
from blackboard.process.talker import ProcessTalker
from blackboard.ros.talker import RosRuntime, RosTalker
from blackboard.ros.traffic_kinds import ROUTES, TRAFFIC, TRAFFIC_KINDS, TRAFFIC_STATE
from blackboard.zenoh.links import ZenohLinks
from blackboard.zenoh.settings import ZenohSettings
from hive_common.ros.names import RobotNames
from hive_common.ros.params import structured

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping, Sequence

    import zenoh

    from blackboard.process.link import Link
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
    hive: str,
    robots: Mapping[str, Iterable[str]],
    advertises: Iterable[str] = (),
) -> ProcessTalker:
    """Return the talker of this process. Call it after `rospy.init_node`.

    Args:
        hive: Namespace of the hive, ending in a slash.
        robots: The topics on which each robot of this process may speak.
        advertises: The topics on which a process without robots may speak.

    Raises:
        ParameterError: A value of a parameter `zenoh` is not allowed.
        SettingsError: Zenoh cannot start, or only some of the robots speak over it.

    ROS Parameters: `zenoh`, see `blackboard.zenoh.settings`, for each robot that of the node of
        its part of the hive; where it is not set, ROS is used.
    """
    said = {robot: tuple(topics) for robot, topics in robots.items()}
    settings = {robot: zenoh_settings(RobotNames(hive, robot).node) for robot in said}
    if not said:
        node = str(rospy.get_name())
        said, settings = {"": tuple(advertises)}, {"": zenoh_settings(node)}
    over_zenoh = {name: found for name, found in settings.items() if found is not None}
    if not over_zenoh:
        return RosTalker(hive, dict.fromkeys(chain(*said.values())), tuple(robots))
    if missing := ", ".join(sorted(settings.keys() - over_zenoh.keys())):
        raise SettingsError(
            f"the parameter {PARAMETER} is not set for {missing}, but for other robots of this "
            "process; allowed: for all of them, or for none"
        )
    return _talker_over_zenoh(hive, said, over_zenoh)


def _talker_over_zenoh(
    hive: str,
    said: Mapping[str, tuple[str, ...]],
    settings: Mapping[str, ZenohSettings],
) -> ProcessTalker:
    """Return a talker that has a session for each robot, or one for the process if it has none."""
    own_node = str(rospy.get_name()).removeprefix(hive)
    among = tuple(said) if len(said) > 1 else ()
    joined = {
        robot: join_network(settings[robot], hive, robot or own_node, topics, among)
        for robot, topics in said.items()
    }
    talker = talker_on(hive, _link_of({robot: each.link for robot, each in joined.items()}))
    if next(iter(settings.values())).own_master:
        _relay(hive, talker, said, joined)
    return talker


def _link_of(links: Mapping[str, ZenohLink]) -> Link:
    return ZenohLinks(links) if len(links) > 1 else next(iter(links.values()))


def talker_on(hive: str, link: Link) -> ProcessTalker:
    """Return a talker of which a link carries the messages; `hive` is the hive's namespace."""
    talker = ProcessTalker(hive, link, RosRuntime())
    # Wakes `spin`, so that it sees the shutdown.
    rospy.on_shutdown(lambda: talker.call(lambda: None))
    return talker


def _relay(
    hive: str,
    talker: ProcessTalker,
    said: Mapping[str, tuple[str, ...]],
    joined: Mapping[str, Joined],
) -> None:
    """Carry what robots and the traffic planner announce, and where robots are and drive.

    One robot brings in what others say, and one that may lead speaks for the traffic planner,
    which runs beside the leader; each speaks for itself.
    """
    relays = {robot: each.relay(hive, talker, tuple(said)) for robot, each in joined.items()}
    for topic, kind in TRAFFIC_KINDS.items():
        next(iter(relays.values())).bring_in(topic, kind)
    for robot, relay in relays.items():
        if robot:
            joined[robot].tell_drive(RobotNames(hive, robot), talker, relay)
            relay.take_out(TRAFFIC, TRAFFIC_KINDS[TRAFFIC])
    if leading := [robot for robot, topics in said.items() if set(VOTER_TOPICS) <= set(topics)]:
        for topic in (ROUTES, TRAFFIC_STATE):
            relays[leading[0]].take_out(topic, TRAFFIC_KINDS[topic])


def zenoh_settings(node: str) -> ZenohSettings | None:
    """Return what the parameter `zenoh` of a node says; None where it is not set.

    Raises:
        ParameterError: A value is not allowed.
    """
    namespace = node
    while True:
        name = f"{namespace}/{PARAMETER}"
        if rospy.has_param(name):
            return structured(name, ZenohSettings, {})
        if not namespace:
            return None
        namespace = namespace.rpartition("/")[0]


class Joined(NamedTuple):
    """How a process takes part in a hive over Zenoh."""

    session: zenoh.Session
    own: Own  # the hive, and as whom it speaks
    link: ZenohLink

    def relay(self, hive: str, talker: ProcessTalker, ours: Sequence[str] = ()) -> Relay:
        """Return what carries topics that are not the core's.

        Args:
            hive: Namespace of the hive, ending in a slash.
            talker: Of this process.
            ours: All as whom this process speaks.
        """
        from blackboard.ros.relay import Relay  # noqa: PLC0415  (see `join_network`)

        return Relay(self.session, self.own, hive, partial(_refuse, talker), ours)

    def tell_drive(self, robot: RobotNames, talker: ProcessTalker, relay: Relay) -> None:
        """Tell others where a robot of this process is, and where it drives."""
        from blackboard.ros.drives import DriveTeller  # noqa: PLC0415  (see `join_network`)

        DriveTeller(relay, robot, partial(_refuse, talker))


def _refuse(talker: ProcessTalker, topic: str, why: str) -> None:
    """Note in the talker's thread why a message was refused; any thread may call this."""
    talker.call(lambda: talker.refuse(topic, why))


def join_network(
    settings: ZenohSettings,
    hive: str,
    name: str,
    advertises: Iterable[str],
    among: Sequence[str] = (),
) -> Joined:
    """Open a session, which ends with this process.

    Args:
        settings: How it takes part.
        hive: Namespace of the hive, ending in a slash.
        name: Who this process has to be; empty if anyone.
        advertises: The topics that may be published on.
        among: All robots of this process, if it has several.

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
        among=among,
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
