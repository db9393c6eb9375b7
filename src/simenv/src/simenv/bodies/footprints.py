# SPDX-License-Identifier: BSD-3-Clause
"""The footprints of all robots in arrays, as compiled loops need them.

Footprints with fewer corners than others repeat their last one: the edge between it and itself has
no length, and its normal is that of the edge before, so neither beams nor clipping notice.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from collections.abc import Sequence

    from hive_common.geometry import Array, Footprint


class Footprints:
    """The footprints of n robots; row i of every array belongs to robot i.

    Attributes:
        points: (n, corners, 2) in the robots' own frames, counter-clockwise [m].
        lines: (n, corners, 3) of the edges that begin there: the outward normal, and the distance
            from the base [m].
        radii: (n,) of the circles around the bases that hold the footprints [m].
    """

    def __init__(self, footprints: Sequence[Footprint]) -> None:
        """Put the footprints into arrays."""
        corners = max((len(each.corners) for each in footprints), default=0)

        def even(arrays: Sequence[Array], width: int) -> Array:
            rows = [np.concatenate([a, a[[-1] * (corners - len(a))]]) for a in arrays]
            return np.array(rows).reshape(len(rows), corners, width)

        self.radii = np.array([each.radius for each in footprints])
        self.points = even([each.corners for each in footprints], 2)
        lines = [np.column_stack([each.normals, each.limits]) for each in footprints]
        self.lines = even(lines, 3)
