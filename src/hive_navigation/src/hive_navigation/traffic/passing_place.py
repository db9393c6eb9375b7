# SPDX-License-Identifier: BSD-3-Clause
"""Finds the passing place: the nearest place that is free and on no other robot's path."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from hive_common.compiled import compiled
from hive_navigation.planning.clearance import Disc
from hive_navigation.planning.path import Path
from hive_navigation.planning.planner import PlanError
from hive_navigation.traffic.right_of_way import MIN_GAP, STEP, keep_apart, meetings

if TYPE_CHECKING:
    from collections.abc import Sequence

    from hive_common.geometry import Array
    from hive_navigation.planning.clearance import ClearanceField
    from hive_navigation.planning.path import Point
    from hive_navigation.planning.planner import Planner
    from hive_navigation.traffic.right_of_way import Announcement

DISTANCES = np.concatenate([np.arange(0.4, 2.0, 0.2), np.arange(2.0, 12.1, 0.5)])
"""Distances of the candidates from the robot [m]; beyond, waiting costs less than driving."""

DIRECTIONS = 24  # number of directions in which candidates lie
SLACK = 0.05  # room beyond the required distances at a passing place [m]: robots stop a bit off
ALONG = 3  # points of a claim, `STEP` apart, for one disc
DETOUR = 1.5  # a place towards the approaching robot must be nearer by this much [m]
MAX_PLANS = 4  # number of places out of sight that are planned to; a plan takes some 20 ms


def other_robots(others: Sequence[Announcement]) -> list[Disc]:
    """Return robots as obstacles for a planner.

    What one claims that will not move by itself, such as an AGV out of reach, is one too: it may
    be anywhere there, and the claim does not end.
    """
    return [
        Disc(x, y, other.radius + MIN_GAP)
        for other in others
        for x, y in [(other.x, other.y), *_kept(other)]
    ]


def _kept(other: Announcement) -> list[tuple[float, float]]:
    """Return points along the claim of a stationary robot, frame map [m]."""
    if not other.stationary or other.claim <= 0:
        return []
    points, marks = other.samples
    return [(x, y) for x, y in points[marks <= other.claim + STEP / 2][::ALONG].tolist()]


class PassingPlaces:
    """The places around a robot that are free, whoever's path they are on."""

    def __init__(
        self,
        me: Announcement,
        others: Sequence[Announcement],
        planner: Planner,
        field: ClearanceField,
        need: float,
    ) -> None:
        """Find the places that are free.

        Args:
            me: The robot that moves aside, with the right that it has then.
            others: The robots that are obstacles.
            planner: The robot's planner.
            field: The clearances of the map.
            need: The clearance that the robot needs [m].
        """
        self._me = me
        self._others = others
        self._planner = planner
        self._need = need
        self._discs = other_robots(others)
        self._around = field.with_discs(self._discs)
        places = _candidates(np.array([me.x, me.y]))
        self._places = places[self._around.at_points(places) >= need + SLACK]

    def path_off(self, first: Sequence[Announcement]) -> list[Point] | None:
        """Return a path to the nearest place that the right of way lets the robot drive to.

        `first` are the robots whose paths it must leave and avoid. If no path is free at once, it
        is one that is free later; None if there is no place.
        """
        me, here = self._me, np.array([self._me.x, self._me.y])
        cost: Array = np.hypot(*(self._places - here).T)
        for other in first:
            apart = keep_apart(me.radius, other.radius) + SLACK
            _avoid(self._places, cost, other.samples[0], apart, (me.x, me.y), (other.x, other.y))
        order = np.argsort(cost, kind="stable")
        places = self._places[order[np.isfinite(cost[order])]]
        if not len(places):
            return None
        starts = np.repeat([here], len(places), axis=0)
        visible = np.flatnonzero(self._around.lines_are_clear(starts, places, self._need))
        paths = [[(me.x, me.y), (float(x), float(y))] for x, y in places[visible]]
        if not paths:
            some = places[:: max(1, len(places) // 40)][:MAX_PLANS]
            paths = _planned((me.x, me.y), some, self._planner, self._discs)
        free = (path for path in paths if _is_free(replace(me, path=tuple(path)), self._others))
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


@compiled(
    "void(float64[:, ::1], float64[::1], float64[:, ::1], float64, UniTuple(float64, 2),"
    " UniTuple(float64, 2))"
)
def _avoid(
    places: Array, cost: Array, path: Array, apart: float, here: Point, body: Point
) -> None:
    """Make places (n, 2) cost more because of a robot at `body` with a path (k, 2).

    Those less than `apart` from its path cost infinitely much, those towards it `DETOUR` [m].
    """
    x_min, x_max = np.min(path[:, 0]) - apart, np.max(path[:, 0]) + apart
    y_min, y_max = np.min(path[:, 1]) - apart, np.max(path[:, 1]) + apart
    near = math.hypot(here[0] - body[0], here[1] - body[1]) - SLACK
    for place in range(len(places)):
        x, y = places[place]
        if math.hypot(x - body[0], y - body[1]) < near:
            cost[place] += DETOUR
        if x_min < x < x_max and y_min < y < y_max:
            for point in range(len(path)):
                if math.hypot(x - path[point, 0], y - path[point, 1]) < apart:
                    cost[place] = np.inf
                    break
