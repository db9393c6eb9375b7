# SPDX-License-Identifier: BSD-3-Clause
"""The Voronoi diagram of places on a map: which place is nearest to each cell, and by which way.

Ways lead over the free cells of the map and cost least where they keep away from walls. The map is
worked on strip by strip, because the tables of a whole map of 200 m take a gigabyte. A way that
costs so much crosses at most so many cells, so a strip needs no more rows around it than that.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from hive_common.compiled import compiled
from hive_common.distances import strips

if TYPE_CHECKING:
    from collections.abc import Iterator

    from numpy.typing import NDArray

    from hive_common.geometry import Array, Indices
    from hive_navigation.planning.lines import Cells

NARROW = 0.3
"""Ways keep to the middle where the room beyond the need is less than this [m]."""

AT_WALL = 5.0  # cost of a cell at a wall; one in the open costs 1
BUCKETS = 8  # more than the dearest cell costs, and one
REACH = 64  # cells around a strip that are looked at first, usually enough
ENOUGH = 512  # a cell that no place so far away reaches belongs to none


class Meetings(NamedTuple):
    """Neighbouring cells of different places, at which the ways from these meet.

    Attributes:
        cells: (n, 2) numbers of the cells, row by row.
        places: (n, 2) the places that they belong to.
        costs: (n,) of the way from one place to the other.
    """

    cells: Indices
    places: Indices
    costs: Array


class Voronoi:
    """The Voronoi diagram of some places.

    Args:
        clearance: (rows, columns), see `planning.lines`.
        inside: (rows, columns), which cells ways lead over.
        need: The clearance of a robot that would drive there [m].
        starts: (n,) numbers of the cells that the places are in, row by row.
        names: (n,) numbers of the places.
    """

    def __init__(
        self,
        clearance: Cells,
        inside: NDArray[np.bool_],
        need: float,
        starts: Indices,
        names: Indices,
    ) -> None:
        self._clearance, self._inside, self._need = clearance, inside, need
        self._rows, self._columns = np.divmod(starts.astype(np.int64), clearance.shape[1])
        self._names = names.astype(np.int64)

    def meetings(self, group: Indices) -> Meetings:
        """Return where the ways of different groups of places meet.

        For each two groups where the way between them costs least, the cheapest one first.

        Args:
            group: The group of each place, by its number.
        """
        parts = [_cheapest(part, group) for part in self._all_meetings(group)]
        joined = Meetings(*(np.concatenate(each) for each in zip(*parts, strict=True)))
        return _cheapest(joined, group)

    def way(self, one: int, other: int) -> list[int]:
        """Return the cells from the place of a cell, over this and its neighbour, to its place."""
        row, column = divmod(min(one, other), self._clearance.shape[1])
        window = (slice(row, row + 2), slice(column, column + 2))
        top, left, came = self._grown(window)[:3]
        wide = came.shape[1]

        def traced(cell: int) -> list[int]:
            found = []
            row, column = divmod(cell, self._clearance.shape[1])
            here = (row - top) * wide + column - left
            while here >= 0:
                found.append((here // wide + top) * self._clearance.shape[1] + here % wide + left)
                here = int(came.flat[here])
            return found

        return [*reversed(traced(one)), *traced(other)]

    def _all_meetings(self, group: Indices) -> Iterator[Meetings]:
        columns = self._clearance.shape[1]
        for strip, _ in strips(self._inside, REACH):
            # The strip's last row meets the next strip's first.
            rows = slice(strip.start, min(strip.stop + 1, len(self._clearance)))
            top, _, _, owner, cost = self._grown((rows, slice(0, columns)))
            owner = owner[rows.start - top : rows.stop - top]
            cost = cost[rows.start - top : rows.stop - top]
            index = np.arange(rows.start * columns, rows.stop * columns).reshape(owner.shape)
            high = strip.stop - strip.start
            for one, other in (
                (np.s_[:high, :-1], np.s_[:high, 1:]),
                (np.s_[:-1, :], np.s_[1:, :]),
            ):
                meet = (owner[one] != owner[other]) & (owner[one] >= 0) & (owner[other] >= 0)
                meet[meet] = group[owner[one][meet]] != group[owner[other][meet]]
                yield Meetings(
                    np.column_stack([index[one][meet], index[other][meet]]),
                    np.column_stack([owner[one][meet], owner[other][meet]]),
                    cost[one][meet] + cost[other][meet],
                )

    def _grown(self, window: tuple[slice, slice]) -> tuple[int, int, Indices, Indices, Array]:
        """Return the diagram of a part of the map that is at least as large as a window.

        It is right in the window.

        Returns:
            Its first row and first column; (rows, columns) the cell before each on the way from
            its place, numbered row by row, or -1; the place that each belongs to; and the cost.
        """
        height, width = self._clearance.shape
        reach = REACH
        while True:
            top, left = (max(0, side.start - reach) for side in window)
            bottom, right = min(height, window[0].stop + reach), min(width, window[1].stop + reach)
            part = (slice(top, bottom), slice(left, right))
            inside = np.ascontiguousarray(self._inside[part])
            here = (
                (self._rows >= top)
                & (self._rows < bottom)
                & (self._columns >= left)
                & (self._columns < right)
            )
            starts = (self._rows[here] - top) * (right - left) + self._columns[here] - left
            clearance = np.ascontiguousarray(self._clearance[part])
            owner, came, cost = grown(clearance, inside, self._need, starts, self._names[here])
            inner = tuple(
                slice(side.start - first, side.stop - first)
                for side, first in zip(window, (top, left), strict=True)
            )
            reached = owner[inner] >= 0
            is_right = cost[inner].max(initial=0.0, where=reached) <= reach
            # A cell that touches the others at a corner only belongs to no place at all.
            has_all = reach >= ENOUGH or bool(reached[inside[inner]].all())
            if (is_right and has_all) or part == (slice(0, height), slice(0, width)):
                return top, left, came, owner, cost
            reach *= 2


def _cheapest(meetings: Meetings, group: Indices) -> Meetings:
    """Return the cheapest meeting of each two groups, the cheapest one first."""
    order = np.argsort(meetings.costs, kind="stable")
    pairs = np.sort(group[meetings.places[order]], axis=1)
    first = np.sort(np.unique(pairs, axis=0, return_index=True)[1])
    kept = order[first]
    return Meetings(*(each[kept] for each in meetings))


@compiled("void(int64[::1], int64[:, ::1], int64[::1], int64, int64)")
def _put(heads: Indices, entries: Indices, state: Indices, bucket: int, cell: int) -> None:
    """Put a cell into a bucket.

    A bucket is a linked list: `heads` (BUCKETS,) are the numbers of the first entries, `entries`
    (2, n) the cells and the next entries, -1 at the end. `state` is the first entry that was used
    before, that was never used, and the number of those in use.
    """
    entry = state[0]
    if entry < 0:
        entry = state[1]
        state[1] += 1
    else:
        state[0] = entries[1, entry]
    entries[0, entry], entries[1, entry] = cell, heads[bucket]
    heads[bucket] = entry
    state[2] += 1


@compiled("int64(int64[::1], int64[:, ::1], int64[::1], int64)")
def _taken(heads: Indices, entries: Indices, state: Indices, bucket: int) -> int:
    """Take a cell from a bucket that is not empty, and return it."""
    entry = heads[bucket]
    heads[bucket] = entries[1, entry]
    entries[1, entry] = state[0]
    state[0] = entry
    state[2] -= 1
    return int(entries[0, entry])


@compiled(
    "Tuple((int64[:, ::1], int64[:, ::1], float64[:, ::1]))(float32[:, ::1], boolean[:, ::1],"
    " float64, int64[::1], int64[::1])"
)
def grown(
    clearance: Cells, inside: NDArray[np.bool_], need: float, starts: Indices, names: Indices
) -> tuple[Indices, Indices, Array]:
    """Return whose start is nearest to each cell, from where it was reached, and at what cost.

    Cells are numbered row by row; -1 is none. Among cells from which a cell is reached at the same
    cost, the one that costs least counts, then the first.

    This is Dijkstra's algorithm with buckets (R. Dial, "Algorithm 360", Communications of the ACM
    12, 1969): no cell costs less than a bucket is wide, so the cells of a bucket are settled.
    """
    rows, columns = clearance.shape
    owner = np.full(rows * columns, -1, dtype=np.int64)
    came = np.full(rows * columns, -1, dtype=np.int64)
    cost = np.full(rows * columns, np.inf)
    done = ~inside.ravel()
    heads = np.full(BUCKETS, -1, dtype=np.int64)
    entries = np.empty((2, len(starts) + 1024), dtype=np.int64)
    state = np.array([-1, 0, 0], dtype=np.int64)
    for start, name in zip(starts, names):  # noqa: B905  (numba has no strict)
        owner[start], cost[start], done[start] = name, 0.0, False
        _put(heads, entries, state, 0, start)
    level = 0
    while state[2] > 0:
        if heads[level % BUCKETS] < 0:
            level += 1
            continue
        cell = _taken(heads, entries, state, level % BUCKETS)
        if done[cell]:
            continue
        done[cell] = True
        if state[1] + 4 > entries.shape[1]:
            entries = np.concatenate((entries, np.empty_like(entries)), axis=1)
        row, column = divmod(cell, columns)
        for down, right in ((-1, 0), (1, 0), (0, -1), (0, 1)):
            there = cell + down * columns + right
            is_on_map = 0 <= row + down < rows and 0 <= column + right < columns
            if not is_on_map or done[there]:
                continue
            spare = min(max(clearance[row + down, column + right] - need, 0.0), NARROW)
            further = cost[cell] + 1.0 + (AT_WALL - 1.0) * (1.0 - spare / NARROW)
            if further < cost[there]:
                _put(heads, entries, state, int(further) % BUCKETS, there)
            elif further > cost[there] or (cost[cell], cell) >= (cost[came[there]], came[there]):
                continue
            cost[there], owner[there], came[there] = further, owner[cell], cell
    shape = (rows, columns)
    return owner.reshape(shape), came.reshape(shape), cost.reshape(shape)
