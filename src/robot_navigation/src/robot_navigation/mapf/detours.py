# SPDX-License-Identifier: BSD-3-Clause
"""Adds the ways that a connected roadmap still misses: a second door, the other side of a rack.

Each free cell belongs to the place that is nearest to it on the map. Where the cells of two places
meet, a robot can drive from one to the other; if that is a long way round on lanes, there is a way
that no lane leads through.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from scipy import sparse
from scipy.sparse import csgraph

from robot_navigation.mapf.repair import REACH, cells, grown, taut, traced

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from hive_common.geometry import Array, Indices
    from robot_navigation.mapf.repair import Net
    from robot_navigation.planning.clearance import ClearanceField

DETOUR = 6.0
"""Lanes between places whose cells meet are at most this long [spacings]. They are at most twice
`REACH` apart on the map, so this is twice as far."""

AT_ONCE = 256  # places from which ways are sought at once, to bound memory


def open_all(net: Net, field: ClearanceField, need: float, spacing: float) -> None:
    """Add places and lanes along ways that are missing for a clearance [m].

    Args:
        net: Places and lanes that connect what the map connects; see `repair.connect_all`.
        field: The clearances of the map.
        need: The clearance of the robots in question [m].
        spacing: Distance of neighbouring places where nothing is in the way [m].
    """
    fits = np.flatnonzero(net.room >= need)
    rows, columns = cells(field, net.places[fits])
    starts = (rows * field.clearance.shape[1] + columns).astype(np.int64)
    free = field.clearance >= need
    owner, came, cost = grown(field.clearance, free, need, starts, fits)
    ones, others = _meetings(owner, cost)
    while True:
        one_places, other_places = owner.ravel()[ones], owner.ravel()[others]
        far = _are_far(net, need, one_places, other_places, DETOUR * spacing)
        ones, others = ones[far], others[far]
        if not len(ones):
            return
        way = [*reversed(traced(came, int(ones[0]))), *traced(came, int(others[0]))]
        begin, end = int(one_places[far][0]), int(other_places[far][0])
        net.add_way(begin, end, taut(field, way, need, REACH * spacing))
        ones, others = ones[1:], others[1:]


def _meetings(owner: Indices, cost: Array) -> tuple[Indices, Indices]:
    """Return the neighbouring cells at which the cells of two places meet.

    For each two places those at which the way between them is best, the best one first.
    """
    index = np.arange(owner.size).reshape(owner.shape)
    ones = np.concatenate([index[:, :-1].ravel(), index[:-1].ravel()])
    others = np.concatenate([index[:, 1:].ravel(), index[1:].ravel()])
    owners, costs = owner.ravel(), cost.ravel()
    meet = (owners[ones] >= 0) & (owners[others] >= 0) & (owners[ones] != owners[others])
    ones, others = ones[meet], others[meet]
    order = np.argsort(costs[ones] + costs[others], kind="stable")
    ones, others = ones[order], others[order]
    pairs = np.sort(np.column_stack([owners[ones], owners[others]]), axis=1)
    first = np.sort(np.unique(pairs, axis=0, return_index=True)[1])
    return ones[first], others[first]


def _are_far(
    net: Net, need: float, ones: Indices, others: Indices, most: float
) -> NDArray[np.bool_]:
    """Return which pairs of places are more than `most` [m] of lanes apart."""
    fits = net.widths >= need
    pairs = net.pairs[fits]
    lengths = np.hypot(*(net.places[pairs[:, 0]] - net.places[pairs[:, 1]]).T)
    count = len(net.places)
    lanes = sparse.csr_matrix((lengths, pairs.T), shape=(count, count))
    sources, row = np.unique(ones, return_inverse=True)
    far = np.zeros(len(ones), dtype=np.bool_)
    for begin in range(0, len(sources), AT_ONCE):
        some = sources[begin : begin + AT_ONCE]
        lengths = csgraph.dijkstra(lanes, directed=False, indices=some, limit=most)
        here = (row >= begin) & (row < begin + AT_ONCE)
        far[here] = ~np.isfinite(lengths[row[here] - begin, others[here]])
    return far
