# SPDX-License-Identifier: BSD-3-Clause
"""How far each cell of a map is from the nearest obstacle.

Planning and driving ask how much room there is at a point. The distance transform of the occupancy
grid answers for all cells at once. A robot of radius r may stand where the clearance is at least
r, so one field serves robots of every size; the "inflated map" of the ROS navigation stack is the
comparison `clearance < r`.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from scipy import ndimage

from hive_common.compiled import compiled

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

    from hive_common.geometry import Array
    from hive_common.grid_map import GridMap

    Cells = NDArray[np.float32]

FAR = 3.0  # greatest clearance [m]: no robot is larger, and a disc then changes few cells
STRIDES = 12  # number of strides that settle most lines
TINY = 1e-9  # a shorter line has no direction [m]


@dataclass(frozen=True)
class Disc:
    """A round obstacle that is not on the map: another robot, or something the laser saw.

    Attributes:
        x, y: Its centre, frame map [m].
        radius: [m]
    """

    x: float
    y: float
    radius: float


def as_rows(discs: Sequence[Disc]) -> Array:
    """Return discs as an array (n, 3) of x, y, radius [m]."""
    return np.array([(disc.x, disc.y, disc.radius) for disc in discs]).reshape(-1, 3)


class ClearanceField:
    """The distance of every cell of a map to the nearest obstacle.

    Points off the map have clearance 0, so robots never leave it.

    Attributes:
        grid: The map.
        clearance: (rows, columns) array [m], from a cell's centre to the edge of the nearest
            blocked cell, at most `FAR`.
        scale: The map's resolution, and x and y of its origin [m], as compiled code takes them.
    """

    def __init__(self, grid: GridMap, clearance: Cells) -> None:
        self.grid = grid
        self.clearance = np.ascontiguousarray(clearance)
        self.scale = (float(grid.resolution), float(grid.origin[0]), float(grid.origin[1]))

    @classmethod
    def of(cls, grid: GridMap) -> ClearanceField:
        """Compute the field of a map, about 0.1 s for a million cells."""
        # The padding makes the map's edge a wall.
        free = np.pad(~grid.blocked, 1)
        cells = ndimage.distance_transform_edt(free)[1:-1, 1:-1]
        metres = np.clip((cells - 0.5) * grid.resolution, 0.0, FAR)
        return cls(grid, metres.astype(np.float32))

    def at(self, x: float, y: float) -> float:
        """Return the clearance at a point, frame map [m]."""
        return _at(self.clearance, self.scale, x, y)

    def at_points(self, points: Array) -> Array:
        """Return the clearances (n,) at points (n, 2), frame map [m]."""
        return _at_points(self.clearance, self.scale, _floats(points))

    def with_discs(self, discs: Sequence[Disc]) -> ClearanceField:
        """Return a field with more obstacles; this one does not change."""
        clearance = self.clearance.copy()
        _add_discs(clearance, self.scale, as_rows(discs))
        return ClearanceField(self.grid, clearance)

    def line_is_clear(self, a: tuple[float, float], b: tuple[float, float], need: float) -> bool:
        """Return whether a disc of radius `need` [m] can move straight from a to b, frame map [m].

        The answer is the same in both directions.
        """
        return _line_is_clear(self.clearance, self.scale, a[0], a[1], b[0], b[1], need)

    def lines_are_clear(self, a: Array, b: Array, need: float) -> NDArray[np.bool_]:
        """Return `line_is_clear` for lines from a (n, 2) to b (n, 2), as an (n,) array."""
        return _lines_are_clear(self.clearance, self.scale, _floats(a), _floats(b), need)


def _floats(numbers: Array) -> Array:
    """Return numbers as compiled code takes them."""
    return np.ascontiguousarray(numbers, dtype=np.float64)


@compiled("float64(float32[:, ::1], UniTuple(float64, 3), float64, float64)")
def _at(clearance: Cells, scale: tuple[float, float, float], x: float, y: float) -> float:
    step, left, low = scale
    across, up = (x - left) / step, (y - low) / step
    # Comparing first keeps NaN and what is too large for an integer out.
    if not (0 <= across < clearance.shape[1] and 0 <= up < clearance.shape[0]):
        return 0.0
    return clearance[int(up), int(across)]


@compiled("float64[::1](float32[:, ::1], UniTuple(float64, 3), float64[:, ::1])")
def _at_points(clearance: Cells, scale: tuple[float, float, float], points: Array) -> Array:
    found = np.empty(len(points))
    for index in range(len(points)):
        found[index] = _at(clearance, scale, points[index, 0], points[index, 1])
    return found


@compiled("void(float32[:, ::1], UniTuple(float64, 3), float64[:, ::1])")
def _add_discs(clearance: Cells, scale: tuple[float, float, float], discs: Array) -> None:
    """Lower the clearances around discs, in place."""
    step, left, low = scale
    rows, columns = clearance.shape
    for disc in range(len(discs)):
        x, y, radius = discs[disc]
        reach = radius + FAR
        first = max(0, math.floor((x - reach - left) / step))
        last = min(columns, math.ceil((x + reach - left) / step))
        for row in range(
            max(0, math.floor((y - reach - low) / step)),
            min(rows, math.ceil((y + reach - low) / step)),
        ):
            up = low + (row + 0.5) * step - y
            for column in range(first, last):
                across = left + (column + 0.5) * step - x
                room = np.float32(max(math.sqrt(across * across + up * up) - radius, 0.0))
                clearance[row, column] = min(clearance[row, column], room)


@compiled(
    "boolean(float32[:, ::1], UniTuple(float64, 3), float64, float64, float64, float64, float64)"
)
def _line_is_clear(
    clearance: Cells,
    scale: tuple[float, float, float],
    ax: float,
    ay: float,
    bx: float,
    by: float,
    need: float,
) -> bool:
    if _at(clearance, scale, ax, ay) < need or _at(clearance, scale, bx, by) < need:
        return False
    if (ax, ay) > (bx, by):
        ax, ay, bx, by = bx, by, ax, ay
    length = math.hypot(bx - ax, by - ay)
    dx, dy = (bx - ax) / max(length, TINY), (by - ay) / max(length, TINY)
    step = scale[0]
    gone, strides = 0.0, 0
    while gone < length:
        room = _at(clearance, scale, ax + gone * dx, ay + gone * dy) - need
        if room < 0:
            return False
        # The clearance changes by at most 1 m per metre, plus the rounding to cells. Lines along
        # walls, where strides are short, are checked in every cell instead.
        strides += 1
        gone += max(step, room - step) if strides <= STRIDES else step
    return True


@compiled(
    "boolean[::1](float32[:, ::1], UniTuple(float64, 3), float64[:, ::1], float64[:, ::1], float64)"
)
def _lines_are_clear(
    clearance: Cells, scale: tuple[float, float, float], a: Array, b: Array, need: float
) -> NDArray[np.bool_]:
    clear = np.empty(len(a), dtype=np.bool_)
    for line in range(len(a)):
        clear[line] = _line_is_clear(
            clearance, scale, a[line, 0], a[line, 1], b[line, 0], b[line, 1], need
        )
    return clear
