# SPDX-License-Identifier: BSD-3-Clause
"""What the traffic planner tells of zones and slow places, for bids."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import attrs
import rospy
from robot_description.msg import TrafficState

from blackboard.costing.traffic_conditions import NO_TRAFFIC, SlowPlace, TrafficConditions
from hive_common.errors import ParameterError
from hive_common.pose import Pose
from hive_common.ros.params import structured
from hive_common.zone import Zone

if TYPE_CHECKING:
    from collections.abc import Callable

DELAYS_PERIOD = 60.0
"""New delays count so often [s]: with each of them, all path lengths are worked out anew."""

STEP = 3.0  # delays count in such steps, so that most of the time nothing changes [s]
LONGEST = 3600.0  # delays that are longer are no delays of traffic [s]
SQUARE = 2.0  # side of the squares by which the traffic planner tells slow places apart [m]


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
        self._zones = zones_of(hive)
        self.conditions = TrafficConditions(self._zones)
        self._epoch = 0
        self._delays_at = -math.inf
        rospy.Subscriber(f"{hive}traffic_state", TrafficState, self._hear, queue_size=1)

    def _hear(self, msg: TrafficState) -> None:
        if msg.epoch < self._epoch:
            return
        self._epoch = msg.epoch
        zones = tuple(attrs.evolve(each, closed=each.name in msg.closed) for each in self._zones)
        slow = self.conditions.slow
        is_due = self._now() - self._delays_at >= DELAYS_PERIOD
        # Where no traffic planner plans, nobody measures delays, and the last ones stay.
        if not msg.status and (is_due or zones != self.conditions.zones):
            self._delays_at = self._now()
            slow = _slow_places(msg)
        told = TrafficConditions(zones, slow)
        if told != self.conditions:
            self.conditions = told
            self._use(told)


def _slow_places(msg: TrafficState) -> tuple[SlowPlace, ...]:
    """Return where robots lose time, in an order that does not change."""
    return tuple(
        sorted(
            SlowPlace(
                _middle(each.place.x), _middle(each.place.y), STEP * round(each.delay / STEP)
            )
            for each in msg.slowest
            if STEP / 2 <= each.delay <= LONGEST and not Pose(each.place.x, each.place.y).flaw
        )
    )


def _middle(coordinate: float) -> float:
    """Return the middle of the square that has a coordinate in it [m]."""
    return SQUARE * (math.floor(coordinate / SQUARE) + 0.5)


def zones_of(hive: str) -> tuple[Zone, ...]:
    """Return the hive's zones; none where they are not allowed, as the traffic planner says."""
    try:
        return structured(f"{hive}traffic_planner/zones", tuple[Zone, ...], [])
    except ParameterError:
        return NO_TRAFFIC.zones
