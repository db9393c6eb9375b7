# SPDX-License-Identifier: BSD-3-Clause
"""Makes the roadmap of a map for the sizes of a fleet, without manual work.

It is a lattice (`lattice.py`) with lanes to up to 16 neighbours wherever the smallest robot fits,
and what is missing (`repair.py`, `detours.py`). All sizes share it: `room` and `widths` tell who
fits where.
"""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np
from scipy import spatial

from hive_common.zone import PARKING, inside
from hive_navigation.mapf.detours import open_all
from hive_navigation.mapf.lattice import COMFORT, CROWDED, GAP, fitted, roomier
from hive_navigation.mapf.parking import may_park
from hive_navigation.mapf.repair import Net, connect_all, cover_all
from hive_navigation.mapf.roadmap import assembled, need
from hive_navigation.mapf.zones import with_zones

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from hive_common.geometry import Array, Indices
    from hive_common.zone import Zone
    from hive_navigation.mapf.lattice import Lattice
    from hive_navigation.mapf.roadmap import Roadmap
    from hive_navigation.planning.clearance import ClearanceField

SHIFTED = 0.2
"""A place that is off its lattice by more than this share of the spacing gets lanes all around."""

TINY = 1e-9  # distances closer than this are equal [m]


def build_roadmap(
    field: ClearanceField,
    radii: Sequence[float],
    zones: Sequence[Zone] = (),
    progress: Callable[[], None] = lambda: None,
) -> Roadmap:
    """Return the roadmap of a map, in about a second for a million cells.

    The same map and radii give the same roadmap.

    Args:
        field: The clearances of the map.
        radii: Of the circles around the robots' footprints [m]; at least one.
        zones: What the operator has set. Those that are `closed` are closed.
        progress: Called after each step of the work, every second or so on a large map.
    """
    least = need(min(radii))
    lattice = fitted(field, min(radii), least)
    progress()
    net = Net(field, lattice.spacing, least)
    _lay(net, field, lattice, radii)
    progress()
    for zone in zones:
        if zone.kind == PARKING:
            _add_parking(net, field, zone, least)
    for clearance in sorted({need(radius) for radius in radii}, reverse=True):
        for amend in (cover_all, connect_all, open_all):
            amend(net, field, clearance, lattice.spacing)
            progress()
    pairs, first = np.unique(np.sort(net.pairs, axis=1), axis=0, return_index=True)
    roadmap = assembled(net.places, net.room, pairs, net.widths[first], lattice.spacing)
    parking = may_park(field, roadmap.places, max(radii))
    return with_zones(replace(roadmap, may_park=parking), zones)


def _lay(net: Net, field: ClearanceField, lattice: Lattice, radii: Sequence[float]) -> None:
    """Add the lattice's places and lanes."""
    least, apart = need(min(radii)), 2 * min(radii) + GAP
    points = lattice.points()
    enough = need(max(radii)) + COMFORT
    moved = roomier(field.clearance, field.scale, points, least, enough, lattice.spacing)
    free = field.at_points(points) >= least
    # Two lanes beside each other stay two lanes.
    close = _in_sight(field, moved, apart - TINY, least)
    back = np.unique(close[free[close].all(axis=1)])
    moved[back] = points[back]
    keep = field.at_points(moved) >= least
    rank = np.lexsort((-field.at_points(moved), ~free))
    order = np.argsort(rank)
    for one, other in _in_sight(field, moved, CROWDED * lattice.spacing, least):
        first, second = sorted((one, other), key=order.__getitem__)
        if keep[first] and not free[second]:
            keep[second] = False
    number = np.where(keep, np.cumsum(keep) - 1, -1)
    net.add(moved[keep])
    pairs = number[lattice.pairs()]
    net.join(pairs[(pairs >= 0).all(axis=1)])
    shifted = np.hypot(*(moved - points).T) > SHIFTED * lattice.spacing
    net.join_around(number[keep & shifted])


def _add_parking(net: Net, field: ClearanceField, zone: Zone, least: float) -> None:
    """Add a place to a parking zone that has none, where it has most room."""
    corners = np.array(zone.corners, dtype=float)
    step, left, low = field.scale
    if inside(corners, net.places).any():
        return
    first, last = (
        np.floor((ends - (left, low)) / step).astype(int).clip(0)
        for ends in (corners.min(0), corners.max(0))
    )
    near = field.clearance[first[1] : last[1] + 1, first[0] : last[0] + 1]
    rows, columns = np.nonzero(near >= least)
    cells = np.column_stack(
        [left + (columns + first[0] + 0.5) * step, low + (rows + first[1] + 0.5) * step]
    )
    here = np.flatnonzero(inside(corners, cells))
    if len(here):
        roomiest = here[np.argmax(near[rows[here], columns[here]])]
        net.add_joined(cells[[roomiest]])


def _in_sight(field: ClearanceField, points: Array, apart: float, least: float) -> Indices:
    """Return the pairs (k, 2) of points that see each other and are nearer than `apart` [m]."""
    pairs = spatial.cKDTree(points).query_pairs(apart, output_type="ndarray")
    pairs = pairs[np.lexsort((pairs[:, 1], pairs[:, 0]))]
    found: Indices = pairs[field.lines_are_clear(points[pairs[:, 0]], points[pairs[:, 1]], least)]
    return found
