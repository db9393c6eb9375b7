# SPDX-License-Identifier: BSD-3-Clause
"""Adds the places that a lattice misses.

Afterwards every free point of the map reaches a place on a short straight line, and places that
free space connects are connected by lanes, for each size of robot.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from scipy import ndimage, sparse
from scipy.sparse import csgraph

from hive_navigation.mapf.lane_room import cover, line_rooms, reached
from hive_navigation.mapf.voronoi import Voronoi

if TYPE_CHECKING:
    from collections.abc import Iterator

    from hive_common.geometry import Array, Indices
    from hive_navigation.planning.clearance import ClearanceField

REACH = 1.5
"""Every free point reaches a place straight that is at most this many spacings away."""

JOINS = 24  # most lanes that a new place gets
JOINED = 2.3  # how far these lead [spacings]: as far as a knight's move


class Net:
    """Places and lanes while they are made.

    Attributes:
        places: (n, 2), frame map [m].
        room: (n,) clearances at them [m].
        pairs: (k, 2) indices of places between which there is a lane.
        widths: (k,) least clearances along the lanes [m].
    """

    def __init__(self, field: ClearanceField, spacing: float, need: float) -> None:
        """Start without places; `need` is the clearance that the smallest robot needs [m]."""
        self.places: Array = np.empty((0, 2))
        self.room: Array = np.empty(0)
        self.pairs: Indices = np.empty((0, 2), dtype=np.intp)
        self.widths: Array = np.empty(0)
        self._field = field
        self._spacing = spacing
        self._need = need

    def add(self, places: Array) -> None:
        """Add places (n, 2) without lanes."""
        self.places = np.ascontiguousarray(np.vstack([self.places, places]))
        self.room = np.concatenate([self.room, self._field.at_points(places)])

    def join(self, pairs: Indices) -> None:
        """Add lanes between pairs (k, 2) of places wherever the smallest robot fits."""
        pairs = np.asarray(pairs, dtype=np.intp).reshape(-1, 2)
        one, other = (np.ascontiguousarray(self.places[column]) for column in pairs.T)
        widths = line_rooms(self._field.clearance, self._field.scale, one, other, self._need)
        self.pairs = np.concatenate([self.pairs, pairs[widths >= 0]])
        self.widths = np.concatenate([self.widths, widths[widths >= 0]])

    def add_joined(self, places: Array) -> None:
        """Add places (n, 2), with lanes to those near them and to each other in their order."""
        added = np.arange(len(self.places), len(self.places) + len(places))
        self.add(places)
        self.join(np.column_stack([added[:-1], added[1:]]))
        self.join_around(added)

    def join_around(self, chosen: Indices) -> None:
        """Add lanes from some places to all that they see near them."""
        order = np.argsort(self.places[:, 1], kind="stable")
        found, _ = reached(
            self._field.clearance,
            self._field.scale,
            np.ascontiguousarray(self.places[chosen]),
            np.full(len(chosen), self._need),
            np.ascontiguousarray(self.places[order]),
            self.room[order],
            np.full(len(chosen), JOINED * self._spacing),
            JOINS + 1,
        )
        rows, columns = np.nonzero(found >= 0)
        near = np.column_stack([chosen[rows], order[found[rows, columns]]])
        self.join(near[near[:, 0] != near[:, 1]])

    def add_way(self, one: int, other: int, points: Array) -> None:
        """Join two places, by lanes over new places (n, 2) in between."""
        first = len(self.places)
        if not len(points):
            self.join(np.array([(one, other)]))
            return
        self.add_joined(points)
        self.join(np.array([(one, first), (len(self.places) - 1, other)]))

    def parts(self, need: float) -> Indices:
        """Return to which connected part each place belongs for a clearance [m]; -1 for none."""
        count = len(self.places)
        fits = self.widths >= need
        links = sparse.coo_matrix(
            (np.ones(int(fits.sum())), (self.pairs[fits, 0], self.pairs[fits, 1])),
            shape=(count, count),
        )
        labels: Indices = csgraph.connected_components(links, directed=False)[1].astype(np.intp)
        return np.where(self.room >= need, labels, -1)


def cover_all(net: Net, field: ClearanceField, need: float, spacing: float) -> None:
    """Add places until each cell where a robot fits reaches one straight."""
    bare = field.clearance >= need
    cover(bare, field.clearance, field.scale, need, net.places, REACH * spacing)
    rows, columns = np.nonzero(bare)
    while len(rows):
        middle = int(np.argmax(field.clearance[rows, columns]))
        places = np.array([_centre(field, rows[middle], columns[middle])])
        net.add_joined(places)
        cover(bare, field.clearance, field.scale, need, places, REACH * spacing)
        left = bare[rows, columns]
        rows, columns = rows[left], columns[left]


def connect_all(net: Net, field: ClearanceField, need: float, spacing: float) -> None:
    """Add places along ways until the lanes connect what free space connects."""
    regions, _ = ndimage.label(field.clearance >= need)
    part = net.parts(need)
    rows, columns = cells(field, net.places)
    region = np.where(part >= 0, regions[rows, columns], 0)
    both = np.unique(np.column_stack([region, part])[region > 0], axis=0)
    numbers, counts = np.unique(both[:, 0], return_counts=True)
    split = numbers[counts > 1]
    if not len(split):
        return
    sources = np.flatnonzero(np.isin(region, split))
    starts = rows[sources] * field.clearance.shape[1] + columns[sources]
    inside = np.isin(regions, split)
    del regions
    voronoi = Voronoi(field.clearance, inside, need, starts, sources)
    for (one, other), way in _bridges(voronoi, part):
        net.add_way(one, other, taut(field, way, need, REACH * spacing))


def cells(field: ClearanceField, points: Array) -> tuple[Indices, Indices]:
    """Return the rows and the columns of points (n, 2) on the map."""
    step, left, low = field.scale
    return ((points[:, 1] - low) / step).astype(np.intp), ((points[:, 0] - left) / step).astype(
        np.intp
    )


def _centre(field: ClearanceField, row: int, column: int) -> tuple[float, float]:
    """Return the middle of a cell, frame map [m]."""
    step, left, low = field.scale
    return left + (column + 0.5) * step, low + (row + 0.5) * step


def _bridges(voronoi: Voronoi, part: Indices) -> Iterator[tuple[list[int], list[int]]]:
    """Yield the cheapest ways that join all parts of a region (Kruskal's algorithm).

    Each with the two places that it joins, and the cells that it leads over.
    """
    leader = list(range(int(part.max()) + 1))

    def leads(which: int) -> int:
        while leader[which] != which:
            which = leader[which]
        return which

    met = voronoi.meetings(part)
    for (one, other), places in zip(met.cells.tolist(), met.places.tolist(), strict=True):
        a, b = (leads(int(part[place])) for place in places)
        if a != b:
            leader[a] = b
            yield places, voronoi.way(one, other)


def taut(field: ClearanceField, way: list[int], need: float, longest: float) -> Array:
    """Return the corners (n, 2) of a way over cells without its two ends, frame map [m].

    Straight stretches are at most about `longest` [m].
    """
    columns = field.clearance.shape[1]
    points = np.array([_centre(field, *divmod(cell, columns)) for cell in way])
    kept, here = [], 0
    while here < len(points) - 1:
        ahead = points[here + 1 :]
        ahead = ahead[: int(longest / field.scale[0])]
        starts = np.tile(points[here], (len(ahead), 1))
        clear = line_rooms(field.clearance, field.scale, starts, np.ascontiguousarray(ahead), need)
        here += 1 + int(np.flatnonzero(clear >= 0).max(initial=0))
        kept.append(points[here])
    return np.array(kept[:-1]).reshape(-1, 2)
