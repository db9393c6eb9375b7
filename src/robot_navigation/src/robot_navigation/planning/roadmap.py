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

import heapq
import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, TypeAlias

import numpy as np
from scipy import ndimage

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

    from hive_common.geometry import Array, Indices
    from robot_navigation.planning.clearance import ClearanceField, Disc
    from robot_navigation.planning.path import Point

Neighbours: TypeAlias = "list[list[tuple[int, float]]]"
"""For each landmark, those it is joined to and their distances [m]."""

ARC = math.radians(30)
"""Angle between neighbouring landmarks around a corner [rad]; makes paths at most 1 % longer."""

GRAZE = math.sin(math.radians(30))
"""Sine of the angle by which a path may differ from a tangent of the circle around a corner."""

MIN_CORNER = math.radians(20)
"""Corners that turn by less are walls that the grid draws as steps [rad]."""

PAIRS_AT_ONCE = 100_000  # lines checked at once; bounds the memory for a large map


@dataclass(frozen=True)
class Landmarks:
    """Places where a shortest path may bend."""

    at: Array  # (n, 2) array, frame map [m]
    outward: Array  # (n, 2) array of unit vectors, away from the corner that the path bends around

    def __add__(self, other: Landmarks) -> Landmarks:
        """Return these, then the others."""
        return Landmarks(np.vstack([self.at, other.at]), np.vstack([self.outward, other.outward]))

    def touched_by(self, which: Indices, lines: Array) -> NDArray[np.bool_]:
        """Return whether lines touch the circles around the corners instead of cutting them.

        `lines` (n, 2) are vectors that start or end at the landmarks `which` (n,) [m].
        """
        along = np.abs(np.einsum("ij,ij->i", lines, self.outward[which]))
        touching: NDArray[np.bool_] = along <= GRAZE * np.hypot(lines[:, 0], lines[:, 1])
        return touching


class Roadmap:
    """The landmarks of one map for one size of robot, and the straight lines between them."""

    def __init__(self, field: ClearanceField, need: float) -> None:
        self.need = need  # clearance that the robot needs [m]
        self._landmarks = _corner_landmarks(field, need)
        pairs = np.triu_indices(len(self._landmarks.at), k=1)
        self._pairs = _clear_pairs(field, self._landmarks, need, pairs)
        self._neighbours = _joined(self._landmarks, self._pairs)

    def path(
        self, start: Point, goal: Point, field: ClearanceField, discs: Sequence[Disc] = ()
    ) -> list[Point] | None:
        """Return a short path through the landmarks, or None if they hold none.

        `field` holds the clearances of the map with the discs, obstacles that are not on the map.
        """
        if field.line_is_clear(start, goal, self.need):
            return [start, goal]
        landmarks, neighbours = self._landmarks, self._neighbours
        if discs:
            landmarks, neighbours = self._with_discs(field, discs)
        from_start = _visible(start, field, self.need, landmarks)
        to_goal = _visible(goal, field, self.need, landmarks)
        ahead = np.hypot(*(landmarks.at - np.array(goal)).T).tolist()
        chain = _a_star(from_start, to_goal, ahead, neighbours)
        if chain is None:
            return None
        return [start, *((float(x), float(y)) for x, y in landmarks.at[chain]), goal]

    def _with_discs(
        self, field: ClearanceField, discs: Sequence[Disc]
    ) -> tuple[Landmarks, Neighbours]:
        """Return the graph with landmarks around discs, and without the lines that they block."""
        known = len(self._landmarks.at)
        landmarks = self._landmarks + _disc_landmarks(field, discs, self.need)
        fresh = len(landmarks.at) - known
        old, new = np.divmod(np.arange(len(landmarks.at) * fresh), max(1, fresh))
        new += known
        pairs = (old[old < new], new[old < new])
        added = _joined(landmarks, _clear_pairs(field, landmarks, self.need, pairs))
        # Most neighbours stay as they are; only those that change are copied.
        neighbours = [*self._neighbours, *([] for _ in range(fresh))]
        for a, b in self._blocked(field, discs):
            neighbours[a] = [(node, length) for node, length in neighbours[a] if node != b]
            neighbours[b] = [(node, length) for node, length in neighbours[b] if node != a]
        for node, more in enumerate(added):
            if more:
                neighbours[node] = neighbours[node] + more
        return landmarks, neighbours

    def _blocked(self, field: ClearanceField, discs: Sequence[Disc]) -> list[tuple[int, int]]:
        """Return the pairs of landmarks that discs separate."""
        begin, end = (self._landmarks.at[part] for part in self._pairs)
        near = np.zeros(len(begin), dtype=bool)
        for disc in discs:
            reach = disc.radius + self.need + 2 * field.grid.resolution
            near |= _away_from_lines(np.array([disc.x, disc.y]), begin, end) < reach
        clear = field.lines_are_clear(begin[near], end[near], self.need)
        first, second = (part[near][~clear].tolist() for part in self._pairs)
        return list(zip(first, second, strict=True))


def _visible(
    point: Point, field: ClearanceField, need: float, landmarks: Landmarks
) -> dict[int, float]:
    """Return the landmarks that a robot can drive straight to, with their distances [m]."""
    lines = landmarks.at - np.array(point)
    touched = np.flatnonzero(landmarks.touched_by(np.arange(len(lines)), lines))
    starts = np.repeat([point], len(touched), axis=0)
    visible = touched[field.lines_are_clear(starts, landmarks.at[touched], need)]
    lengths = np.hypot(*lines[visible].T)
    return dict(zip(visible.tolist(), lengths.tolist(), strict=True))


def _a_star(
    starts: dict[int, float],
    goals: dict[int, float],
    ahead: list[float],
    neighbours: Neighbours,
) -> list[int] | None:
    """Return the landmarks of the shortest path, or None.

    Args:
        starts: Landmarks visible from the start, with their distances from it [m].
        goals: Landmarks visible from the goal, with their distances to it [m].
        ahead: Straight-line distance of every landmark to the goal [m].
        neighbours: The graph.
    """
    best = dict(starts)
    came: dict[int, int] = {}
    queue = [(cost + ahead[node], node) for node, cost in starts.items()]
    heapq.heapify(queue)
    done: set[int] = set()
    end, end_cost = -1, math.inf
    while queue and queue[0][0] < end_cost:
        _, node = heapq.heappop(queue)
        if node in done:
            continue
        done.add(node)
        cost = best[node]
        if node in goals and cost + goals[node] < end_cost:
            end, end_cost = node, cost + goals[node]
        for other, length in neighbours[node]:
            if cost + length < best.get(other, math.inf):
                best[other] = cost + length
                came[other] = node
                heapq.heappush(queue, (cost + length + ahead[other], other))
    if end < 0:
        return None
    chain = [end]
    while chain[-1] in came:
        chain.append(came[chain[-1]])
    return chain[::-1]


def _away_from_lines(point: Array, begin: Array, end: Array) -> Array:
    """Return the distances of a point from straight lines, (n,) array [m]."""
    line = end - begin
    along = np.einsum("ij,ij->i", point - begin, line) / np.einsum("ij,ij->i", line, line)
    nearest = begin + np.clip(along, 0.0, 1.0)[:, None] * line
    return np.asarray(np.hypot(*(point - nearest).T))


def _joined(landmarks: Landmarks, pairs: tuple[Indices, Indices]) -> Neighbours:
    """Return the graph in which these pairs are joined."""
    neighbours: Neighbours = [[] for _ in range(len(landmarks.at))]
    lengths = np.hypot(*(landmarks.at[pairs[0]] - landmarks.at[pairs[1]]).T)
    for a, b, length in zip(*(array.tolist() for array in (*pairs, lengths)), strict=True):
        neighbours[a].append((b, length))
        neighbours[b].append((a, length))
    return neighbours


def _clear_pairs(
    field: ClearanceField, landmarks: Landmarks, need: float, pairs: tuple[Indices, Indices]
) -> tuple[Indices, Indices]:
    """Return the pairs of landmarks between which a shortest path may run straight."""
    kept = []
    for low in range(0, len(pairs[0]), PAIRS_AT_ONCE):
        first, second = (part[low : low + PAIRS_AT_ONCE] for part in pairs)
        lines = landmarks.at[second] - landmarks.at[first]
        touching = landmarks.touched_by(first, lines) & landmarks.touched_by(second, lines)
        first, second = first[touching], second[touching]
        clear = field.lines_are_clear(landmarks.at[first], landmarks.at[second], need)
        kept.append((first[clear], second[clear]))
    if not kept:
        return pairs
    return np.concatenate([a for a, _ in kept]), np.concatenate([b for _, b in kept])


def _corner_landmarks(field: ClearanceField, need: float) -> Landmarks:
    """Return landmarks around the convex corners of the map, at the clearance a robot needs."""
    grid = field.grid
    step = grid.resolution
    # The chord between two landmarks must still keep `need` from the corner.
    radius = need / math.cos(ARC / 2)
    ring = (field.clearance >= radius) & (field.clearance < radius + 1.5 * step)
    nearest = ndimage.distance_transform_edt(
        ~grid.blocked, return_distances=False, return_indices=True
    )
    rows, columns = np.nonzero(ring)
    at_row, at_column = nearest[0][ring], nearest[1][ring]
    owner = at_row.astype(np.int64) * grid.blocked.shape[1] + at_column
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


def _disc_landmarks(field: ClearanceField, discs: Sequence[Disc], need: float) -> Landmarks:
    """Return the free landmarks around discs, one every `ARC`."""
    angles = np.arange(0.0, 2 * math.pi, ARC)
    circle = np.column_stack([np.cos(angles), np.sin(angles)])
    slack = 1.5 * field.grid.resolution
    rings = [
        np.array([disc.x, disc.y]) + circle * ((disc.radius + need) / math.cos(ARC / 2) + slack)
        for disc in discs
    ]
    at = np.vstack([np.empty((0, 2)), *rings])
    free = field.at_points(at) >= need
    return Landmarks(at[free], np.tile(circle, (len(rings), 1))[free])
