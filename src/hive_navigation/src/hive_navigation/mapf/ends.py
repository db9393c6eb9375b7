# SPDX-License-Identifier: BSD-3-Clause
"""Joins robots and their goals to a roadmap, so that they start and end exactly where they are.

Goals are any points of the map. Each becomes a place of its own, with lanes to the places around
it. That takes a few milliseconds for a fleet, so it is done for every plan.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from hive_navigation.mapf.lane_room import line_rooms, reached, roomy
from hive_navigation.mapf.roadmap import MARGIN, assembled
from hive_navigation.mapf.zones import with_zones

if TYPE_CHECKING:
    from collections.abc import Collection, Sequence

    from numpy.typing import NDArray

    from hive_common.geometry import Array, Indices
    from hive_navigation.mapf.roadmap import Limit, Roadmap
    from hive_navigation.planning.clearance import ClearanceField

REACH = 2.3  # how far an end's lanes lead [spacings]: as far as a knight's move
JOINS = 20  # most lanes to and from one end
DIRECT = 4.0  # greatest length of a lane from a robot right to its goal [spacings]
SAME = 0.01  # an end this near to a place is that place [m]

ESCAPE = 0.6
"""How far a robot that stands too close to an obstacle looks for room, as one that plans alone
does [m]."""


@dataclass(frozen=True)
class Ends:
    """Places of one plan beside those of its roadmap, and the legs that join them to it.

    Attributes:
        points: (e, 2) where they are, frame map [m]; the first has the index behind the roadmap's
            last place.
        index: (k,) the index of each point that was to be joined; an end or a place.
        legs: (x, 2) straight lanes from and to ends, indices of places, in the order of `from`.
        lengths: (x,) [m]
        widths: (x,) least clearance along each [m].
        speeds: (x,) highest speed on each [m/s].
        may_park: (e,) whether an idle robot may stay there for long.
        limits: Those of the roadmap, with the ends and legs that they concern: indices of places,
            and of legs.
    """

    points: Array
    index: Indices
    legs: Indices
    lengths: Array
    widths: Array
    speeds: Array
    may_park: NDArray[np.bool_]
    limits: tuple[Limit, ...] = ()


NO_ENDS = Ends(
    np.empty((0, 2)),
    np.empty(0, dtype=np.intp),
    np.empty((0, 2), dtype=np.intp),
    np.empty(0),
    np.empty(0),
    np.empty(0),
    np.empty(0, dtype=np.bool_),
)


def joined_ends(
    roadmap: Roadmap,
    field: ClearanceField,
    points: Array,
    radii: Array,
    direct: Sequence[tuple[int, int]] = (),
    apart: Collection[int] = (),
    begins: Collection[int] | None = None,
) -> Ends:
    """Return points as further places of a roadmap, and the legs that join them to it.

    A point that lies on a place where its robot fits is that place. A point from which no place
    can be reached has no leg. A robot that stands too close to an obstacle may leave on legs that
    keep no clearance at their end; `widths` then says what the robot needs.

    Args:
        roadmap: One without ends.
        field: The clearances of the map.
        points: (k, 2) starts and goals, frame map [m].
        radii: (k,) radius of the robot that starts or ends there [m].
        direct: Rows of `points`, start and goal of one robot, joined if they see each other.
        apart: Rows of `points` that are ends of their own even if they lie on a place.
        begins: Rows of `points` at which robots begin: legs only lead away from them, and only
            to the others. None for legs in both directions.
    """
    points = np.ascontiguousarray(points, dtype=float).reshape(-1, 2)
    needs = np.asarray(radii, dtype=float) + MARGIN
    freed = roomy(field.clearance, field.scale, points, needs, ESCAPE)
    found, widths = _near(roadmap, field, freed, needs, JOINS)
    nearest = np.where(found[:, 0] >= 0, found[:, 0], 0)
    away = np.hypot(*(roadmap.places[nearest] - points).T)
    on_place = (found[:, 0] >= 0) & (away <= SAME)
    alone = np.isin(np.arange(len(points)), list(apart))
    found[on_place & alone, 0] = -1
    same = on_place & ~alone
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
    zoned = with_zones(ends, roadmap.zones, roadmap.closed)
    count = len(roadmap.places)
    used = zoned.lengths > SAME
    if begins is not None:
        starts = np.isin(zoned.lanes, index[list(begins)]) & (zoned.lanes >= count)
        used &= ~starts[:, 1] & (starts[:, 0] | (zoned.lanes[:, 0] < count))
    return Ends(
        points=zoned.places[count:],
        index=index,
        legs=zoned.lanes[used],
        lengths=zoned.lengths[used],
        widths=zoned.widths[used],
        speeds=zoned.speeds[used],
        may_park=zoned.may_park[count:],
        limits=tuple(
            replace(
                each,
                places=each.places[each.places >= count],
                lanes=(np.cumsum(used) - 1)[each.lanes[used[each.lanes]]],
            )
            for each in zoned.limits
        ),
    )


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
