# SPDX-License-Identifier: BSD-3-Clause
"""Adds the places that a lattice misses.

Afterwards every free point of the map reaches a place on a short straight line, and places that
free space connects are connected by lanes, for each size of robot.
"""

from __future__ import annotations

import heapq
from typing import TYPE_CHECKING

import numpy as np
from scipy import ndimage, sparse
from scipy.sparse import csgraph

from hive_common.compiled import compiled
from robot_navigation.mapf.lane_room import cover, line_rooms, reached

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from hive_common.geometry import Array, Indices
    from robot_navigation.planning.clearance import ClearanceField
    from robot_navigation.planning.lines import Cells

REACH = 1.5
"""Every free point reaches a place straight that is at most this many spacings away."""

JOINS = 24  # most lanes that a new place gets
JOINED = 2.3  # how far these lead [spacings]: as far as a knight's move

NARROW = 0.3
"""Ways that join parts keep to the middle where the room beyond the need is less than this [m]."""


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
    places = net.places
    while True:
        cover(bare, field.clearance, field.scale, need, places, REACH * spacing)
        if not bare.any():
            return
        rows, columns = np.nonzero(bare)
        middle = int(np.argmax(field.clearance[rows, columns]))
        places = np.array([_centre(field, rows[middle], columns[middle])])
        net.add_joined(places)


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
    owner, came, cost = grown(
        field.clearance, np.isin(regions, split), need, starts.astype(np.int64), sources
    )
    for one, other in _bridges(owner, cost, part):
        way = [*reversed(traced(came, one)), *traced(came, other)]
        net.add_way(
            int(owner.flat[one]), int(owner.flat[other]), taut(field, way, need, REACH * spacing)
        )


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


@compiled(
    "Tuple((int64[:, ::1], int64[::1], float64[:, ::1]))(float32[:, ::1], boolean[:, ::1],"
    " float64, int64[::1], int64[::1])"
)
def grown(
    clearance: Cells, inside: NDArray[np.bool_], need: float, starts: Indices, names: Indices
) -> tuple[Indices, Indices, Array]:
    """Return whose start is nearest to each cell, from where it was reached, and at what cost.

    Ways that keep away from walls cost least. Cells are numbered row by row; -1 is none.
    """
    rows, columns = clearance.shape
    owner = np.full((rows, columns), -1, dtype=np.int64)
    came = np.full(rows * columns, -1, dtype=np.int64)
    cost = np.full((rows, columns), np.inf)
    done = np.zeros(rows * columns, dtype=np.bool_)
    queue = [(0.0, 0) for _ in range(0)]
    for start, name in zip(starts, names):  # noqa: B905  (numba has no strict)
        row, column = divmod(start, columns)
        cost[row, column], owner[row, column] = 0.0, name
        queue.append((0.0, start))
    heapq.heapify(queue)
    while len(queue) > 0:
        reached_at, cell = heapq.heappop(queue)
        if done[cell]:
            continue
        done[cell] = True
        row, column = divmod(cell, columns)
        for down, right in ((-1, 0), (1, 0), (0, -1), (0, 1)):
            there, aside = row + down, column + right
            if not (0 <= there < rows and 0 <= aside < columns) or not inside[there, aside]:
                continue
            spare = min(max(clearance[there, aside] - need, 0.0), NARROW)
            further = reached_at + 1.0 + 4.0 * (1.0 - spare / NARROW)
            if further < cost[there, aside]:
                cost[there, aside] = further
                owner[there, aside] = owner[row, column]
                came[there * columns + aside] = cell
                heapq.heappush(queue, (further, there * columns + aside))
    return owner, came, cost


def _bridges(owner: Indices, cost: Array, part: Indices) -> list[tuple[int, int]]:
    """Return the cheapest pairs of neighbouring cells at which the ways of different parts meet.

    They join all parts of a region (Kruskal's algorithm).
    """
    index = np.arange(owner.size).reshape(owner.shape)
    ones = np.concatenate([index[:, :-1].ravel(), index[:-1].ravel()])
    others = np.concatenate([index[:, 1:].ravel(), index[1:].ravel()])
    owners, costs = owner.ravel(), cost.ravel()
    known = (owners[ones] >= 0) & (owners[others] >= 0)
    ones, others = ones[known], others[known]
    apart = part[owners[ones]] != part[owners[others]]
    ones, others = ones[apart], others[apart]
    leader = list(range(int(part.max()) + 1))

    def leads(which: int) -> int:
        while leader[which] != which:
            which = leader[which]
        return which

    found = []
    for each in np.argsort(costs[ones] + costs[others], kind="stable"):
        one, other = int(ones[each]), int(others[each])
        a, b = leads(int(part[owners[one]])), leads(int(part[owners[other]]))
        if a != b:
            leader[a] = b
            found.append((one, other))
    return found


def traced(came: Indices, cell: int) -> list[int]:
    """Return the cells from one back to the start that it was reached from."""
    found = []
    while cell >= 0:
        found.append(cell)
        cell = int(came[cell])
    return found


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
