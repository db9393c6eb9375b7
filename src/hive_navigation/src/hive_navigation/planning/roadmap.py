# SPDX-License-Identifier: BSD-3-Clause
"""A small graph of the places where shortest paths bend; it tells the planner which way round.

A shortest path among obstacles is straight except where it bends around a convex corner. The
corners are read off the distance transform: the cells nearest to a corner form a whole wedge,
those nearest to a stretch of wall a strip one cell wide. A few landmarks on an arc around each
corner, joined wherever a robot can go straight from one to the other, hold a nearly shortest path
between any two places. They are computed once per map and robot size. `ompl_planner` turns the
roadmap's path into a plan; docs/decisions/010-planner.md tells what else was tried.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from scipy import ndimage

from hive_common.distances import strips
from hive_navigation.planning.clearance import as_rows
from hive_navigation.planning.lines import joined, shortest_chain

if TYPE_CHECKING:
    from collections.abc import Sequence

    from hive_common.geometry import Array, Indices
    from hive_navigation.planning.clearance import ClearanceField, Disc
    from hive_navigation.planning.path import Point

ARC = math.radians(30)
"""Angle between neighbouring landmarks around a corner [rad]; makes paths at most 1 % longer."""

MIN_CORNER = math.radians(20)
"""Corners that turn by less are walls that the grid draws as steps [rad]."""


class Landmarks(NamedTuple):
    """Places where a shortest path may bend."""

    at: Array  # (n, 2) array, frame map [m]
    outward: Array  # (n, 2) array of unit vectors, away from the corner that the path bends around


class Roadmap:
    """The landmarks of one map for one size of robot, and the straight lines between them."""

    def __init__(self, field: ClearanceField, need: float) -> None:
        self.need = need  # clearance that the robot needs [m]
        self._landmarks = _corner_landmarks(field, need)
        at, outward = self._landmarks
        pairs = joined(field.clearance, field.scale, need, at, outward)
        pairs = np.concatenate([pairs, pairs[:, ::-1]])
        # In both directions, in the order of the first landmark.
        self._pairs = np.ascontiguousarray(pairs[np.lexsort((pairs[:, 1], pairs[:, 0]))])
        self._begins: Indices = np.searchsorted(self._pairs[:, 0], np.arange(len(at) + 1))

    def path(
        self, start: Point, goal: Point, field: ClearanceField, discs: Sequence[Disc] = ()
    ) -> list[Point] | None:
        """Return a short path through the landmarks, or None if they hold none.

        `field` holds the clearances of the map with the discs, obstacles that are not on the map.
        """
        if field.line_is_clear(start, goal, self.need):
            return [start, goal]
        at, outward = self._landmarks
        if discs:
            # Among many robots there is often no path, and a search would try all landmarks.
            if not field.connects(start, goal, self.need, corners=True):
                return None
            around, away = _disc_landmarks(field, discs, self.need)
            at, outward = np.vstack([at, around]), np.vstack([outward, away])
        chain = shortest_chain(
            field.clearance,
            field.scale,
            self.need,
            at,
            outward,
            self._begins,
            self._pairs,
            (float(start[0]), float(start[1])),
            (float(goal[0]), float(goal[1])),
        )
        if not len(chain):
            return None
        return [start, *((float(x), float(y)) for x, y in at[chain]), goal]


def _corner_landmarks(field: ClearanceField, need: float) -> Landmarks:
    """Return landmarks around the convex corners of the map, at the clearance a robot needs."""
    grid = field.grid
    step = grid.resolution
    # The chord between two landmarks must still keep `need` from the corner.
    radius = need / math.cos(ARC / 2)
    rows, columns, at_row, at_column = _ring(field, radius, radius + 1.5 * step)
    owner = at_row * grid.blocked.shape[1] + at_column
    _, index, sizes = np.unique(owner, return_inverse=True, return_counts=True)
    cells_per_radian = radius / step * 1.5
    corner = sizes >= MIN_CORNER * cells_per_radian
    chosen = corner[index]
    angle = np.arctan2(rows - at_row, columns - at_column)[chosen]
    sector = np.floor(angle / ARC).astype(np.int64)
    off_middle = np.abs(angle / ARC - sector - 0.5)
    # In each sector around a corner, keep the cell nearest to the sector's middle.
    key = index[chosen] * 64 + sector + 32
    order = np.lexsort((off_middle, key))
    _, first = np.unique(key[order], return_index=True)
    picked = order[first]
    cells = np.column_stack([columns[chosen][picked], rows[chosen][picked]])
    middle = angle[picked]
    outward = np.column_stack([np.cos(middle), np.sin(middle)])
    return Landmarks(np.asarray(grid.origin[:2]) + (cells + 0.5) * step, outward)


def _ring(field: ClearanceField, low: float, high: float) -> tuple[Indices, ...]:
    """Return the cells with a clearance from `low` to below `high` [m], and what is near them.

    Returns:
        Rows and columns (n,) of the cells, and those of the nearest blocked cells.
    """
    blocked, step = field.grid.blocked, field.grid.resolution
    found = [np.empty((4, 0), dtype=np.int64)]
    for strip, around in strips(blocked, high / step + 1):
        room = field.clearance[strip]
        rows, columns = np.nonzero((room >= low) & (room < high))
        if not len(rows):
            continue
        nearest = ndimage.distance_transform_edt(
            ~blocked[around], return_distances=False, return_indices=True
        )
        rows += strip.start
        at_row, at_column = nearest[:, rows - around.start, columns].astype(np.int64)
        at_row += around.start
        # What is near is the edge of the map where no cell is.
        near = np.hypot(rows - at_row, columns - at_column) * step < high + step
        found.append(np.stack([rows, columns, at_row, at_column])[:, near])
    return tuple(np.concatenate(found, axis=1))


def _disc_landmarks(field: ClearanceField, discs: Sequence[Disc], need: float) -> Landmarks:
    """Return the free landmarks around discs, one every `ARC`."""
    angles = np.arange(0.0, 2 * math.pi, ARC)
    circle = np.column_stack([np.cos(angles), np.sin(angles)])
    slack = 1.5 * field.grid.resolution
    rows = as_rows(discs)
    radii = (rows[:, 2] + need) / math.cos(ARC / 2) + slack
    at = (rows[:, None, :2] + radii[:, None, None] * circle).reshape(-1, 2)
    free = field.at_points(at) >= need
    return Landmarks(at[free], np.tile(circle, (len(rows), 1))[free])
