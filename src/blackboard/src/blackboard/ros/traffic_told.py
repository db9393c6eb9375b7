# SPDX-License-Identifier: BSD-3-Clause
"""What the traffic planner tells of zones and slow places, for bids."""

from __future__ import annotations

from typing import TYPE_CHECKING

import rospy
from robot_description.msg import TrafficState

from blackboard.costing.traffic_conditions import NO_TRAFFIC, HeardTraffic, SlowPlace
from hive_common.errors import ParameterError
from hive_common.ros.params import structured
from hive_common.zone import Zone

if TYPE_CHECKING:
    from collections.abc import Callable

    from blackboard.costing.traffic_conditions import TrafficConditions


class TrafficTold:
    """Passes on the conditions of traffic: closed zones at once, new delays now and then.

    Args:
        hive: Namespace of the hive, ending in a slash.
        now: Returns the time [s].
        use: Takes new conditions, in a thread of rospy's.

    ROS Subscribers: `traffic_state` (robot_description/TrafficState) of the hive.
    ROS Parameters: `traffic_planner/zones` of the hive, read once.
    """

    def __init__(
        self, hive: str, now: Callable[[], float], use: Callable[[TrafficConditions], None]
    ) -> None:
        self._now, self._use = now, use
        self._heard = HeardTraffic(zones_of(hive))
        self._epoch = 0
        rospy.Subscriber(f"{hive}traffic_state", TrafficState, self._hear, queue_size=1)

    @property
    def conditions(self) -> TrafficConditions:
        """What counts now."""
        return self._heard.conditions

    def _hear(self, msg: TrafficState) -> None:
        if msg.epoch < self._epoch:
            return
        self._epoch = msg.epoch
        slow = [SlowPlace(each.place.x, each.place.y, each.delay) for each in msg.slowest]
        # Where no traffic planner plans, nobody measures delays, and the last ones stay.
        if self._heard.hear(self._now(), msg.closed, None if msg.status else slow):
            self._use(self.conditions)


def zones_of(hive: str) -> tuple[Zone, ...]:
    """Return the hive's zones; none where they are not allowed, as the traffic planner says."""
    try:
        return structured(f"{hive}traffic_planner/zones", tuple[Zone, ...], [])
    except ParameterError:
        return NO_TRAFFIC.zones
