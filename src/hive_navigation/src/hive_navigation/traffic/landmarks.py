# SPDX-License-Identifier: BSD-3-Clause
"""Says in words where robots are, and why they cannot go on."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from hive_common.zone import inside
from hive_navigation.traffic.deadlock import Kind

if TYPE_CHECKING:
    from collections.abc import Sequence

    from hive_common.landmark import Landmark
    from hive_common.zone import Zone
    from hive_navigation.planning.path import Point
    from hive_navigation.traffic.deadlock import Lock

AT, NEAR = 1.0, 3.0  # how far from a landmark a robot is at it, and near it [m]


class Landmarks:
    """What people call the places of a map."""

    def __init__(self, landmarks: Sequence[Landmark] = (), zones: Sequence[Zone] = ()) -> None:
        self._landmarks = landmarks
        areas = [(zone.name, np.array(zone.corners)) for zone in zones]
        self._areas = sorted(areas, key=lambda area: float(np.prod(np.ptp(area[1], axis=0))))

    def where(self, point: Point) -> str:
        """Return where a point is, frame map [m].

        At a landmark, in the smallest zone, near a landmark, or else its coordinates.
        """
        nearest, distance = "", math.inf
        for landmark in self._landmarks:
            far = math.dist(landmark.at, point)
            if far < distance:
                nearest, distance = landmark.name, far
        if distance <= AT:
            return f"at {nearest}"
        for name, corners in self._areas:
            if inside(corners, np.array([point]))[0]:
                return f"in {name}"
        x, y = point
        return f"near {nearest}" if distance <= NEAR else f"at ({x:.1f}, {y:.1f})"

    def words_of(self, lock: Lock) -> str:
        """Return which robots cannot go on, where, and why."""
        robots, places = lock.robots, [self.where(point) for point in lock.at]
        first, where = robots[0], places[0]
        if lock.kind is Kind.HELD:
            return f"{first} stands {where}, and no robot holds it up"
        waits_for = [*robots[1:], first] if lock.kind is Kind.CIRCLE else robots[1:]
        chain = [
            f"{one} waits for {other} {place}"
            for one, other, place in zip(robots, waits_for, places, strict=False)
        ]
        if lock.kind is Kind.BLOCKED:
            chain.append(f"{robots[-1]} stands {places[-1]}")
        elif lock.kind is Kind.OVERTAKEN:
            chain.append(f"{robots[-1]} drives on")
        return ", ".join(chain)
