# SPDX-License-Identifier: BSD-3-Clause
"""Compiled: how much room there is along straight lanes, and which places can be reached straight.

`clearance` and `scale` are those of `planning.lines`. Compiled code calls only what its own file
holds, so the look-up of a clearance is here once more.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from hive_common.compiled import compiled

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from hive_common.geometry import Array, Indices
    from hive_navigation.planning.lines import Cells, Scale

TINY = 1e-9  # a shorter line has no direction [m]
CROSSING = 1e-6  # how far a line goes into the next cell to be in it [m]


@compiled("float64(float32[:, ::1], UniTuple(float64, 3), float64, float64)")
def _room_at(clearance: Cells, scale: Scale, x: float, y: float) -> float:
    """Return the clearance at a point; 0 off the map [m]."""
    step, left, low = scale
    across, up = (x - left) / step, (y - low) / step
    if not (0 <= across < clearance.shape[1] and 0 <= up < clearance.shape[0]):
        return 0.0
    return float(clearance[int(up), int(across)])


@compiled(
    "float64(float32[:, ::1], UniTuple(float64, 3), float64, float64, float64, float64, float64)"
)
def _line_room(
    clearance: Cells, scale: Scale, ax: float, ay: float, bx: float, by: float, need: float
) -> float:
    """Return the least clearance along a line; -1 if it is less than `need` [m]."""
    if (ax, ay) > (bx, by):
        ax, ay, bx, by = bx, by, ax, ay
    least = min(_room_at(clearance, scale, ax, ay), _room_at(clearance, scale, bx, by))
    length = math.hypot(bx - ax, by - ay)
    step, left, low = scale
    dx, dy = (bx - ax) / max(length, TINY), (by - ay) / max(length, TINY)
    gone = 0.0
    while gone < length and least >= need:
        x, y = ax + gone * dx - left, ay + gone * dy - low
        room = _room_at(clearance, scale, x + left, y + low)
        least = min(least, room)
        # The next cell is where the line leaves this one.
        out = length
        if dx > TINY:
            out = min(out, ((math.floor(x / step) + 1) * step - x) / dx)
        if abs(dy) > TINY:
            edge = math.floor(y / step) + 1 if dy > 0 else math.floor(y / step)
            out = min(out, (edge * step - y) / dy)
        # The clearance changes by at most 1 m per metre, plus the rounding to cells.
        gone += max(out + CROSSING, room - least - 1.5 * step)
    return least if least >= need else -1.0


@compiled(
    "float64[::1](float32[:, ::1], UniTuple(float64, 3), float64[:, ::1], float64[:, ::1],"
    " float64)"
)
def line_rooms(clearance: Cells, scale: Scale, a: Array, b: Array, need: float) -> Array:
    """Return the least clearances along lines from a (n, 2) to b (n, 2) [m].

    -1 stands for less than `need` [m]. The answer is the same in both directions.
    """
    found = np.empty(len(a))
    for line in range(len(a)):
        found[line] = _line_room(
            clearance, scale, a[line, 0], a[line, 1], b[line, 0], b[line, 1], need
        )
    return found


@compiled(
    "int64(float32[:, ::1], UniTuple(float64, 3), float64, float64, float64, float64[:, ::1],"
    " float64[::1], float64, int64[::1], float64[::1])"
)
def _reach(
    clearance: Cells,
    scale: Scale,
    x: float,
    y: float,
    need: float,
    places: Array,
    room: Array,
    reach: float,
    found: Indices,
    widths: Array,
) -> int:
    """Fill `found` and `widths` with the nearest places that a point reaches straight.

    Returns how many there are, the nearest first. `places` (n, 2) are in the order of y.
    """
    first = np.searchsorted(places[:, 1], y - reach)
    near = [(0.0, 0) for _ in range(0)]
    for place in range(first, len(places)):
        if places[place, 1] > y + reach:
            break
        away = math.hypot(places[place, 0] - x, places[place, 1] - y)
        if away <= reach and room[place] >= need:
            near.append((away, place))
    near.sort()
    count = 0
    for _, place in near:
        if count == len(found):
            break
        width = _line_room(clearance, scale, x, y, places[place, 0], places[place, 1], need)
        if width >= 0:
            found[count], widths[count] = place, width
            count += 1
    return count


@compiled(
    "Tuple((int64[:, ::1], float64[:, ::1]))(float32[:, ::1], UniTuple(float64, 3),"
    " float64[:, ::1], float64[::1], float64[:, ::1], float64[::1], float64[::1], int64)"
)
def reached(
    clearance: Cells,
    scale: Scale,
    points: Array,
    needs: Array,
    places: Array,
    room: Array,
    reaches: Array,
    most: int,
) -> tuple[Indices, Array]:
    """Return which places each point reaches on a straight line, the nearest first.

    Args:
        clearance: See above.
        scale: See above.
        points: (k, 2), frame map [m].
        needs: (k,) clearance that is needed on the way from each [m].
        places: (n, 2) in the order of y, frame map [m].
        room: (n,) clearances at them [m].
        reaches: (k,) how far from each point places count [m].
        most: How many places are returned at most for each point.

    Returns:
        (k, most) indices, -1 where there are no more, and the least clearances on the way [m].
    """
    found = np.full((len(points), most), -1, dtype=np.int64)
    widths = np.zeros((len(points), most))
    for point in range(len(points)):
        _reach(
            clearance,
            scale,
            points[point, 0],
            points[point, 1],
            needs[point],
            places,
            room,
            reaches[point],
            found[point],
            widths[point],
        )
    return found, widths


@compiled(
    "void(boolean[:, ::1], float32[:, ::1], UniTuple(float64, 3), float64, float64[:, ::1],"
    " float64)"
)
def cover(
    bare: NDArray[np.bool_],
    clearance: Cells,
    scale: Scale,
    need: float,
    places: Array,
    reach: float,
) -> None:
    """Take the cells that reach one of the places (n, 2) straight out of `bare`, in place."""
    step, left, low = scale
    rows, columns = clearance.shape
    for place in range(len(places)):
        x, y = places[place]
        room = _room_at(clearance, scale, x, y)
        if room < need:
            continue
        for row in range(
            max(0, int((y - reach - low) / step)), min(rows, int((y + reach - low) / step) + 1)
        ):
            for column in range(
                max(0, int((x - reach - left) / step)),
                min(columns, int((x + reach - left) / step) + 1),
            ):
                if not bare[row, column]:
                    continue
                across, up = left + (column + 0.5) * step, low + (row + 0.5) * step
                away = math.hypot(across - x, up - y)
                # The clearance changes by at most 1 m per metre, plus the rounding to cells.
                spare = max(room, clearance[row, column]) - need - 1.5 * step
                if away <= reach and (
                    away <= spare or _line_room(clearance, scale, across, up, x, y, need) >= 0
                ):
                    bare[row, column] = False


@compiled(
    "float64[:, ::1](float32[:, ::1], UniTuple(float64, 3), float64[:, ::1], float64[::1],"
    " float64)"
)
def roomy(clearance: Cells, scale: Scale, points: Array, needs: Array, reach: float) -> Array:
    """Return points (n, 2), each moved to the nearest cell with the clearance that it needs.

    A point with enough clearance, or without such a cell within `reach` [m], does not move.
    """
    step, left, low = scale
    moved = points.copy()
    for index in range(len(points)):
        x, y = points[index]
        if _room_at(clearance, scale, x, y) >= needs[index]:
            continue
        nearest = reach
        for row in range(
            max(0, int((y - reach - low) / step)),
            min(clearance.shape[0], int((y + reach - low) / step) + 1),
        ):
            for column in range(
                max(0, int((x - reach - left) / step)),
                min(clearance.shape[1], int((x + reach - left) / step) + 1),
            ):
                across, up = left + (column + 0.5) * step, low + (row + 0.5) * step
                away = math.hypot(across - x, up - y)
                if away < nearest and clearance[row, column] >= needs[index]:
                    nearest = away
                    moved[index, 0], moved[index, 1] = across, up
    return moved
