# SPDX-License-Identifier: BSD-3-Clause
"""Who waits before a zone that is full: the limits of zones in an action dependency graph.

Robots enter a zone in the order that was planned. The one that would be too many waits until
enough of those before it have left, however late they are.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from hive_common.zone import AT_MOST, inside

if TYPE_CHECKING:
    from collections.abc import Iterable, Sequence

    from hive_common.geometry import Array
    from hive_common.zone import Zone
    from hive_navigation.traffic.committed import Drive

STEP = 0.1  # distance of the points of a course that tell whether it is in a zone [m]


class _Stay(NamedTuple):
    enters: float  # [s]
    leaves: float  # infinite if it stays [s]
    robot: int
    first: int  # the point from which it drives in; -1 if it is in already
    last: int  # the point at which it is out


class ZoneWait(NamedTuple):
    """A robot that must not go on from a point of its course before another one has left a zone.

    Attributes:
        robot: Its number.
        action: The point, by its index.
        other: The number of the other robot.
        passed: The action of the other robot that ends outside the zone.
    """

    robot: int
    action: int
    other: int
    passed: int


def zone_waits(drives: Sequence[Drive], zones: Iterable[Zone]) -> list[ZoneWait]:
    """Return who waits before zones with a limit.

    Args:
        drives: The courses of all robots.
        zones: Those in force.
    """
    waits: list[ZoneWait] = []
    for zone in zones:
        if zone.kind == AT_MOST:
            waits += _waits(drives, np.array(zone.corners, dtype=float), zone.robots or 1)
    return waits


def _waits(drives: Sequence[Drive], corners: Array, most: int) -> list[ZoneWait]:
    found = sorted(
        stay for robot, drive in enumerate(drives) for stay in _stays(robot, drive, corners)
    )
    waits = []
    for index, stay in enumerate(found):
        before = [each for each in found[:index] if each.robot != stay.robot]
        leaving = sorted(before, key=lambda each: each.leaves)
        if stay.first >= 0:
            waits += [
                ZoneWait(stay.robot, stay.first, each.robot, each.last - 1)
                for each in leaving[: max(0, len(before) - most + 1)]
            ]
    return waits


def _stays(robot: int, drive: Drive, corners: Array) -> list[_Stay]:
    """Return when a robot is in a zone."""
    points = np.array(drive.points, dtype=float)
    here = inside(corners, points)
    through = [
        bool(inside(corners, _between(points[k], points[k + 1])).any())
        for k in range(len(points) - 1)
    ]
    stays: list[_Stay] = []
    first: int | None = -1 if here[0] else None
    for k, leads in enumerate(through):
        if first is None and leads:
            first = k
        if first is not None and not here[k + 1]:
            enters = -math.inf if first < 0 else drive.leaves[first]
            stays.append(_Stay(enters, drive.arrives[k + 1], robot, first, k + 1))
            first = None
    if first is not None:
        enters = -math.inf if first < 0 else drive.leaves[first]
        stays.append(_Stay(enters, math.inf, robot, first, len(points)))
    return stays


def _between(one: Array, other: Array) -> Array:
    """Return points along a line, (n, 2)."""
    count = max(2, math.ceil(float(np.hypot(*(other - one))) / STEP) + 1)
    line: Array = one + np.linspace(0.0, 1.0, count)[:, None] * (other - one)
    return line
