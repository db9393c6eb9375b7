# SPDX-License-Identifier: BSD-3-Clause
"""Finds the places where an idle robot hinders nobody.

A robot may park where two robots fit beside each other, so not in a door or an aisle; and where
the others still get past it: all that was connected around it stays connected without its place,
for one robot and for two abreast. All is reckoned for the largest robot.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from hive_common.compiled import compiled
from hive_common.distances import distances
from hive_navigation.mapf.lattice import GAP
from hive_navigation.mapf.roadmap import MARGIN, need

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from hive_common.geometry import Array
    from hive_navigation.planning.clearance import ClearanceField
    from hive_navigation.planning.lines import Cells, Scale

AROUND = 1.0  # how far beyond the parked robot's reach the map is looked at [m]


def may_park(field: ClearanceField, places: Array, radius: float) -> NDArray[np.bool_]:
    """Return at which places an idle robot hinders nobody.

    A map without a wide part has no such place; then those count that leave the way free for one
    robot.

    Args:
        field: The clearances of the map.
        places: (n, 2), frame map [m].
        radius: Of the largest robot [m].
    """
    step = field.scale[0]
    pair = 2 * radius + GAP / 2  # of the circle around two robots [m]
    parked = np.minimum(radius, field.at_points(places) - MARGIN)
    everywhere = np.ones(len(places), dtype=np.bool_)
    # As far as the corner of a room is from the middle of two robots in it.
    is_near = _are_near(field, places, need(pair), math.sqrt(2) * (pair - parked) + step)
    found = _passed(field, places, need(pair), parked, is_near)
    found = _passed(field, places, need(radius), parked, found)
    return found if found.any() else _passed(field, places, need(radius), parked, everywhere)


def _are_near(
    field: ClearanceField, places: Array, need_there: float, reaches: Array
) -> NDArray[np.bool_]:
    """Return which places (n, 2) are within their reach (n,) of where there is room enough [m]."""
    step = field.scale[0]
    rows, columns = _cells(field, places).T
    near = np.zeros(len(places), dtype=np.bool_)
    roomy = field.clearance >= need_there
    for strip, away in distances(roomy, reaches.max(initial=0.0) / step + 1, walled=False):
        here = np.flatnonzero((rows >= strip.start) & (rows < strip.stop))
        near[here] = away[rows[here] - strip.start, columns[here]] * step <= reaches[here]
    return near


def _passed(
    field: ClearanceField,
    places: Array,
    need_there: float,
    parked: Array,
    asked: NDArray[np.bool_],
) -> NDArray[np.bool_]:
    """Return which of the places that are `asked` for let others pass; see `_passes`."""
    found = asked.copy()
    for index in np.flatnonzero(asked):
        found[index] = _passes(field, places[index], need_there, parked[index])
    return found


def _passes(field: ClearanceField, place: Array, need_there: float, parked: float) -> bool:
    """Return whether others get past a robot of radius `parked` [m] at a place."""
    x, y = map(float, place)
    apart = need_there + parked + GAP
    return _passable(field.clearance, field.scale, x, y, need_there, apart, AROUND)


@compiled("int64(boolean[:, ::1], int32[:, ::1], int32[::1], int64, int64)")
def _filled(
    free: NDArray[np.bool_],
    part: NDArray[np.int32],
    queue: NDArray[np.int32],
    first_cell: int,
    number: int,
) -> int:
    """Write a number to the connected part of a free cell, and return how many cells it has.

    Cells are numbered row by row; those at the edge are never free.
    """
    columns = free.shape[1]
    is_free, parts = free.reshape(-1), part.reshape(-1)
    parts[first_cell] = number
    queue[0] = first_cell
    first, last = 0, 1
    while first < last:
        cell = queue[first]
        first += 1
        for there in (cell - columns, cell + columns, cell - 1, cell + 1):
            if is_free[there] and parts[there] != number:
                parts[there] = number
                queue[last] = there
                last += 1
    return last


@compiled("UniTuple(boolean[:, ::1], 2)(float32[:, ::1], int64, int64, int64, float64, float64)")
def _window(
    clearance: Cells, middle_row: int, middle_column: int, half: int, need: float, apart: float
) -> tuple[NDArray[np.bool_], NDArray[np.bool_]]:
    """Return which cells around a cell are free, and which of them are `apart` from it [cells].

    The window reaches `half` cells from the middle, and has an edge of cells that are not free.
    """
    first_row, first_column = max(0, middle_row - half), max(0, middle_column - half)
    rows = min(clearance.shape[0], middle_row + half + 1) - first_row
    columns = min(clearance.shape[1], middle_column + half + 1) - first_column
    free = np.zeros((rows + 2, columns + 2), np.bool_)
    beyond = np.zeros((rows + 2, columns + 2), np.bool_)
    for row in range(rows):
        up = row + first_row - middle_row
        for column in range(columns):
            across = column + first_column - middle_column
            if clearance[row + first_row, column + first_column] >= need:
                free[row + 1, column + 1] = True
                beyond[row + 1, column + 1] = up * up + across * across >= apart * apart
    return free, beyond


@compiled("boolean(boolean[:, ::1], boolean[:, ::1], float64)")
def _are_joined(free: NDArray[np.bool_], beyond: NDArray[np.bool_], splinter: float) -> bool:
    """Return whether the pieces of what is `beyond` are as many as the free parts they lie in.

    Splinters at a wall, of less than so many cells, do not count: no robot ever goes there.
    """
    whole, cut = np.zeros(free.shape, np.int32), np.zeros(free.shape, np.int32)
    queue = np.empty(free.size, np.int32)
    is_beyond, whole_of, cut_of = beyond.reshape(-1), whole.reshape(-1), cut.reshape(-1)
    count, pieces, parts = beyond.sum(), 0, 0
    has_piece = np.zeros(free.size + 1, np.bool_)
    for cell in range(free.size):
        if not is_beyond[cell] or cut_of[cell] > 0:
            continue
        pieces += 1
        size = _filled(beyond, cut, queue, cell, pieces)
        if size == count:
            return True
        if size < splinter:
            continue
        if whole_of[cell] == 0:
            parts += 1
            _filled(free, whole, queue, cell, parts)
        if has_piece[whole_of[cell]]:
            return False
        has_piece[whole_of[cell]] = True
    return True


@compiled(
    "boolean(float32[:, ::1], UniTuple(float64, 3), float64, float64, float64, float64, float64)"
)
def _passable(
    clearance: Cells,
    scale: Scale,
    x: float,
    y: float,
    need_there: float,
    apart: float,
    around: float,
) -> bool:
    """Return whether a robot at x, y leaves connected what was connected around it.

    Those who pass need a clearance, and keep their middle `apart` from the robot's [m]. The map is
    looked at as far as `around` beyond that [m].
    """
    step, left, low = scale
    half = int((apart + around) / step) + 1
    row, column = int((y - low) / step), int((x - left) / step)
    # All that is looked at is free: the clearance changes by at most 1 m per metre.
    if clearance[row, column] >= need_there + (1.5 * half + 1.5) * step:
        return True
    free, beyond = _window(clearance, row, column, half, need_there, apart / step)
    return _are_joined(free, beyond, (need_there / step) ** 2 / 4)


def _cells(field: ClearanceField, points: Array) -> NDArray[np.intp]:
    """Return the cells (n, 2) of points on the map, row and column."""
    step, left, low = field.scale
    cells = (points[:, ::-1] - (low, left)) / step
    return cells.astype(np.intp)
