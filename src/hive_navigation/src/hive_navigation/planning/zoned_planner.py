# SPDX-License-Identifier: BSD-3-Clause
"""Plans around zones that no robot may enter, where no traffic planner does it.

The traffic planner's routes obey all zones. A robot that has none plans its own path; closed and
keep-out zones are obstacles for it then, whatever else zones ask for.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from hive_common.grid_map import GridMap
from hive_common.zone import inside, keeping_out
from hive_navigation.planning.ompl_planner import OmplPlanner
from hive_navigation.planning.planner import PlanError

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Sequence

    from numpy.typing import NDArray

    from hive_common.geometry import Array
    from hive_common.zone import Zone
    from hive_navigation.planning.clearance import ClearanceField, Disc
    from hive_navigation.planning.path import Point


class AroundZones(NamedTuple):
    """What plans around zones, see `ZonedPlanner.around`."""

    planner: OmplPlanner
    names: str


class ZonedPlanner:
    """A `Planner` for one map and one size of robot that keeps out of some zones.

    A robot that is in such a zone already plans as if there were none, so that it gets out.

    Args:
        grid: The map, of free and blocked cells.
        radius: Of the robot [m].
        zones: Those that there are; as they are now.
    """

    def __init__(self, grid: GridMap, radius: float, zones: Iterable[Zone] = ()) -> None:
        self._radius = radius
        self._free = OmplPlanner(grid, radius)
        self._zoned: AroundZones | None = self.around(zones)

    @property
    def field(self) -> ClearanceField:
        """The clearances of the map, without zones."""
        return self._free.field

    def around(self, zones: Iterable[Zone]) -> AroundZones | None:
        """Return what plans around zones, for `use`; it takes as long as a new planner.

        Any thread may call this.
        """
        shut = keeping_out(zones)
        if not shut:
            return None
        grid = self._free.grid
        blocked = grid.blocked.copy()
        for zone in shut:
            _block(blocked, grid, np.array(zone.corners))
        around = GridMap.of_blocked(blocked, grid.resolution, grid.origin)
        return AroundZones(
            OmplPlanner(around, self._radius), ", ".join(zone.name for zone in shut)
        )

    def use(self, zoned: AroundZones | None) -> None:
        """Plan around other zones from now on; see `around`."""
        self._zoned = zoned

    def plan(self, start: Point, goal: Point, discs: Sequence[Disc] = ()) -> list[Point]:
        """See `Planner.plan`."""
        return self._find(start, goal, lambda planner: planner.plan(start, goal, discs))

    def plan_near(self, start: Point, goal: Point, tolerance: float) -> list[Point]:
        """Return a path as near to a goal as there is one; see `OmplPlanner.plan_near`.

        Raises:
            PlanError: There is no path to any place within the tolerance.
        """
        return self._find(start, goal, lambda planner: planner.plan_near(start, goal, tolerance))

    def _find(
        self, start: Point, goal: Point, find: Callable[[OmplPlanner], list[Point]]
    ) -> list[Point]:
        zoned = self._zoned
        if zoned is None or self._is_in(zoned, start):
            return find(self._free)
        try:
            return find(zoned.planner)
        except PlanError:
            find(self._free)  # where that fails as well, it says why
            raise _closed(goal, zoned) from None

    def _is_in(self, zoned: AroundZones, place: Point) -> bool:
        """Return whether a part of a robot at a place is in one of the zones."""
        return zoned.planner.field.at(*place) < self._radius <= self.field.at(*place)


def _block(blocked: NDArray[np.bool_], grid: GridMap, corners: Array) -> None:
    """Mark the cells of a map whose centres lie in a polygon (n, 2), frame map [m]."""
    low = (corners.min(axis=0) - grid.origin[:2]) / grid.resolution
    high = (corners.max(axis=0) - grid.origin[:2]) / grid.resolution
    limits = grid.cells.shape[::-1]
    first, stop = (np.clip(each, 0, limits).astype(int) for each in (np.floor(low), np.ceil(high)))
    columns, rows = np.meshgrid(np.arange(first[0], stop[0]), np.arange(first[1], stop[1]))
    cells = np.stack([columns.ravel(), rows.ravel()], axis=1)
    centres = np.array(grid.origin[:2]) + (cells + 0.5) * grid.resolution
    blocked[rows.ravel(), columns.ravel()] |= inside(corners, centres)


def _closed(goal: Point, zoned: AroundZones) -> PlanError:
    return PlanError(
        f"every path to ({goal[0]:.2f}, {goal[1]:.2f}) leads through a zone that is closed or "
        f"keeps robots out ({zoned.names}); open it, or choose another goal",
        lasting=False,
    )
