# SPDX-License-Identifier: BSD-3-Clause
"""What the traffic planner tells of zones and slow places, for bids."""

from __future__ import annotations

from typing import TYPE_CHECKING

import rospy
from robot_description.msg import TrafficState

from blackboard.costing.traffic_conditions import HeardTraffic, SlowPlace
from hive_common.newest_epoch import NewestEpoch
from hive_common.ros.zones import zones_of

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
        self._newest = NewestEpoch()
        rospy.Subscriber(f"{hive}traffic_state", TrafficState, self._hear, queue_size=1)

    @property
    def conditions(self) -> TrafficConditions:
        """What counts now."""
        return self._heard.conditions

    def _hear(self, msg: TrafficState) -> None:
        if not self._newest.admits(msg.epoch, self._now()):
            return
        slow = [SlowPlace(each.place.x, each.place.y, each.delay) for each in msg.slowest]
        # Where no traffic planner plans, nobody measures delays, and the last ones stay.
        if self._heard.hear(self._now(), msg.closed, None if msg.status else slow):
            self._use(self.conditions)
