# SPDX-License-Identifier: BSD-3-Clause
"""Makes a roadmap of a grid: a place for each free cell, unit lanes to its four neighbours."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from hive_lab.mapf.grid_paths import neighbours
from hive_navigation.mapf.roadmap import Roadmap

if TYPE_CHECKING:
    from hive_common.geometry import Indices
    from hive_lab.mapf.grid_file import Grid


def roadmap_of(grid: Grid, parking: Indices | None = None) -> Roadmap:
    """Return the roadmap of a grid; a place's index is its cell's number, a cell's side is 1 m.

    Args:
        grid: The free cells.
        parking: Cells where an idle robot may stay; all if None.
    """
    graph = neighbours(grid)
    graph.sort_indices()
    count, lanes = len(grid.cells), graph.nnz
    begins = graph.indptr.astype(np.intp)
    origins = np.repeat(np.arange(count), np.diff(begins))
    may_park = np.ones(count, dtype=np.bool_)
    if parking is not None:
        may_park[:] = False
        may_park[parking] = True
    return Roadmap(
        places=grid.cells.astype(np.float64),
        room=np.full(count, np.inf),
        lanes=np.column_stack([origins, graph.indices]).astype(np.intp),
        begins=begins,
        lengths=np.ones(lanes),
        widths=np.full(lanes, np.inf),
        speeds=np.full(lanes, np.inf),
        may_stop=np.ones(count, dtype=np.bool_),
        may_park=may_park,
    )
