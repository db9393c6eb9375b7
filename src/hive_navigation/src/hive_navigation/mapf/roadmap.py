# SPDX-License-Identifier: BSD-3-Clause
"""The roadmap on which robots are planned jointly: places, and lanes between them.

`roadmap_builder` makes it from a map; `ends` joins robots and their goals to it; `zones` says what
an operator forbids on it.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from hive_common.geometry import Array, Indices
    from hive_common.zone import Zone

MARGIN = 0.02
"""Clearance that a robot needs beyond its radius [m], as the planner of one robot allows it."""


@dataclass(frozen=True)
class Limit:
    """How many robots may be in a part of the roadmap at once.

    Attributes:
        name: Of the zone that says so.
        places: (k,) array, indices of the places in it.
        lanes: (l,) array, indices of the lanes that lead through it.
        robots: The greatest number of robots.
    """

    name: str
    places: Indices
    lanes: Indices
    robots: int


@dataclass(frozen=True)
class Roadmap:
    """A directed graph whose nodes are places and whose edges are straight lanes.

    Attributes:
        places: (n, 2) array, frame map [m].
        room: (n,) array, clearance at each place [m]: which robots can turn there.
        lanes: (m, 2) array of place indices, from and to, in the order of `from`.
        begins: (n + 1,) array: the lanes from place i are `lanes[begins[i]:begins[i + 1]]`.
        lengths: (m,) array [m].
        widths: (m,) array, least clearance along each lane [m]: which robots fit.
        speeds: (m,) array, highest speed on each lane [m/s]; infinite where nothing limits it.
        may_stop: (n,) array, whether a robot may stand at a place.
        may_park: (n,) array, whether an idle robot may stay at a place for long.
        spacing: Distance of neighbouring places where nothing is in the way [m].
        limits: How many robots may be where.
        zones: What an operator has set, open and closed ones.
        closed: The names of the closed ones.
        unzoned: The same places without any zone, if there are zones.
    """

    places: Array
    room: Array
    lanes: Indices
    begins: Indices
    lengths: Array
    widths: Array
    speeds: Array
    may_stop: NDArray[np.bool_]
    may_park: NDArray[np.bool_]
    spacing: float = 1.0
    limits: tuple[Limit, ...] = ()
    zones: tuple[Zone, ...] = ()
    closed: frozenset[str] = frozenset()
    unzoned: Roadmap | None = None


def need(radius: float) -> float:
    """Return the clearance that a robot of a radius [m] needs at a place and along a lane [m].

    A robot fits where `room` and `widths` are at least this.
    """
    return radius + MARGIN


def assembled(
    places: Array, room: Array, pairs: Indices, widths: Array, spacing: float
) -> Roadmap:
    """Return a roadmap with a lane in both directions between each pair of places.

    Args:
        places: (n, 2), frame map [m].
        room: (n,) clearances at them [m].
        pairs: (k, 2) indices of places, each pair once.
        widths: (k,) least clearances between them [m].
        spacing: See `Roadmap`.
    """
    lanes = np.concatenate([pairs, pairs[:, ::-1]]).reshape(-1, 2)
    order = np.lexsort((lanes[:, 1], lanes[:, 0]))
    lanes = np.ascontiguousarray(lanes[order])
    steps = places[lanes[:, 1]] - places[lanes[:, 0]]
    count = len(places)
    return Roadmap(
        places=np.ascontiguousarray(places),
        room=room,
        lanes=lanes,
        begins=np.searchsorted(lanes[:, 0], np.arange(count + 1)),
        lengths=np.hypot(steps[:, 0], steps[:, 1]),
        widths=np.concatenate([widths, widths])[order],
        speeds=np.full(len(lanes), np.inf),
        may_stop=np.ones(count, dtype=np.bool_),
        may_park=np.zeros(count, dtype=np.bool_),
        spacing=spacing,
    )
