# SPDX-License-Identifier: BSD-3-Clause
"""How far the cells of a map are from the nearest blocked one, strip by strip.

scipy's distance transform takes 50 bytes a cell while it works. Nobody asks for distances beyond
a few metres, so a few rows beyond both sides of a strip are enough to get it right, and a map of
any size takes the memory of one strip.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from scipy import ndimage

if TYPE_CHECKING:
    from collections.abc import Iterator

    from numpy.typing import NDArray

CELLS = 2_000_000  # in a strip, at least; a map that is smaller is one strip


def strips(blocked: NDArray[np.bool_], reach: float) -> Iterator[tuple[slice, slice]]:
    """Yield the rows of each strip of a map, and these with the rows within a reach of them.

    Args:
        blocked: (rows, columns).
        reach: How far from a strip other cells matter to it [cells].
    """
    rows, columns = blocked.shape
    beyond = int(reach) + 1
    height = max(CELLS // max(columns, 1), 2 * beyond)
    for first in range(0, rows, height):
        last = min(first + height, rows)
        yield slice(first, last), slice(max(0, first - beyond), min(rows, last + beyond))


def distances(
    blocked: NDArray[np.bool_], reach: float, *, walled: bool = True
) -> Iterator[tuple[slice, NDArray[np.float64]]]:
    """Yield the rows of each strip of a map, and how far its cells are from blocked ones.

    Args:
        blocked: (rows, columns).
        reach: The greatest distance that matters [cells].
        walled: Whether the cells around the map count as blocked.

    Yields:
        The rows, and the distances between the middles of cells (rows, columns) [cells]: right up
        to the reach; anything beyond it stands for more.
    """
    height, columns = blocked.shape
    side = int(walled)
    for rows, around in strips(blocked, reach):
        above = int(walled and around.start == 0)
        below = int(walled and around.stop == height)
        free = np.pad(~blocked[around], ((above, below), (side, side)))
        if free.all():
            yield rows, np.full((rows.stop - rows.start, columns), np.inf)
        else:
            first = above + rows.start - around.start
            found = ndimage.distance_transform_edt(free)
            yield rows, found[first : first + rows.stop - rows.start, side : side + columns]
