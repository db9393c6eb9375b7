# SPDX-License-Identifier: BSD-3-Clause
"""Maps as files and messages hold them, whose origin may have a yaw, made upright.

Everything that works on a map wants sides that are parallel to the axes of the frame map. So a
map that is turned is drawn anew, once, where it is read. By a right angle that is exact.
Otherwise nothing that hinders a robot gets lost: a cell takes what hinders most of what is at
nine points of it, its middle, its corners and the middles of its sides. So even a wall one cell
thick has no gap, and walls grow by at most the diagonal of a cell on each side.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from hive_common.errors import MapError
from hive_common.grid_map import OCCUPIED_FROM, ROUNDING, UNKNOWN, GridMap
from hive_common.pose import Pose, compose

if TYPE_CHECKING:
    from collections.abc import Iterator

    from numpy.typing import NDArray

MAX_DRAWN = 51_000_000
"""Maximum size of a map drawn anew [cells]: a little more than twice that of a file, which a
square needs that is turned by 45 degrees. A long, narrow map may need more."""

_DIGITS = 9  # of a yaw that count: a message holds its sine and cosine, which rounds it [rad]
_EDGE = 1e-6  # a corner this little beyond a cell is not in the next one [cells]
_POINTS = 200_000  # looked up at once, so that they stay in the processor's cache

_MILDEST_FIRST = np.concatenate(
    [np.arange(OCCUPIED_FROM), np.arange(-128, 0), np.arange(OCCUPIED_FROM, 128)]
).astype(np.int8)
"""All values of a cell by how much they hinder a robot. Unknown stands between what readers take
for free and what they take for occupied; what is no occupancy (raw maps) is just below it."""

_RANK = np.empty(256, dtype=np.uint8)  # where a value, as an unsigned byte, stands among these
_RANK[_MILDEST_FIRST.view(np.uint8)] = np.arange(256)


@dataclass(frozen=True)
class TurnedMap:
    """A map as a file or message holds it: turned about its lower left corner by any yaw.

    Attributes:
        cells: (rows, columns) of UNKNOWN, or FREE 0 to OCCUPIED 100; row 0 is the lowest.
        resolution: Side of a cell [m].
        origin: Lower left corner of cell (0, 0), frame map [m, m, rad].
    """

    cells: NDArray[np.int8]
    resolution: float
    origin: Pose

    def upright(self) -> GridMap:
        """Return the map with sides that are parallel to the axes of the frame map.

        Cells off the map are unknown. A yaw up to `ROUNDING` beside a right angle counts as one.

        Raises:
            MapError: It would have more than `MAX_DRAWN` cells.
        """
        yaw = round(math.remainder(self.origin.yaw, math.tau), _DIGITS)
        quarters = round(yaw / (math.pi / 2))
        is_straight = abs(yaw - quarters * math.pi / 2) < ROUNDING
        if is_straight:
            yaw = quarters * math.pi / 2
        rows, columns = self.cells.shape
        left, low, right, high = bounds_around(Pose(0.0, 0.0, yaw), (columns, rows))
        column, row = math.floor(left + _EDGE), math.floor(low + _EDGE)
        shape = (math.ceil(high - _EDGE) - row, math.ceil(right - _EDGE) - column)
        x, y = self.origin.x + column * self.resolution, self.origin.y + row * self.resolution
        if is_straight:
            cells = np.ascontiguousarray(np.rot90(self.cells, -quarters))
        elif shape[0] * shape[1] > MAX_DRAWN:
            raise MapError(
                f"the map is turned by {self.origin.yaw:g} rad, and takes {shape[1]} x {shape[0]} "
                f"cells with sides parallel to the axes, more than {MAX_DRAWN:,}; turn the map's "
                "image instead and set the yaw to 0, or use a coarser resolution"
            )
        else:
            cells = _drawn(self.cells, yaw, (row, column), shape)
        return GridMap(cells, self.resolution, Pose(x, y, 0.0))


def bounds_around(origin: Pose, size: tuple[float, float]) -> tuple[float, float, float, float]:
    """Return x_min, y_min, x_max, y_max around a rectangle that may be turned.

    Args:
        origin: Its lower left corner and how it is turned, in any frame.
        size: Width and height in its own frame, in the units of the origin.
    """
    corners = [compose(origin, Pose(x, y)) for x in (0.0, size[0]) for y in (0.0, size[1])]
    xs, ys = [corner.x for corner in corners], [corner.y for corner in corners]
    return min(xs), min(ys), max(xs), max(ys)


def _drawn(
    cells: NDArray[np.int8], yaw: float, first: tuple[int, int], shape: tuple[int, int]
) -> NDArray[np.int8]:
    """Return cells (rows, columns) drawn on a grid of a shape, against which they are turned.

    Args:
        cells: (rows, columns).
        yaw: By how much they are turned about the corner of their cell (0, 0) [rad].
        first: Row and column of the grid's cell (0, 0), from that corner [cells].
        shape: Rows and columns of the grid.
    """
    # A ring of unknown cells stands for everything off the map.
    ranks = np.pad(_RANK[cells.view(np.uint8)], 1, constant_values=_RANK[UNKNOWN])
    drawn = np.empty(shape, dtype=np.int8)
    for rows in _strips(shape):
        # Neighbours share the points on their sides: two a cell, and one at the end.
        ys = first[0] + np.arange(2 * rows.start, 2 * rows.stop + 1) / 2
        xs = first[1] + np.arange(2 * shape[1] + 1) / 2
        points = _looked_up(ranks, yaw, xs, ys)
        across = np.maximum(np.maximum(points[:, :-1:2], points[:, 1::2]), points[:, 2::2])
        worst = np.maximum(np.maximum(across[:-1:2], across[1::2]), across[2::2])
        drawn[rows] = _MILDEST_FIRST[worst]
    return drawn


def _strips(shape: tuple[int, int]) -> Iterator[slice]:
    """Yield the rows of each strip of a grid of a shape (rows, columns)."""
    height = max(1, _POINTS // (4 * shape[1]))
    for start in range(0, shape[0], height):
        yield slice(start, min(start + height, shape[0]))


def _looked_up(
    ranks: NDArray[np.uint8], yaw: float, xs: NDArray[np.float64], ys: NDArray[np.float64]
) -> NDArray[np.uint8]:
    """Return what a turned map, which has a ring around it, holds at points (ys, xs) [cells]."""
    cos, sin = math.cos(yaw), math.sin(yaw)
    columns = np.floor(np.add.outer(sin * ys, cos * xs)).clip(-1, ranks.shape[1] - 2)
    rows = np.floor(np.add.outer(cos * ys, -sin * xs)).clip(-1, ranks.shape[0] - 2)
    at = ((rows + 1) * ranks.shape[1] + (columns + 1)).astype(np.intp)
    found: NDArray[np.uint8] = ranks.ravel()[at]
    return found
