# SPDX-License-Identifier: BSD-3-Clause
"""Maps as occupancy grids, and how far each cell is from the nearest obstacle.

Planning and driving ask how much room there is at a point. The distance transform of the occupancy
grid answers for all cells at once. A robot of radius r may stand where the clearance is at least
r, so one field serves robots of every size; the "inflated map" of the ROS navigation stack is the
comparison `clearance < r`.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np
from scipy import ndimage

from hive_common.pose import Pose

if TYPE_CHECKING:
    from collections.abc import Iterable

    from numpy.typing import NDArray

    Array = NDArray[np.float64]

FAR = 3.0  # greatest clearance [m]: no robot is larger, and a disc then changes few cells
STRIDES = 12  # number of strides that settle most lines
TINY = 1e-9  # a shorter line has no direction [m]


ORIGIN = Pose(0.0, 0.0, 0.0)

FREE = 0
OCCUPIED = 100
UNKNOWN = -1


@dataclass(frozen=True)
class GridMap:
    """An occupancy grid: what robots know of a world.

    Attributes:
        cells: (rows, columns) of UNKNOWN, or FREE 0 to OCCUPIED 100; row 0 is the lowest y.
        resolution: Side of a cell [m].
        origin: Lower left corner of cell (0, 0), frame map [m, m, rad].
    """

    cells: NDArray[np.int8]
    resolution: float
    origin: Pose = ORIGIN

    @classmethod
    def of_blocked(
        cls, blocked: NDArray[np.bool_], resolution: float, origin: Pose = ORIGIN
    ) -> GridMap:
        """Return a map whose cells are occupied where `blocked` (rows, columns), else free."""
        return cls(np.where(blocked, OCCUPIED, FREE).astype(np.int8), resolution, origin)

    @cached_property
    def blocked(self) -> NDArray[np.bool_]:
        """(rows, columns): True where a cell is not known to be free."""
        blocked: NDArray[np.bool_] = self.cells != FREE
        return blocked

    @property
    def bounds(self) -> tuple[float, float, float, float]:
        """x_min, y_min, x_max, y_max, frame map [m]."""
        rows, columns = self.cells.shape
        x, y, _ = self.origin
        return x, y, x + columns * self.resolution, y + rows * self.resolution

    def contains(self, x: float, y: float) -> bool:
        """Return whether a point [m], frame map, lies on the map."""
        x_min, y_min, x_max, y_max = self.bounds
        return x_min <= x < x_max and y_min <= y < y_max

    def cell(self, point: Pose | tuple[float, float]) -> tuple[int, int] | None:
        """Return the (row, column) of a point [m], frame map, or None outside the map."""
        row = math.floor((point[1] - self.origin.y) / self.resolution)
        column = math.floor((point[0] - self.origin.x) / self.resolution)
        rows, columns = self.cells.shape
        return (row, column) if 0 <= row < rows and 0 <= column < columns else None

    def decided(self, free: int, occupied: int) -> GridMap:
        """Return the map with free, occupied and unknown cells only.

        Cells up to `free` are free, cells from `occupied` on are occupied [0..100].
        """
        cells = np.full(self.cells.shape, UNKNOWN, dtype=np.int8)
        cells[(self.cells != UNKNOWN) & (self.cells <= free)] = FREE
        cells[self.cells >= occupied] = OCCUPIED
        return GridMap(cells, self.resolution, self.origin)


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


class ClearanceField:
    """The distance of every cell of a map to the nearest obstacle.

    Points off the map have clearance 0, so robots never leave it.

    Attributes:
        grid: The map.
        clearance: (rows, columns) array [m], from a cell's centre to the edge of the nearest
            blocked cell, at most `FAR`.
    """

    def __init__(self, grid: GridMap, clearance: NDArray[np.float32]) -> None:
        self.grid = grid
        self.clearance = clearance
        # Single look-ups in a list are five times faster than in an array, but the list is eight
        # times the size. A flat memoryview is nearly as quick and needs no copy.
        self._cells = np.ascontiguousarray(clearance).reshape(-1).data

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
        grid = self.grid
        rows, columns = grid.cells.shape
        column = int((x - grid.origin[0]) // grid.resolution)
        row = int((y - grid.origin[1]) // grid.resolution)
        if 0 <= row < rows and 0 <= column < columns:
            return self._cells[row * columns + column]
        return 0.0

    def at_points(self, points: Array) -> Array:
        """Return the clearances (n,) at points (n, 2), frame map [m]."""
        grid = self.grid
        rows, columns = grid.cells.shape
        cells = np.floor((points - np.asarray(grid.origin[:2])) / grid.resolution).astype(np.intp)
        column, row = cells[:, 0], cells[:, 1]
        inside = (row >= 0) & (row < rows) & (column >= 0) & (column < columns)
        values = np.zeros(len(points))
        values[inside] = self.clearance[row[inside], column[inside]]
        return values

    def with_discs(self, discs: Iterable[Disc]) -> ClearanceField:
        """Return a field with more obstacles; this one does not change."""
        clearance = self.clearance.copy()
        for disc in discs:
            self._add(clearance, disc)
        return ClearanceField(self.grid, clearance)

    def _add(self, clearance: NDArray[np.float32], disc: Disc) -> None:
        """Lower the clearances around a disc, in place."""
        grid = self.grid
        reach = disc.radius + FAR
        rows, columns = grid.cells.shape
        step = grid.resolution
        left = max(0, math.floor((disc.x - reach - grid.origin[0]) / step))
        right = min(columns, math.ceil((disc.x + reach - grid.origin[0]) / step))
        low = max(0, math.floor((disc.y - reach - grid.origin[1]) / step))
        high = min(rows, math.ceil((disc.y + reach - grid.origin[1]) / step))
        if left >= right or low >= high:
            return
        xs = grid.origin[0] + (np.arange(left, right) + 0.5) * step - disc.x
        ys = grid.origin[1] + (np.arange(low, high) + 0.5) * step - disc.y
        distance = np.maximum(np.hypot(xs[None, :], ys[:, None]) - disc.radius, 0.0)
        patch = clearance[low:high, left:right]
        np.minimum(patch, distance.astype(np.float32), out=patch)

    def line_is_clear(self, a: tuple[float, float], b: tuple[float, float], need: float) -> bool:
        """Return whether a disc of radius `need` [m] can move straight from a to b, frame map [m].

        The answer is the same in both directions and from `lines_are_clear`.
        """
        if self.at(*a) < need or self.at(*b) < need:
            return False
        (x, y), end = sorted((a, b))
        length = math.hypot(end[0] - x, end[1] - y)
        step = self.grid.resolution
        dx, dy = (end[0] - x) / max(length, TINY), (end[1] - y) / max(length, TINY)
        gone, strides = 0.0, 0
        while gone < length:
            room = self.at(x + gone * dx, y + gone * dy) - need
            if room < 0:
                return False
            strides += 1
            gone += max(step, room - step) if strides <= STRIDES else step
        return True

    def lines_are_clear(self, a: Array, b: Array, need: float) -> NDArray[np.bool_]:
        """Return `line_is_clear` for lines from a (n, 2) to b (n, 2), as an (n,) array."""
        clear = (self.at_points(a) >= need) & (self.at_points(b) >= need)
        turned = (a[:, 0] > b[:, 0]) | ((a[:, 0] == b[:, 0]) & (a[:, 1] > b[:, 1]))
        begin = np.where(turned[:, None], b, a)
        line = np.where(turned[:, None], a, b) - begin
        length = np.hypot(line[:, 0], line[:, 1])
        direction = line / np.maximum(length, TINY)[:, None]
        going = np.flatnonzero(clear)
        gone = np.zeros(len(going))
        step = self.grid.resolution
        for _ in range(STRIDES):
            # The clearance changes by at most 1 m per metre, plus the rounding to cells.
            room = self.at_points(begin[going] + gone[:, None] * direction[going]) - need
            clear[going[room < 0]] = False
            gone += np.maximum(step, room - step)
            on = (room >= 0) & (gone < length[going])
            going, gone = going[on], gone[on]
        # The remaining lines run along walls, where strides are short: check every cell instead.
        for part in np.array_split(np.arange(len(going)), 1 + len(going) // 200):
            lines, done = going[part], gone[part]
            counts = np.ceil((length[lines] - done) / step).astype(np.intp)
            number = np.arange(counts.sum()) - np.repeat(np.cumsum(counts) - counts, counts)
            which = np.repeat(lines, counts)
            along = np.repeat(done, counts) + number * step
            hit = self.at_points(begin[which] + along[:, None] * direction[which]) < need
            clear[which[hit]] = False
        return clear
