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
from scipy import ndimage

from hive_common.compiled import compiled
from robot_navigation.mapf.lattice import GAP
from robot_navigation.mapf.roadmap import MARGIN, need

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from hive_common.geometry import Array, Indices
    from robot_navigation.planning.clearance import ClearanceField
    from robot_navigation.planning.lines import Cells, Scale

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
    free = np.array(
        [
            _passes(field, place, need(radius), each)
            for place, each in zip(places, parked, strict=True)
        ]
    )
    middles = field.clearance >= need(pair)
    if not middles.any():
        return free
    rows, columns = _cells(field, places).T
    away = ndimage.distance_transform_edt(~middles)[rows, columns] * step
    # As far as the corner of a room is from the middle of two robots in it.
    found: NDArray[np.bool_] = free & (away <= math.sqrt(2) * (pair - parked) + step)
    for index in np.flatnonzero(found):
        found[index] = _passes(field, places[index], need(pair), parked[index])
    return found if found.any() else free


def _passes(field: ClearanceField, place: Array, need_there: float, parked: float) -> bool:
    """Return whether others get past a robot of radius `parked` [m] at a place."""
    x, y = map(float, place)
    apart = need_there + parked + GAP
    return _passable(field.clearance, field.scale, x, y, need_there, apart, AROUND)


@compiled("int64(boolean[:, ::1], int64[:, ::1], int64[::1], int64, int64, int64)")
def _filled(
    free: NDArray[np.bool_],
    part: Indices,
    queue: Indices,
    row: int,
    column: int,
    number: int,
) -> int:
    """Write a number to the connected part of a free cell, and return how many cells it has."""
    rows, columns = free.shape
    part[row, column] = number
    queue[0] = row * columns + column
    first, last = 0, 1
    while first < last:
        row, column = divmod(queue[first], columns)
        first += 1
        for down, right in ((-1, 0), (1, 0), (0, -1), (0, 1)):
            there, aside = row + down, column + right
            if (
                0 <= there < rows
                and 0 <= aside < columns
                and free[there, aside]
                and part[there, aside] != number
            ):
                part[there, aside] = number
                queue[last] = there * columns + aside
                last += 1
    return last


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
    middle_row, middle_column = int((y - low) / step), int((x - left) / step)
    first_row, first_column = max(0, middle_row - half), max(0, middle_column - half)
    rows = min(clearance.shape[0], middle_row + half + 1) - first_row
    columns = min(clearance.shape[1], middle_column + half + 1) - first_column
    free, beyond = np.zeros((rows, columns), np.bool_), np.zeros((rows, columns), np.bool_)
    for row in range(rows):
        up = row + first_row - middle_row
        for column in range(columns):
            across = column + first_column - middle_column
            if clearance[row + first_row, column + first_column] >= need_there:
                free[row, column] = True
                beyond[row, column] = math.hypot(up, across) * step >= apart
    whole, cut = np.zeros((rows, columns), np.int64), np.zeros((rows, columns), np.int64)
    queue = np.empty(rows * columns, np.int64)
    parts = pieces = 0
    has_piece = np.zeros(rows * columns + 1, np.bool_)
    for row in range(rows):
        for column in range(columns):
            if not beyond[row, column] or cut[row, column] > 0:
                continue
            pieces += 1
            size = _filled(beyond, cut, queue, row, column, pieces)
            # Splinters at a wall, where no robot ever goes, do not count.
            if size * step * step < need_there * need_there / 4:
                continue
            if whole[row, column] == 0:
                parts += 1
                _filled(free, whole, queue, row, column, parts)
            if has_piece[whole[row, column]]:
                return False
            has_piece[whole[row, column]] = True
    return True


def _cells(field: ClearanceField, points: Array) -> NDArray[np.intp]:
    """Return the cells (n, 2) of points on the map, row and column."""
    step, left, low = field.scale
    cells = (points[:, ::-1] - (low, left)) / step
    return cells.astype(np.intp)
