# SPDX-License-Identifier: BSD-3-Clause
"""Joins robots and their goals to a roadmap, so that they start and end exactly where they are.

Goals are any points of the map. Each becomes a place of its own, with lanes to the places around
it. That takes a few milliseconds for a fleet, so it is done for every plan.
"""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from robot_navigation.mapf.lane_room import line_rooms, reached, roomy
from robot_navigation.mapf.roadmap import MARGIN, assembled
from robot_navigation.mapf.zones import with_zones

if TYPE_CHECKING:
    from collections.abc import Sequence

    from hive_common.geometry import Array, Indices
    from robot_navigation.mapf.roadmap import Roadmap
    from robot_navigation.planning.clearance import ClearanceField

REACH = 2.3  # how far an end's lanes lead [spacings]: as far as a knight's move
JOINS = 20  # most lanes to and from one end
DIRECT = 4.0  # greatest length of a lane from a robot right to its goal [spacings]
SAME = 0.01  # an end this near to a place is that place [m]

ESCAPE = 0.6
"""How far a robot that stands too close to an obstacle looks for room, as one that plans alone
does [m]."""


def with_ends(
    roadmap: Roadmap,
    field: ClearanceField,
    points: Array,
    radii: Array,
    direct: Sequence[tuple[int, int]] = (),
) -> tuple[Roadmap, Indices]:
    """Return the roadmap with points as further places, and the index of each.

    The places and their order stay; the new ones come after them. A point that lies on a place
    where its robot fits is that place. A point from which no place can be reached has no lane.
    A robot that stands too close to an obstacle may leave on lanes that keep no clearance at their
    end; `widths` then says what the robot needs.

    Args:
        roadmap: One without ends.
        field: The clearances of the map.
        points: (k, 2) starts and goals, frame map [m].
        radii: (k,) radius of the robot that starts or ends there [m].
        direct: Rows of `points`, start and goal of one robot, joined if they see each other.
    """
    points = np.ascontiguousarray(points, dtype=float).reshape(-1, 2)
    needs = np.asarray(radii, dtype=float) + MARGIN
    freed = roomy(field.clearance, field.scale, points, needs, ESCAPE)
    found, widths = _near(roadmap, field, freed, needs, JOINS)
    nearest = np.where(found[:, 0] >= 0, found[:, 0], 0)
    away = np.hypot(*(roadmap.places[nearest] - points).T)
    same = (found[:, 0] >= 0) & (away <= SAME)
    index = np.where(same, nearest, len(roadmap.places) + np.cumsum(~same) - 1)
    found[same] = -1
    rows, columns = np.nonzero(found >= 0)
    lanes = [np.column_stack([index[rows], found[rows, columns]])]
    rooms = [widths[rows, columns]]
    short = _direct(points, index, direct, DIRECT * roadmap.spacing, same)
    if len(short):
        one, other = short.T
        room = line_rooms(
            field.clearance, field.scale, freed[one], freed[other], float(needs[one].min())
        )
        fits = room >= needs[one]
        lanes.append(np.column_stack([index[one], index[other]])[fits])
        rooms.append(room[fits])
    extra = ~same
    ends = assembled(
        np.vstack([roadmap.places, points[extra]]),
        np.concatenate([roadmap.room, np.maximum(field.at_points(points), needs)[extra]]),
        np.vstack(lanes),
        np.concatenate(rooms),
        roadmap.spacing,
    )
    near_parking = (roadmap.may_park[nearest] & (found[:, 0] >= 0))[extra]
    ends = replace(ends, may_park=np.concatenate([roadmap.may_park, near_parking]))
    return _merged(roadmap, with_zones(ends, roadmap.zones, roadmap.closed)), index


def nearest_places(
    roadmap: Roadmap, field: ClearanceField, points: Array, radii: Array, most: int = 1
) -> Indices:
    """Return the places that robots reach on a straight line, the nearest first.

    Args:
        roadmap: Where places are searched.
        field: The clearances of the map.
        points: (k, 2) where the robots are, frame map [m].
        radii: (k,) their radii [m].
        most: How many places are returned at most for each.

    Returns:
        (k, most) indices; -1 where there are no more.
    """
    points = np.ascontiguousarray(points, dtype=float).reshape(-1, 2)
    needs = np.asarray(radii, dtype=float) + MARGIN
    freed = roomy(field.clearance, field.scale, points, needs, ESCAPE)
    return _near(roadmap, field, freed, needs, most)[0]


def _near(
    roadmap: Roadmap, field: ClearanceField, points: Array, needs: Array, most: int
) -> tuple[Indices, Array]:
    """Return the nearest places that each point reaches, and the room on the way."""
    order = np.argsort(roadmap.places[:, 1], kind="stable")
    found, widths = reached(
        field.clearance,
        field.scale,
        points,
        needs,
        np.ascontiguousarray(roadmap.places[order]),
        roadmap.room[order],
        np.full(len(points), REACH * roadmap.spacing),
        most,
    )
    return np.where(found >= 0, order[found], -1), widths


def _direct(
    points: Array, index: Indices, pairs: Sequence[tuple[int, int]], longest: float, same: Array
) -> Indices:
    """Return the pairs (k, 2) that are to be joined: short ones, not two that are places."""
    rows = np.array(pairs, dtype=np.intp).reshape(-1, 2)
    one, other = rows.T
    apart = np.hypot(*(points[other] - points[one]).T)
    found: Indices = rows[
        (apart <= longest) & (index[one] != index[other]) & ~(same[one] & same[other])
    ]
    return found


def _merged(roadmap: Roadmap, ends: Roadmap) -> Roadmap:
    """Return the roadmap with more places, and with the lanes of both."""
    lanes = np.concatenate([roadmap.lanes, ends.lanes])
    order = np.argsort(lanes[:, 0], kind="stable")
    lanes = np.ascontiguousarray(lanes[order])
    number = np.empty_like(order)
    number[order] = np.arange(len(order))
    old, count = len(roadmap.lanes), len(roadmap.places)
    limits = [
        replace(more, lanes=number[np.concatenate([one.lanes, old + more.lanes])])
        for one, more in zip(roadmap.limits, ends.limits, strict=True)
    ]
    always = np.ones(len(ends.places) - count, dtype=np.bool_)
    return replace(
        roadmap,
        places=ends.places,
        room=ends.room,
        lanes=lanes,
        begins=np.searchsorted(lanes[:, 0], np.arange(len(ends.places) + 1)),
        lengths=np.concatenate([roadmap.lengths, ends.lengths])[order],
        widths=np.concatenate([roadmap.widths, ends.widths])[order],
        speeds=np.concatenate([roadmap.speeds, ends.speeds])[order],
        may_stop=np.concatenate([roadmap.may_stop, always]),
        may_park=np.concatenate([roadmap.may_park, ends.may_park[count:]]),
        limits=tuple(limits),
    )


def shortened(
    field: ClearanceField, points: Array, radius: float, fixed: Sequence[bool] | None = None
) -> Indices:
    """Return which points of a path a robot still passes if it cuts corners where it fits.

    A robot alone drives hardly farther then than on the shortest path there is.

    Args:
        field: The clearances of the map.
        points: (n, 2) the corners of the path, frame map [m].
        radius: Of the robot [m].
        fixed: (n,) which points it has to pass; None for the first and the last one only.

    Returns:
        (m,) indices of points, the first and the last one included.
    """
    points = np.ascontiguousarray(points, dtype=float).reshape(-1, 2)
    last = len(points) - 1
    passed = np.zeros(last + 1, dtype=np.bool_) if fixed is None else np.asarray(fixed)
    one, other = np.triu_indices(last + 1, 1)
    before = np.concatenate([[0], np.cumsum(passed)])
    # Nothing between the two has to be passed; neighbours on the path see each other anyway.
    allowed = (before[other] == before[one + 1]) | (other == one + 1)
    one, other = one[allowed], other[allowed]
    clear = field.lines_are_clear(points[one], points[other], radius + MARGIN)
    clear |= other == one + 1
    steps = np.hypot(*(points[other] - points[one]).T)
    best = np.full(last + 1, np.inf)
    best[0] = 0.0
    came = np.zeros(last + 1, dtype=np.intp)
    for here, there, step in zip(one[clear], other[clear], steps[clear], strict=True):
        if best[here] + step < best[there] - SAME:
            best[there], came[there] = best[here] + step, here
    chain = [last]
    while chain[-1] > 0:
        chain.append(int(came[chain[-1]]))
    return np.array(chain[::-1])
