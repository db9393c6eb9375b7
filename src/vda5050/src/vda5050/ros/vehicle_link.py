# SPDX-License-Identifier: BSD-3-Clause
"""What nodes of vehicles have in common: a connection to the broker for each, and one clock."""

from __future__ import annotations

import math
import time
from typing import TYPE_CHECKING, TypeVar

import rospy

from hive_navigation.control.catching_up import CatchingUp
from vda5050.mqtt.link import BrokerSettings, Link, Will

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping, Sequence

    from hive_common.ros.inbox import Inbox
    from vda5050.protocol.topics import Address
    from vda5050.vehicle.endpoint import Endpoint

T = TypeVar("T")

_ROUNDING = 1e-6  # a multiple of a period may come out a little less than whole [s]

CONTROL_PERIOD = 0.1
"""Between two steps of vehicles, on the clock of ROS [s]."""

_LISTEN = 0.02
"""The longest wait for a message [s, wall clock]; the clock is looked at as often."""


class VehicleLink:
    """The connection of one vehicle to the broker.

    A vehicle has one of its own, because its last will is said when that breaks.
    """

    def __init__(self, broker: BrokerSettings, address: Address, inbox: Inbox) -> None:
        self._broker, self._inbox = broker, inbox
        self._client_id = f"{address.manufacturer}-{address.serial}"
        self._link: Link | None = None
        self._endpoint: Endpoint | None = None

    def send(self, name: str, payload: bytes, qos: int, retain: bool) -> None:
        """Send bytes on a topic; without a broker they are lost, as the standard has it."""
        if self._link is not None:
            self._link.publish(name, payload, qos, retain=retain)

    def start(self, endpoint: Endpoint, hear: Callable[[str, bytes], None]) -> None:
        """Connect a vehicle; its main thread hears what comes."""
        self._endpoint = endpoint
        self._link = Link(
            self._broker,
            self._client_id,
            lambda name, payload: self._inbox.put(lambda: hear(name, payload)),
            lambda connected: self._inbox.put(lambda: self._changed(connected)),
            Will(*endpoint.channel.will),
        )
        self._link.subscribe(endpoint.channel.heard)
        self._link.start()

    def stop(self) -> None:
        """Say goodbye."""
        if self._link is not None and self._endpoint is not None:
            self._endpoint.channel.say_goodbye()
            self._link.stop()

    def _changed(self, connected: bool) -> None:
        if connected and self._endpoint is not None:
            self._endpoint.report.connected()


def keep_stepping(
    steps: Sequence[Callable[[float], None]],
    inbox: Inbox,
    recent_until: Callable[[], Mapping[str, float]] = dict,
) -> None:
    """Let vehicles go on once a period of the clock, and hear in between, until shutdown.

    Args:
        steps: Each lets a vehicle go on to a time [s].
        inbox: What the vehicles hear.
        recent_until: Says what vehicles in a simulation act on, see `CatchingUp.wait`. They wait
            for what is late, because they steer by where they were told that they are.
    """
    rounds = -1
    catching_up = CatchingUp(rospy.get_time, time.monotonic)
    while not rospy.is_shutdown():
        inbox.wait(_LISTEN)
        now = rospy.get_time()
        if round_at(now) == rounds:
            continue
        rounds = round_at(now)
        late = catching_up.wait(recent_until, inbox.wait)
        if late:
            rospy.logwarn_throttle(10, f"nothing recent came in time on {', '.join(late)}")
        for step in steps:
            step(now)


def round_at(now: float) -> int:
    """Return the number of the round that a time [s] belongs to.

    A simulator that waits for a command goes no further, so no round may begin a little late.
    """
    return math.floor((now + _ROUNDING) / CONTROL_PERIOD)
