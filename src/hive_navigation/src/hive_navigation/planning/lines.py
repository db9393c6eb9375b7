# SPDX-License-Identifier: BSD-3-Clause
"""Straight lines through a field of clearances: which are clear, and the shortest chain of them.

All compiled code that looks into such a field is in this file: numba's cache does not notice that
a function that was called from another file has changed.

`clearance` (rows, columns) holds the clearances of cells [m]; `scale` is the side of a cell, and x
and y of the field's lower left corner, frame map [m].
"""

from __future__ import annotations

import heapq
import math
from typing import TYPE_CHECKING

import numpy as np

from hive_common.compiled import compiled

if TYPE_CHECKING:
    from typing import TypeAlias

    from numpy.typing import NDArray

    from hive_common.geometry import Array, Indices

    Cells: TypeAlias = NDArray[np.float32]
    Scale: TypeAlias = tuple[float, float, float]

FAR = 3.0  # greatest clearance [m]: no robot is larger, and a disc then changes few cells
TINY = 1e-9  # a shorter line has no direction [m]

GRAZE = math.sin(math.radians(30))
"""Sine of the angle by which a path may differ from a tangent of the circle around a corner."""


@compiled("float64(float32[:, ::1], UniTuple(float64, 3), float64, float64)")
def clearance_at(clearance: Cells, scale: Scale, x: float, y: float) -> float:
    """Return the clearance at a point; 0 off the map [m]."""
    step, left, low = scale
    across, up = (x - left) / step, (y - low) / step
    # Comparing first keeps NaN and what is too large for an integer out.
    if not (0 <= across < clearance.shape[1] and 0 <= up < clearance.shape[0]):
        return 0.0
    return float(clearance[int(up), int(across)])


@compiled("float64[::1](float32[:, ::1], UniTuple(float64, 3), float64[:, ::1])")
def clearances_at(clearance: Cells, scale: Scale, points: Array) -> Array:
    """Return the clearances (n,) at points (n, 2) [m]."""
    found = np.empty(len(points))
    for index in range(len(points)):
        found[index] = clearance_at(clearance, scale, points[index, 0], points[index, 1])
    return found


@compiled("void(float32[:, ::1], UniTuple(float64, 3), float64[:, ::1])")
def add_discs(clearance: Cells, scale: Scale, discs: Array) -> None:
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
                room = math.sqrt(across * across + up * up) - radius
                clearance[row, column] = min(clearance[row, column], np.float32(max(room, 0.0)))


@compiled(
    "boolean(float32[:, ::1], UniTuple(float64, 3), float64, float64, float64, float64, float64)"
)
def line_is_clear(
    clearance: Cells,
    scale: Scale,
    ax: float,
    ay: float,
    bx: float,
    by: float,
    need: float,
) -> bool:
    """See `ClearanceField.line_is_clear`."""
    room = min(clearance_at(clearance, scale, ax, ay), clearance_at(clearance, scale, bx, by))
    if room < need:
        return False
    if (ax, ay) > (bx, by):
        ax, ay, bx, by = bx, by, ax, ay
    length = math.hypot(bx - ax, by - ay)
    dx, dy = (bx - ax) / max(length, TINY), (by - ay) / max(length, TINY)
    step = scale[0]
    gone = 0.0
    while gone < length:
        room = clearance_at(clearance, scale, ax + gone * dx, ay + gone * dy) - need
        if room < 0:
            return False
        # The clearance changes by at most 1 m per metre, plus the rounding to cells.
        gone += max(step, room - 1.5 * step)
    return True


@compiled(
    "boolean[::1](float32[:, ::1], UniTuple(float64, 3), float64[:, ::1], float64[:, ::1],"
    " float64)"
)
def lines_are_clear(
    clearance: Cells, scale: Scale, a: Array, b: Array, need: float
) -> NDArray[np.bool_]:
    """See `ClearanceField.lines_are_clear`."""
    clear = np.empty(len(a), dtype=np.bool_)
    for line in range(len(a)):
        clear[line] = line_is_clear(
            clearance, scale, a[line, 0], a[line, 1], b[line, 0], b[line, 1], need
        )
    return clear


@compiled(
    "boolean(float32[:, ::1], UniTuple(float64, 3), float64, UniTuple(float64, 2),"
    " UniTuple(float64, 2), boolean)"
)
def connected(
    clearance: Cells,
    scale: Scale,
    need: float,
    start: tuple[float, float],
    goal: tuple[float, float],
    corners: bool,
) -> bool:
    """Return whether cells with enough clearance connect two places; `corners` may connect too."""
    rows, columns = clearance.shape
    if not (
        clearance_at(clearance, scale, start[0], start[1]) >= need
        and clearance_at(clearance, scale, goal[0], goal[1]) >= need
    ):
        return False
    step, left, low = scale
    cells = clearance.reshape(-1)
    end = int((goal[1] - low) / step) * columns + int((goal[0] - left) / step)
    reached = np.zeros(len(cells), dtype=np.bool_)
    queue = np.empty(len(cells), dtype=np.int32)
    queue[0] = int((start[1] - low) / step) * columns + int((start[0] - left) / step)
    reached[queue[0]] = True
    first, last = 0, 1
    while first < last and not reached[end]:
        row, column = divmod(queue[first], columns)
        first += 1
        for down in range(max(0, row - 1), min(rows, row + 2)):
            for right in range(max(0, column - 1), min(columns, column + 2)):
                cell = down * columns + right
                if (
                    not reached[cell]
                    and cells[cell] >= need
                    and (corners or down == row or right == column)
                ):
                    reached[cell] = True
                    queue[last] = cell
                    last += 1
    return bool(reached[end])


@compiled("boolean(float64[:, ::1], int64, float64, float64)")
def _touches(outward: Array, landmark: int, dx: float, dy: float) -> bool:
    """Return whether a line to or from a landmark touches the circle around its corner.

    It may also cut it.
    """
    along = abs(dx * outward[landmark, 0] + dy * outward[landmark, 1])
    return bool(along <= GRAZE * math.hypot(dx, dy))


@compiled(
    "boolean(float32[:, ::1], UniTuple(float64, 3), float64, float64, float64, float64, float64)"
)
def _may_be_clear(
    clearance: Cells, scale: Scale, x: float, y: float, dx: float, dy: float, need: float
) -> bool:
    """Return False if one of a few points on a line is not clear, as on most long lines."""
    for share in (0.5, 0.25, 0.75, 0.125, 0.375, 0.625, 0.875):
        if clearance_at(clearance, scale, x + share * dx, y + share * dy) < need:
            return False
    return True


@compiled(
    "int64[:, ::1](float32[:, ::1], UniTuple(float64, 3), float64, float64[:, ::1],"
    " float64[:, ::1])"
)
def joined(clearance: Cells, scale: Scale, need: float, at: Array, outward: Array) -> Indices:
    """Return the pairs (k, 2) of landmarks between which a shortest path may run straight."""
    pairs = np.empty((max(len(at), 1), 2), dtype=np.int64)
    count = 0
    for one in range(len(at)):
        for other in range(one):
            dx, dy = at[other, 0] - at[one, 0], at[other, 1] - at[one, 1]
            if (
                _touches(outward, one, dx, dy)
                and _touches(outward, other, dx, dy)
                and _may_be_clear(clearance, scale, at[one, 0], at[one, 1], dx, dy, need)
                and line_is_clear(
                    clearance, scale, at[one, 0], at[one, 1], at[other, 0], at[other, 1], need
                )
            ):
                if count == len(pairs):
                    pairs = np.concatenate((pairs, np.empty_like(pairs)))
                pairs[count, 0], pairs[count, 1] = one, other
                count += 1
    return pairs[:count]


@compiled("int64[::1](int64[::1], int64)")
def _chain(came: Indices, end: int) -> Indices:
    """Return the landmarks up to the last one, from where each `came` (n,), -1 at the first."""
    chain = np.empty(len(came), dtype=np.int64)
    first = len(chain)
    while end >= 0:
        first -= 1
        chain[first] = end
        end = came[end]
    return chain[first:]


@compiled(
    "int64[::1](float32[:, ::1], UniTuple(float64, 3), float64, float64[:, ::1], float64[:, ::1],"
    " int64[::1], int64[:, ::1], UniTuple(float64, 2), UniTuple(float64, 2))"
)
def shortest_chain(
    clearance: Cells,
    scale: Scale,
    need: float,
    at: Array,
    outward: Array,
    begins: Indices,
    pairs: Indices,
    start: tuple[float, float],
    goal: tuple[float, float],
) -> Indices:
    """Return the landmarks of a shortest path from start to goal (A*); none if there is no path.

    Args:
        clearance: See above.
        scale: See above.
        need: The clearance that the robot needs [m].
        at: (n, 2) landmarks, frame map [m].
        outward: (n, 2) unit vectors, away from the corners that the path bends around.
        begins: (m + 1,) for the first m landmarks, where their pairs begin; the others may be
            joined to any.
        pairs: (k, 2) `joined` ones, which obstacles that are not on the map may separate now.
        start: Frame map [m].
        goal: Frame map [m].
    """
    count, known = len(at), len(begins) - 1
    best, came = np.full(count, np.inf), np.full(count, -1)
    done = np.zeros(count, dtype=np.bool_)
    queue = [(0.0, -1)]
    end, end_cost = -1, np.inf
    while len(queue) > 0 and queue[0][0] < end_cost:
        _, node = heapq.heappop(queue)
        if node >= 0 and done[node]:
            continue
        (x, y), cost = start, 0.0
        first, last = 0, count
        if node >= 0:
            done[node] = True
            x, y = at[node]
            cost = best[node]
            dx, dy = goal[0] - x, goal[1] - y
            whole = cost + math.hypot(dx, dy)
            if (
                whole < end_cost
                and _touches(outward, node, dx, dy)
                and line_is_clear(clearance, scale, x, y, goal[0], goal[1], need)
            ):
                end, end_cost = node, whole
            if node < known:
                # The known ones come from the list of pairs.
                first, last = begins[node], begins[node + 1] + count - known
        for index in range(first, last):
            other = index
            is_pair = 0 <= node < known and index < begins[node + 1]
            if is_pair:
                other = pairs[index, 1]
            elif 0 <= node < known:
                other = known + index - begins[node + 1]
            dx, dy = at[other, 0] - x, at[other, 1] - y
            reached = cost + math.hypot(dx, dy)
            # What costs least comes first: few lines are ever checked.
            if (
                reached < best[other]
                and not done[other]
                and (is_pair or _touches(outward, other, dx, dy))
                and (is_pair or node < 0 or _touches(outward, node, dx, dy))
                and line_is_clear(clearance, scale, x, y, at[other, 0], at[other, 1], need)
            ):
                best[other], came[other] = reached, node
                left = math.hypot(goal[0] - at[other, 0], goal[1] - at[other, 1])
                heapq.heappush(queue, (reached + left, other))
    return _chain(came, end)
