# SPDX-License-Identifier: BSD-3-Clause
"""Lays a lattice of places over a map so that it fits the map's lanes and doors.

The spacing is what two of the smallest robots need beside each other, or a little more; spacing
and offset are chosen so that most points of the lattice lie where a robot fits. A warehouse whose
aisles have a constant pitch gets its lanes in the middle of the aisles in this way. Points with
little room then move to where there is more, as far as the middle of their aisle or door.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from hive_common.compiled import compiled

if TYPE_CHECKING:
    from hive_common.geometry import Array, Indices
    from hive_navigation.planning.clearance import ClearanceField
    from hive_navigation.planning.lines import Cells, Scale

GAP = 0.10
"""Distance between the circles around two robots that stand at neighbouring places [m]."""

WIDEST = 1.4
"""Greatest spacing over the least one. Diagonals that cross would be half as far apart as two
robots need at twice the least spacing; up to this factor a planner sees their ends meet."""

COST_OF_WIDTH = 0.5
"""What a lattice twice as wide has to gain in the share of free points."""

ENOUGH_CELLS = 2_000_000
"""A lattice is fitted to about so many cells of a map: it takes 3 s to look at 16 million."""

OFFSETS = ((1, 0), (0, 1), (1, 1), (1, -1), (1, 2), (2, 1), (1, -2), (2, -1))
"""Lanes lead to the 8 neighbours, and 8 more by a knight's move (columns, rows); the way back of
each lane is not listed. With 16 directions a path is at most 2.8 % longer than a straight line."""

COMFORT = 0.15
"""Room beyond the largest robot's need that makes a place good enough not to move [m]."""

CROWDED = 0.7
"""A place that was moved is left out if another one in its sight is nearer than this share of the
spacing."""


class Lattice(NamedTuple):
    """Points on a square grid.

    Attributes:
        spacing: [m]
        x, y: The first point, within one spacing of the map's lower left corner [m].
        columns, rows: How many there are.
    """

    spacing: float
    x: float
    y: float
    columns: int
    rows: int

    def points(self) -> Array:
        """Return the points (rows * columns, 2), row by row, frame map [m]."""
        across = self.x + self.spacing * np.arange(self.columns)
        up = self.y + self.spacing * np.arange(self.rows)
        grid = np.meshgrid(across, up)
        return np.column_stack([each.ravel() for each in grid])

    def pairs(self) -> Indices:
        """Return the pairs (k, 2) of points that may be joined by a lane."""
        index = np.arange(self.rows * self.columns).reshape(self.rows, self.columns)
        found = []
        for right, up in OFFSETS:
            low, high = max(0, -up), self.rows - max(0, up)
            if low < high and right < self.columns:
                one = index[low:high, : self.columns - right]
                other = index[low + up : high + up, right:]
                found.append(np.column_stack([one.ravel(), other.ravel()]))
        return np.concatenate(found) if found else np.empty((0, 2), dtype=np.intp)


def fitted(field: ClearanceField, radius: float, need: float) -> Lattice:
    """Return the lattice that fits a map best for robots of a radius [m], who need a clearance."""
    step = field.scale[0]
    least = 2 * radius + GAP
    widths = [
        least,
        *(np.arange(math.ceil(2 * least / step), 2 * WIDEST * least / step) * step / 2),
    ]
    free = float((field.clearance >= need).sum()) * step * step
    best, chosen = -math.inf, (least, 0.0, 0.0)
    for width in map(float, widths):
        shift, score = _best_shift(field.clearance, field.scale, need, width)
        score = score / max(free, step) - COST_OF_WIDTH * (width / least - 1)
        if score > best:
            best, chosen = score, (width, *shift)
    width, right, up = chosen
    x_min, y_min, x_max, y_max = field.grid.bounds
    return Lattice(
        width,
        x_min + right,
        y_min + up,
        math.ceil((x_max - x_min - right) / width),
        math.ceil((y_max - y_min - up) / width),
    )


@compiled("float64(float32[:, ::1], float64, float64, float64)")
def _at(clearance: Cells, step: float, x: float, y: float) -> float:
    """Return the clearance at a point, from the map's corner; 0 off the map [m]."""
    if not (0 <= x < clearance.shape[1] * step and 0 <= y < clearance.shape[0] * step):
        return 0.0
    row = min(int(y / step), clearance.shape[0] - 1)
    return float(clearance[row, min(int(x / step), clearance.shape[1] - 1)])


@compiled(
    "Tuple((UniTuple(float64, 2), float64))(float32[:, ::1], UniTuple(float64, 3), float64,"
    " float64)"
)
def _best_shift(
    clearance: Cells, scale: Scale, need: float, spacing: float
) -> tuple[tuple[float, float], float]:
    """Return the offset from the map's corner that fits best [m], and the area that it serves.

    A point serves its square of the lattice, a third of it by itself and a third by each of the
    lanes to the right and up.
    """
    step = scale[0]
    wide, high = clearance.shape[1] * step, clearance.shape[0] * step
    best, shift = -1.0, (0.0, 0.0)
    tries = max(1, int(spacing / step))
    # On a large map every n-th row of the lattice tells enough.
    every = max(1, round(clearance.size / ENOUGH_CELLS))
    for right in range(tries):
        for above in range(tries):
            total = 0.0
            y = (above + 0.5) * spacing / tries
            while y < high:
                x = (right + 0.5) * spacing / tries
                while x < wide:
                    room = _at(clearance, step, x, y)
                    if room >= need:
                        # Among offsets that serve equally much, the middle of aisles wins.
                        total += 1.0 + 0.2 * min(room, spacing / 2)
                        if (
                            _at(clearance, step, x + spacing / 2, y) >= need
                            and _at(clearance, step, x + spacing, y) >= need
                        ):
                            total += 1.0
                        if (
                            _at(clearance, step, x, y + spacing / 2) >= need
                            and _at(clearance, step, x, y + spacing) >= need
                        ):
                            total += 1.0
                    x += spacing
                y += every * spacing
            if total > best:
                best = total
                shift = ((right + 0.5) * spacing / tries, (above + 0.5) * spacing / tries)
    return shift, best * every * spacing * spacing / 3


@compiled(
    "float64[:, ::1](float32[:, ::1], UniTuple(float64, 3), float64[:, ::1], float64, float64,"
    " float64)"
)
def roomier(
    clearance: Cells, scale: Scale, points: Array, need: float, enough: float, spacing: float
) -> Array:
    """Return points (n, 2) moved to where there is more room, frame map [m].

    A point with less than `enough` room moves to the nearest cell that has it, or to the roomiest;
    by at most a quarter of the spacing, or half of it where a robot does not fit (`need`).
    """
    step, left, low = scale
    moved = points.copy()
    for index in range(len(points)):
        x, y = points[index, 0] - left, points[index, 1] - low
        room = _at(clearance, step, x, y)
        if room >= enough:
            continue
        reach = spacing / 4 if room >= need else spacing / 2
        best = min(room, enough)
        for row in range(
            max(0, math.ceil((y - reach) / step - 0.5)),
            min(clearance.shape[0], math.floor((y + reach) / step - 0.5) + 1),
        ):
            for column in range(
                max(0, math.ceil((x - reach) / step - 0.5)),
                min(clearance.shape[1], math.floor((x + reach) / step - 0.5) + 1),
            ):
                if clearance[row, column] <= best:
                    continue
                there_x, there_y = (column + 0.5) * step, (row + 0.5) * step
                away = math.hypot(there_x - x, there_y - y)
                score = min(float(clearance[row, column]), enough) - 0.1 * away
                if score > best:
                    best = score
                    moved[index, 0], moved[index, 1] = left + there_x, low + there_y
    return moved
