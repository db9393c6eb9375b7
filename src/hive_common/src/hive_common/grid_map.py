# SPDX-License-Identifier: BSD-3-Clause
"""Maps as occupancy grids."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

from hive_common.errors import MapError
from hive_common.pose import Pose

if TYPE_CHECKING:
    from numpy.typing import NDArray

ORIGIN = Pose(0.0, 0.0, 0.0)

FREE = 0
OCCUPIED = 100
UNKNOWN = -1

OCCUPIED_FROM = 50  # cells at least this occupied [%] are blocked, and so are unknown ones

ROUNDING = 1e-4  # a yaw this small is none: 1 cm on a map of 100 m [rad]


def is_turned(origin: Pose) -> bool:
    """Return whether a map with an origin, frame map, is turned by more than rounding [rad]."""
    return not abs(math.remainder(origin.yaw, math.tau)) < ROUNDING


@dataclass(frozen=True)
class GridMap:
    """An occupancy grid: what robots know of a world.

    Its sides are parallel to the axes of the frame map; see `turned_map` for maps that are turned.

    Attributes:
        cells: (rows, columns) of UNKNOWN, or FREE 0 to OCCUPIED 100; row 0 is the lowest y.
        resolution: Side of a cell [m].
        origin: Lower left corner of cell (0, 0), frame map [m, m, rad]; its yaw is 0.

    Raises:
        MapError: The yaw of the origin is not 0.
    """

    cells: NDArray[np.int8]
    resolution: float
    origin: Pose = ORIGIN

    def __post_init__(self) -> None:
        if is_turned(self.origin):
            raise MapError(
                f"the map's origin has a yaw of {self.origin.yaw:g} rad; allowed: 0; make "
                "it upright first, as load_map and map_from_msg do"
            )

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
        if not self.contains(point[0], point[1]):
            return None  # nor do NaN and infinity have a cell
        row = math.floor((point[1] - self.origin.y) / self.resolution)
        column = math.floor((point[0] - self.origin.x) / self.resolution)
        rows, columns = self.cells.shape
        return (row, column) if 0 <= row < rows and 0 <= column < columns else None

    def refusal(self, point: Pose | tuple[float, float]) -> str:
        """Say why no robot can stand at a point [m], frame map; empty if one can."""
        cell = self.cell(point)
        if cell is None:
            x_min, y_min, x_max, y_max = self.bounds
            return (
                f"is outside the map, which reaches from ({x_min:.2f}, {y_min:.2f}) to "
                f"({x_max:.2f}, {y_max:.2f}) m"
            )
        if self.blocked[cell]:
            return "is inside a wall or in unknown space; choose a free place of the map"
        return ""

    def free_or_blocked(self) -> GridMap:
        """Return the map with blocked and free cells only; what is not known is blocked."""
        blocked = (self.cells < 0) | (self.cells >= OCCUPIED_FROM)
        return GridMap.of_blocked(blocked, self.resolution, self.origin)

    def decided(self, free: int, occupied: int) -> GridMap:
        """Return the map with free, occupied and unknown cells only.

        Cells up to `free` are free, cells from `occupied` on are occupied [0..100].
        """
        cells = np.full(self.cells.shape, UNKNOWN, dtype=np.int8)
        cells[(self.cells != UNKNOWN) & (self.cells <= free)] = FREE
        cells[self.cells >= occupied] = OCCUPIED
        return GridMap(cells, self.resolution, self.origin)
