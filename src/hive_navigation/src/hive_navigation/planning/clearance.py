# SPDX-License-Identifier: BSD-3-Clause
"""How far each cell of a map is from the nearest obstacle.

Planning and driving ask how much room there is at a point. The distance transform of the occupancy
grid answers for all cells at once. A robot of radius r may stand where the clearance is at least
r, so one field serves robots of every size; the "inflated map" of the ROS navigation stack is the
comparison `clearance < r`.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from hive_common.distances import distances
from hive_navigation.planning import lines
from hive_navigation.planning.lines import FAR

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

    from hive_common.geometry import Array
    from hive_common.grid_map import GridMap
    from hive_navigation.planning.lines import Cells


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
        clearance = np.empty(grid.blocked.shape, dtype=np.float32)
        for rows, cells in distances(grid.blocked, FAR / grid.resolution + 1):
            clearance[rows] = np.clip((cells - 0.5) * grid.resolution, 0.0, FAR)
        return cls(grid, clearance)

    def at(self, x: float, y: float) -> float:
        """Return the clearance at a point, frame map [m]."""
        return lines.clearance_at(self.clearance, self.scale, x, y)

    def at_points(self, points: Array) -> Array:
        """Return the clearances (n,) at points (n, 2), frame map [m]."""
        return lines.clearances_at(self.clearance, self.scale, _floats(points))

    def with_discs(self, discs: Sequence[Disc]) -> ClearanceField:
        """Return a field with more obstacles; this one does not change."""
        clearance = self.clearance.copy()
        lines.add_discs(clearance, self.scale, as_rows(discs))
        return ClearanceField(self.grid, clearance)

    def line_is_clear(self, a: tuple[float, float], b: tuple[float, float], need: float) -> bool:
        """Return whether a disc of radius `need` [m] can move straight from a to b, frame map [m].

        The answer is the same in both directions.
        """
        return lines.line_is_clear(self.clearance, self.scale, a[0], a[1], b[0], b[1], need)

    def lines_are_clear(self, a: Array, b: Array, need: float) -> NDArray[np.bool_]:
        """Return `line_is_clear` for lines from a (n, 2) to b (n, 2), as an (n,) array."""
        return lines.lines_are_clear(self.clearance, self.scale, _floats(a), _floats(b), need)

    def connects(
        self, a: tuple[float, float], b: tuple[float, float], need: float, *, corners: bool = False
    ) -> bool:
        """Return whether cells with a clearance of `need` [m] connect two places, frame map [m].

        Cells that touch at `corners` only do not count as connected unless that is said.
        """
        ends = (float(a[0]), float(a[1])), (float(b[0]), float(b[1]))
        return lines.connected(self.clearance, self.scale, need, *ends, corners)


def _floats(numbers: Array) -> Array:
    """Return numbers as compiled code takes them."""
    return np.ascontiguousarray(numbers, dtype=np.float64)
