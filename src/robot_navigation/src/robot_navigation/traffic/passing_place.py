# SPDX-License-Identifier: BSD-3-Clause
"""Finds the passing place: the nearest place that is free and on no other robot's path."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from robot_navigation.planning.clearance import Disc
from robot_navigation.planning.path import Path
from robot_navigation.planning.planner import PlanError
from robot_navigation.traffic.right_of_way import MIN_GAP, keep_apart, meetings

if TYPE_CHECKING:
    from collections.abc import Sequence

    from hive_common.geometry import Array
    from robot_navigation.planning.clearance import ClearanceField
    from robot_navigation.planning.path import Point
    from robot_navigation.planning.planner import Planner
    from robot_navigation.traffic.right_of_way import Announcement

DISTANCES = np.concatenate([np.arange(0.4, 2.0, 0.2), np.arange(2.0, 12.1, 0.5)])
"""Distances of the candidates from the robot [m]; beyond, waiting costs less than driving."""

DIRECTIONS = 24  # number of directions in which candidates lie
SLACK = 0.05  # room beyond the required distances at a passing place [m]: robots stop a bit off
DETOUR = 1.5  # a place towards the approaching robot must be nearer by this much [m]
MAX_PLANS = 4  # number of places out of sight that are planned to; a plan takes some 20 ms


def other_robots(others: Sequence[Announcement]) -> list[Disc]:
    """Return robots as obstacles for a planner."""
    return [Disc(other.x, other.y, other.radius + MIN_GAP) for other in others]


def path_aside(
    me: Announcement,
    first: Sequence[Announcement],
    others: Sequence[Announcement],
    planner: Planner,
    field: ClearanceField,
    need: float,
) -> list[Point] | None:
    """Return a path to the nearest passing place that the right of way lets the robot drive to.

    Args:
        me: The robot that moves aside, with the right that it has then.
        first: The robots whose paths it must leave and avoid.
        others: The robots that are obstacles.
        planner: The robot's planner.
        field: The clearances of the map.
        need: The clearance that the robot needs [m].

    Returns:
        The corners of the path, frame map [m]; if none is free at once, one that is free later;
        None if there is no place.
    """
    here = np.array([me.x, me.y])
    discs = other_robots(others)
    around = field.with_discs(discs)
    places = _candidates(here)
    places = places[around.at_points(places) >= need + SLACK]
    for other in first:
        places = places[
            _distances(other.samples[0], places) >= keep_apart(me.radius, other.radius) + SLACK
        ]
    if not len(places):
        return None
    places = places[np.argsort(_cost(here, places, first), kind="stable")]
    starts = np.repeat([here], len(places), axis=0)
    visible = np.flatnonzero(around.lines_are_clear(starts, places, need))
    paths = [[(me.x, me.y), (float(x), float(y))] for x, y in places[visible]]
    if not paths:
        some = places[:: max(1, len(places) // 40)][:MAX_PLANS]
        paths = _planned((me.x, me.y), some, planner, discs)
    free = (path for path in paths if _is_free(replace(me, path=tuple(path)), others))
    return next(free, paths[0] if paths else None)


def _is_free(me: Announcement, others: Sequence[Announcement]) -> bool:
    """Return whether no claim and no right keeps a robot from driving its whole path now."""
    return all(math.isinf(met.room) for other in others for met in meetings(me, [other]))


def _planned(
    here: Point, places: Array, planner: Planner, discs: Sequence[Disc]
) -> list[list[Point]]:
    """Return paths to some places, the shortest first."""
    paths = []
    for x, y in places:
        try:
            paths.append(planner.plan(here, (float(x), float(y)), discs))
        except PlanError:
            continue
    return sorted(paths, key=lambda path: Path(path).length)


def _candidates(here: Array) -> Array:
    """Return places all around the robot, (n, 2) array [m]."""
    angles = np.arange(DIRECTIONS) * (2 * math.pi / DIRECTIONS)
    circle = np.column_stack([np.cos(angles), np.sin(angles)])
    return np.asarray(here + DISTANCES[:, None, None] * circle).reshape(-1, 2)


def _distances(path: Array, places: Array) -> Array:
    """Return the distances of places from the points of a path, (n,) array [m]."""
    apart = np.hypot(places[:, None, 0] - path[None, :, 0], places[:, None, 1] - path[None, :, 1])
    return np.asarray(apart.min(axis=1))


def _cost(here: Array, places: Array, first: Sequence[Announcement]) -> Array:
    """Return how far places are, plus `DETOUR` for each robot that they lie towards [m]."""
    cost: Array = np.hypot(*(places - here).T)
    for other in first:
        body = np.array([other.x, other.y])
        towards = np.hypot(*(places - body).T) < np.hypot(*(here - body)) - SLACK
        cost = cost + DETOUR * towards
    return np.asarray(cost)
