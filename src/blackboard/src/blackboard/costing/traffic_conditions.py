# SPDX-License-Identifier: BSD-3-Clause
"""What traffic costs robots that drive: where they may not go, and where they lose time.

Path lengths reckon with it, so that a bid knows the way around a closed zone and the time that is
lost in a crowded aisle.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from hive_common.pose import Pose
from hive_common.zone import KEEP_OUT, ONE_WAY, SLOW, inside, keeping_out, with_closed

if TYPE_CHECKING:
    from collections.abc import Collection, Iterable

    from numpy.typing import NDArray

    from hive_common.zone import Zone

    Array = NDArray[np.float64]

ROUND = 1.0
"""How far around a slow place robots lose its delay [m]: the traffic planner tells squares of 2 m
apart, and who drives through the middle of one loses all of it."""

FREE_SPEED = 1.0
"""How fast robots drive where nothing limits them, to reckon what a slow zone costs [m/s]."""

DELAYS_PERIOD = 60.0
"""New delays count so often [s]: with each of them, all path lengths are worked out anew."""

STEP = 3.0  # delays count in such steps, so that most of the time nothing changes [s]
LONGEST = 3600.0  # delays that are longer are no delays of traffic [s]
SQUARE = 2.0  # side of the squares by which the traffic planner tells slow places apart [m]

AGAINST = 0.01  # cosine; who drives across a one-way zone does not drive against it


class SlowPlace(NamedTuple):
    """A place where robots lose time.

    Attributes:
        x, y: Where it is, frame map [m].
        delay: What a robot loses that passes [s].
    """

    x: float
    y: float
    delay: float


@dataclass(frozen=True)
class TrafficConditions:
    """What the traffic planner tells.

    Attributes:
        zones: As they are now; those that are closed say so.
        slow: Where robots lose time.
    """

    zones: tuple[Zone, ...] = ()
    slow: tuple[SlowPlace, ...] = ()

    @property
    def change_nothing(self) -> bool:
        """Whether robots drive as if there were no traffic."""
        limits = any(zone.closed or zone.kind in {KEEP_OUT, ONE_WAY, SLOW} for zone in self.zones)
        return not limits and not self.slow

    def is_shut(self, points: Array) -> NDArray[np.bool_]:
        """Return where no part of a robot may be; `points` (n, 2), frame map [m]."""
        shut = np.zeros(len(points), dtype=np.bool_)
        for zone in keeping_out(self.zones):
            shut |= inside(np.array(zone.corners), points)
        return shut

    def lost_time(self, points: Array) -> Array:
        """Return what a robot loses on each metre at points (n, 2), frame map [s/m]."""
        lost = np.zeros(len(points))
        for zone in self.zones:
            if zone.kind == SLOW and zone.speed is not None:
                slower = max(0.0, 1.0 / zone.speed - 1.0 / FREE_SPEED)
                lost += slower * inside(np.array(zone.corners), points)
        for place in self.slow:
            near = np.hypot(points[:, 0] - place.x, points[:, 1] - place.y) < ROUND
            lost += place.delay / (2 * ROUND) * near
        return lost

    def is_allowed(self, starts: Array, ends: Array) -> NDArray[np.bool_]:
        """Return which moves are not against a one-way zone; (n, 2) each, frame map [m]."""
        allowed = np.ones(len(starts), dtype=np.bool_)
        for zone in self.zones:
            if zone.kind != ONE_WAY or zone.direction is None or zone.closed:
                continue
            corners, moves = np.array(zone.corners), ends - starts
            ahead = moves @ np.array([math.cos(zone.direction), math.sin(zone.direction)])
            against = ahead < -AGAINST * np.hypot(*moves.T)
            allowed &= ~(against & (inside(corners, starts) | inside(corners, ends)))
        return allowed


NO_TRAFFIC = TrafficConditions()
"""Robots drive as if there were nobody else, and no zone."""


class HeardTraffic:
    """Takes in what the traffic planner tells: closed zones at once, new delays now and then.

    Args:
        zones: All that there are.

    Attributes:
        conditions: What counts now.
    """

    def __init__(self, zones: tuple[Zone, ...]) -> None:
        self.conditions = TrafficConditions(zones)
        self._delays_at = -math.inf

    def hear(self, now: float, closed: Collection[str], slow: Iterable[SlowPlace] | None) -> bool:
        """Take in what is told; return whether something else counts now.

        Args:
            now: The time [s].
            closed: The names of the zones that are closed.
            slow: Where robots lose time; None if nobody has measured that.
        """
        before = self.conditions
        zones = with_closed(before.zones, closed)
        counted = before.slow
        is_due = now - self._delays_at >= DELAYS_PERIOD
        if slow is not None and (is_due or zones != before.zones):
            self._delays_at = now
            counted = _in_steps(slow)
        self.conditions = TrafficConditions(zones, counted)
        return self.conditions != before


def _in_steps(told: Iterable[SlowPlace]) -> tuple[SlowPlace, ...]:
    """Return slow places as they count, in an order that does not change."""
    return tuple(
        sorted(
            SlowPlace(_middle(each.x), _middle(each.y), STEP * round(each.delay / STEP))
            for each in told
            if STEP / 2 <= each.delay <= LONGEST and not Pose(each.x, each.y).flaw
        )
    )


def _middle(coordinate: float) -> float:
    """Return the middle of the square that has a coordinate in it [m]."""
    return SQUARE * (math.floor(coordinate / SQUARE) + 0.5)
