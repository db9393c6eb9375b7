# SPDX-License-Identifier: BSD-3-Clause
"""Where to wait while others pass: the nearest place that is free and on nobody's way."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from hive_common.grid_map import Disc
from robot_navigation.planning.path import Way
from robot_navigation.planning.planner import PlanError
from robot_navigation.traffic.right_of_way import MIN_GAP, keep_apart, meetings

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

    from hive_common.grid_map import ClearanceField
    from robot_navigation.planning.planner import Planner
    from robot_navigation.traffic.right_of_way import Announcement

    Array = NDArray[np.float64]

Point = tuple[float, float]

DISTANCES = np.concatenate([np.arange(0.4, 2.0, 0.2), np.arange(2.0, 12.1, 0.5)])
"""How far from the robot places are tried [m]; beyond, waiting costs less than going there."""

DIRECTIONS = 24
"""In how many directions places are tried."""

SLACK = 0.05
"""Room beyond the least that a passing place leaves [m], for the robot does not stop exactly."""

TOWARDS = 1.5
"""How much longer a way may be if it does not lead towards the one that comes [m]."""

PLANS = 4
"""How many places out of sight are planned to; a plan takes some 20 ms."""


def other_robots(others: Sequence[Announcement]) -> list[Disc]:
    """Return where robots stand as obstacles for a planner."""
    return [Disc(other.x, other.y, other.radius + MIN_GAP) for other in others]


def way_aside(
    me: Announcement,
    first: Sequence[Announcement],
    others: Sequence[Announcement],
    planner: Planner,
    field: ClearanceField,
    need: float,
) -> list[Point] | None:
    """Return a way to the nearest passing place that the right of way lets the robot drive to.

    Args:
        me: The robot that moves aside, with the right that it has then.
        first: Those whose ways it must leave and keep off.
        others: Everyone who is in the way as a body.
        planner: The robot's planner.
        field: The clearances of the map.
        need: The clearance that the robot needs [m].

    Returns:
        The corners of the way, frame map [m]; one that has to be waited for, if no other is there;
        None if there is no place.
    """
    here = np.array([me.x, me.y])
    discs = other_robots(others)
    around = field.with_discs(discs)
    places = _candidates(here)
    places = places[around.at_points(places) >= need + SLACK]
    for other in first:
        places = places[
            _away(other.samples[0], places) >= keep_apart(me.radius, other.radius) + SLACK
        ]
    if not len(places):
        return None
    places = places[np.argsort(_cost(here, places, first), kind="stable")]
    starts = np.repeat([here], len(places), axis=0)
    seen = np.flatnonzero(around.lines_are_clear(starts, places, need))
    ways = [[(me.x, me.y), (float(x), float(y))] for x, y in places[seen]]
    if not ways:
        ways = _planned((me.x, me.y), places[:: max(1, len(places) // 40)][:PLANS], planner, discs)
    free = (way for way in ways if _is_free(replace(me, way=tuple(way)), others))
    return next(free, ways[0] if ways else None)


def _is_free(me: Announcement, others: Sequence[Announcement]) -> bool:
    """Return whether nobody's claim or right keeps a robot from driving its whole way now."""
    return all(math.isinf(meeting.room) for meeting in meetings(me, others))


def _planned(
    here: Point, places: Array, planner: Planner, discs: Sequence[Disc]
) -> list[list[Point]]:
    """Return ways to some places, the shortest first."""
    ways = []
    for x, y in places:
        try:
            ways.append(planner.plan(here, (float(x), float(y)), discs))
        except PlanError:
            continue
    return sorted(ways, key=lambda way: Way(way).length)


def _candidates(here: Array) -> Array:
    """Return places all around, (n, 2) array [m]."""
    angles = np.arange(DIRECTIONS) * (2 * math.pi / DIRECTIONS)
    circle = np.column_stack([np.cos(angles), np.sin(angles)])
    return np.asarray(here + DISTANCES[:, None, None] * circle).reshape(-1, 2)


def _away(way: Array, places: Array) -> Array:
    """Return how far places are from a way, (n,) array [m]."""
    apart = np.hypot(places[:, None, 0] - way[None, :, 0], places[:, None, 1] - way[None, :, 1])
    return np.asarray(apart.min(axis=1))


def _cost(here: Array, places: Array, first: Sequence[Announcement]) -> Array:
    """Return how far places are, with something on top if they are towards who comes [m]."""
    cost: Array = np.hypot(*(places - here).T)
    for other in first:
        body = np.array([other.x, other.y])
        towards = np.hypot(*(places - body).T) < np.hypot(*(here - body)) - SLACK
        cost = cost + TOWARDS * towards
    return np.asarray(cost)
