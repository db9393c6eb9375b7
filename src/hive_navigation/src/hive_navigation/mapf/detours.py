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

from hive_navigation.mapf.repair import REACH, cells, taut
from hive_navigation.mapf.voronoi import Voronoi

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from hive_common.geometry import Indices
    from hive_navigation.mapf.repair import Net
    from hive_navigation.planning.clearance import ClearanceField

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
    voronoi = Voronoi(field.clearance, field.clearance >= need, need, starts, fits)
    met = voronoi.meetings(np.arange(len(net.places)))
    apart = np.flatnonzero(~_are_joined(net, need, met.places))
    far = apart[_are_far(net, need, met.places[apart], DETOUR * spacing)]
    for (one, other), places in zip(met.cells[far].tolist(), met.places[far], strict=True):
        # A way that was added meanwhile may serve these two.
        if _are_far(net, need, places[None], DETOUR * spacing)[0]:
            way = taut(field, voronoi.way(one, other), need, REACH * spacing)
            net.add_way(int(places[0]), int(places[1]), way)


def _are_joined(net: Net, need: float, pairs: Indices) -> NDArray[np.bool_]:
    """Return between which pairs (k, 2) of places there is a lane."""
    count = len(net.places)
    lanes = np.sort(net.pairs[net.widths >= need], axis=1)
    joined = np.sort(pairs, axis=1)
    return np.isin(joined[:, 0] * count + joined[:, 1], lanes[:, 0] * count + lanes[:, 1])


def _are_far(net: Net, need: float, pairs: Indices, most: float) -> NDArray[np.bool_]:
    """Return which pairs (k, 2) of places are more than `most` [m] of lanes apart."""
    if not len(pairs):
        return np.zeros(0, dtype=np.bool_)
    ends = net.places[pairs].reshape(-1, 2)
    near = ((net.places >= ends.min(axis=0) - most) & (net.places <= ends.max(axis=0) + most)).all(
        1
    )
    number = np.cumsum(near) - 1
    count = int(near.sum())
    lanes = net.pairs[(net.widths >= need) & near[net.pairs].all(axis=1)]
    # Twice the same entry would count as one of twice the length.
    lanes = np.unique(np.sort(lanes, axis=1), axis=0)
    lengths = np.hypot(*(net.places[lanes[:, 0]] - net.places[lanes[:, 1]]).T)
    ways = sparse.csr_matrix((lengths, number[lanes].T), shape=(count, count))
    sources, row = np.unique(number[pairs[:, 0]], return_inverse=True)
    far = np.zeros(len(pairs), dtype=np.bool_)
    for begin in range(0, len(sources), AT_ONCE):
        some = sources[begin : begin + AT_ONCE]
        reached = csgraph.dijkstra(ways, directed=False, indices=some, limit=most)
        here = (row >= begin) & (row < begin + AT_ONCE)
        far[here] = ~np.isfinite(reached[row[here] - begin, number[pairs[here, 1]]])
    return far
