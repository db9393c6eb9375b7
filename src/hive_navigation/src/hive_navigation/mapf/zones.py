# SPDX-License-Identifier: BSD-3-Clause
"""Zones: areas of the map in which an operator limits how robots drive.

A zone acts on the lanes and places of a roadmap, so the planner needs to know nothing about it. A
closed zone keeps all robots out, whatever its kind; robots inside may leave.
"""

from __future__ import annotations

import math
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from hive_common.compiled import compiled
from hive_common.zone import AT_MOST, KEEP_OUT, ONE_WAY, PARKING, SLOW, inside
from hive_navigation.mapf.roadmap import Limit

if TYPE_CHECKING:
    from collections.abc import Collection

    from numpy.typing import NDArray

    from hive_common.geometry import Array
    from hive_common.zone import Zone
    from hive_navigation.mapf.roadmap import Roadmap

SAMPLES = 32  # points of a lane that tell whether it leads through a zone
AGAINST = 0.01  # cosine; lanes across a one-way zone may be used both ways
TINY = 1e-9  # [m]


def with_zones(
    roadmap: Roadmap, zones: Collection[Zone], closed: Collection[str] | None = None
) -> Roadmap:
    """Return the roadmap with zones in force; about a millisecond each.

    Places keep their indices; lanes that nobody may use are gone.

    Args:
        roadmap: One without zones.
        zones: What the operator has set.
        closed: Names of those that are closed; None for those that say so themselves.
    """
    if not zones:
        return roadmap
    shut = {zone.name for zone in zones if zone.closed} if closed is None else closed
    result = replace(roadmap, zones=tuple(zones), closed=frozenset(shut), unzoned=roadmap)
    for zone in zones:
        result = _applied(result, zone, KEEP_OUT if zone.name in shut else zone.kind)
    return result


def roadmap_with(base: Roadmap, closed: Collection[str]) -> Roadmap:
    """Return a roadmap of the same map and zones of which others are closed.

    Args:
        base: A roadmap without ends, whichever of its zones are closed.
        closed: The names of all zones that are closed now.
    """
    return with_zones(base.unzoned or base, base.zones, closed)


def _applied(roadmap: Roadmap, zone: Zone, kind: str) -> Roadmap:
    """Return the roadmap with one more zone in force."""
    corners = np.array(zone.corners, dtype=float)
    if kind == KEEP_OUT:
        return _kept_out(roadmap, corners)
    here = inside(corners, roadmap.places)
    through = _through(roadmap, corners)
    if kind == ONE_WAY:
        steps = roadmap.places[roadmap.lanes[:, 1]] - roadmap.places[roadmap.lanes[:, 0]]
        angle = zone.direction or 0.0
        ahead = steps @ np.array([math.cos(angle), math.sin(angle)])
        return _without(roadmap, through & (ahead < -AGAINST * roadmap.lengths))
    if kind == SLOW:
        most = np.where(through, zone.speed or np.inf, np.inf)
        return replace(roadmap, speeds=np.minimum(roadmap.speeds, most))
    if kind == AT_MOST:
        limit = Limit(zone.name, np.flatnonzero(here), np.flatnonzero(through), zone.robots or 1)
        return replace(roadmap, limits=(*roadmap.limits, limit))
    if kind == PARKING:
        return replace(roadmap, may_park=roadmap.may_park | here)
    return replace(roadmap, may_stop=roadmap.may_stop & ~here, may_park=roadmap.may_park & ~here)


def _kept_out(roadmap: Roadmap, corners: Array) -> Roadmap:
    """Return the roadmap with a polygon that no part of a robot enters.

    Lanes are at most as wide as their distance from it. Lanes that come no nearer to it than they
    begin stay: a robot is there only if it fits, or if it was inside when the zone was closed.
    """
    here = _distances(roadmap.places, roadmap.places, corners)
    starts, stops = (np.ascontiguousarray(roadmap.places[ends]) for ends in roadmap.lanes.T)
    apart = _distances(starts, stops, corners)
    nearer = apart < here[roadmap.lanes[:, 0]] - TINY
    narrowed = replace(
        roadmap,
        widths=np.where(nearer, np.minimum(roadmap.widths, apart), roadmap.widths),
        may_stop=roadmap.may_stop & (here > 0),
        may_park=roadmap.may_park & (here >= roadmap.spacing / 2),
    )
    return _without(narrowed, nearer & (apart <= 0))


def _without(roadmap: Roadmap, gone: NDArray[np.bool_]) -> Roadmap:
    """Return the roadmap without some lanes."""
    kept = ~gone
    number = np.cumsum(kept) - 1
    lanes = np.ascontiguousarray(roadmap.lanes[kept])
    limits = [replace(one, lanes=number[one.lanes[kept[one.lanes]]]) for one in roadmap.limits]
    return replace(
        roadmap,
        lanes=lanes,
        begins=np.searchsorted(lanes[:, 0], np.arange(len(roadmap.places) + 1)),
        lengths=roadmap.lengths[kept],
        widths=roadmap.widths[kept],
        speeds=roadmap.speeds[kept],
        limits=tuple(limits),
    )


def _through(roadmap: Roadmap, corners: Array) -> NDArray[np.bool_]:
    """Return which lanes lead through a polygon, or begin or end in it."""
    starts, stops = (roadmap.places[ends] for ends in roadmap.lanes.T)
    low, high = corners.min(axis=0), corners.max(axis=0)
    near = ((np.minimum(starts, stops) <= high) & (np.maximum(starts, stops) >= low)).all(axis=1)
    shares = np.linspace(0.0, 1.0, SAMPLES)[:, None, None]
    points = starts[near] + shares * (stops - starts)[near]
    found = np.zeros(len(starts), dtype=np.bool_)
    found[near] = inside(corners, points.reshape(-1, 2)).reshape(SAMPLES, -1).any(axis=0)
    return found


@compiled("float64(float64, float64, float64, float64, float64, float64)")
def _from_line(x: float, y: float, ax: float, ay: float, bx: float, by: float) -> float:
    """Return the distance of a point from a line [m]."""
    dx, dy = bx - ax, by - ay
    along = ((x - ax) * dx + (y - ay) * dy) / max(dx * dx + dy * dy, TINY * TINY)
    along = min(max(along, 0.0), 1.0)
    return math.hypot(x - ax - along * dx, y - ay - along * dy)


@compiled("float64[::1](float64[:, ::1], float64[:, ::1], float64[:, ::1])")
def _distances(a: Array, b: Array, corners: Array) -> Array:
    """Return the distances of lines from a (n, 2) to b (n, 2) from a polygon; 0 inside [m]."""
    found = np.empty(len(a))
    for line in range(len(a)):
        ax, ay, bx, by = a[line, 0], a[line, 1], b[line, 0], b[line, 1]
        least, within = np.inf, False
        for corner in range(len(corners)):
            cx, cy = corners[corner - 1]
            dx, dy = corners[corner]
            if (cy <= ay) != (dy <= ay) and ax < cx + (ay - cy) / (dy - cy) * (dx - cx):
                within = not within
            sides_a = (dx - cx) * (ay - cy) - (dy - cy) * (ax - cx)
            sides_b = (dx - cx) * (by - cy) - (dy - cy) * (bx - cx)
            sides_c = (bx - ax) * (cy - ay) - (by - ay) * (cx - ax)
            sides_d = (bx - ax) * (dy - ay) - (by - ay) * (dx - ax)
            if sides_a * sides_b < 0 and sides_c * sides_d < 0:
                least = 0.0
            least = min(
                least,
                _from_line(ax, ay, cx, cy, dx, dy),
                _from_line(bx, by, cx, cy, dx, dy),
                _from_line(cx, cy, ax, ay, bx, by),
                _from_line(dx, dy, ax, ay, bx, by),
            )
        found[line] = 0.0 if within else least
    return found
