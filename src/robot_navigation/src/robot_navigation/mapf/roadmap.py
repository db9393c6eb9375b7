# SPDX-License-Identifier: BSD-3-Clause
"""The roadmap on which robots are planned jointly: places, and lanes between them."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    from hive_common.geometry import Array, Indices


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
