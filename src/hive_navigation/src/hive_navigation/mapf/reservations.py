# SPDX-License-Identifier: BSD-3-Clause
"""When which place and way of a roadmap is blocked for robots of each size, and by whom.

For each size and each place or way there is a list of spans of time, in the order in which they
begin. What is between them are its safe intervals. Spans are half-open: one robot may begin where
another one ends.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from hive_common.compiled import compiled

if TYPE_CHECKING:
    from collections.abc import Sequence

    from hive_common.geometry import Array, Indices
    from hive_navigation.mapf.conflicts import Conflicts

FIRST_SPANS = 4096  # the pool of spans grows when it is full
NOBODY = -1


class Reservations:
    """Who blocks what, when.

    Attributes:
        heads: (sizes, k) array: the first span of each place and way, -1 for none.
        spans: (c, 2) array, from and to [s].
        links: (c, 2) array, the next span of the same list, -1 for none, and whose it is.
    """

    def __init__(
        self, things: int, conflicts: Sequence[Sequence[tuple[Conflicts, Conflicts]]]
    ) -> None:
        """Start with everything free.

        Args:
            things: How many there are.
            conflicts: What a robot of the first size blocks for one of the second: on the
                roadmap, and what is more with the ends of the plan.
        """
        self._conflicts = conflicts
        self.heads: Indices = np.full((len(conflicts), things), -1, dtype=np.intp)
        self.spans: Array = np.empty((FIRST_SPANS, 2))
        self.links: Indices = np.empty((FIRST_SPANS, 2), dtype=np.intp)
        self._free = np.array([0, -1], dtype=np.intp)  # spans in use, head of those given back

    @classmethod
    def like(cls, other: Reservations) -> Reservations:
        """Return reservations of the same things for the same sizes, with everything free."""
        return cls(other.heads.shape[1], other._conflicts)

    def add(self, who: int, size: int, actions: Indices, times: Array) -> None:
        """Reserve what a robot blocks.

        Args:
            who: Number of the robot.
            size: Number of its size.
            actions: (k,) what it does one after the other; see `Conflicts`.
            times: (k, 2) from when to when [s].
        """
        for other, (fixed, more) in enumerate(self._conflicts[size]):
            self._grow(len(actions) * (fixed.most + more.most))
            add_spans(
                self.heads[other],
                self.spans,
                self.links,
                self._free,
                who,
                actions,
                times,
                fixed.begins,
                fixed.blocked,
                more.begins,
                more.blocked,
            )

    def remove(self, who: int, size: int, actions: Indices) -> None:
        """Free what a robot blocked with what it was to do."""
        for other, (fixed, more) in enumerate(self._conflicts[size]):
            for table, rows in (
                (fixed, actions[actions < len(fixed.begins) - 1]),
                (more, actions),
            ):
                remove_spans(
                    self.heads[other],
                    self.links,
                    self._free,
                    who,
                    rows,
                    table.begins,
                    table.blocked,
                )

    def block(self, who: int, size: int, things: Indices, begin: float, end: float) -> None:
        """Reserve some places and ways (k,) for robots of one size.

        Args:
            who: Number of the robot.
            size: Number of the size for which they are blocked.
            things: Their numbers.
            begin: From when [s].
            end: Until when [s].
        """
        self._grow(len(things))
        lists = self.heads[size], self.spans, self.links, self._free
        block_things(*lists, who, things, begin, end)

    def unblock(self, who: int, size: int, things: Indices) -> None:
        """Free what `block` reserved."""
        count = len(things)
        remove_spans(
            self.heads[size],
            self.links,
            self._free,
            who,
            np.arange(count),
            np.arange(count + 1),
            things,
        )

    def blocked_by(self, who: int, sizes: Indices, things: Indices) -> Array:
        """Return when a robot blocks each of some things first [s], (k,); infinite for never."""
        return first_blocked(self.heads, self.spans, self.links, who, sizes, things)

    def are_free(self, size: int, things: Indices, times: Array) -> bool:
        """Return whether some things (k,) are free during times (k, 2) [s]."""
        return bool(all_free(self.heads[size], self.spans, self.links, things, times))

    def blockers(self, size: int, things: Indices, times: Array) -> Indices:
        """Return who blocks any of some things (k,) during times (k, 2) [s]."""
        return np.unique(all_blockers(self.heads[size], self.spans, self.links, things, times))

    def free_from(self, size: int) -> Array:
        """Return from when on each thing is free for ever for robots of a size [s]."""
        found: Array = last_blocked(self.heads[size], self.spans, self.links)
        return found

    def blocked(self, size: int, other: int, actions: Indices) -> tuple[Indices, Indices]:
        """Return what robots of one size block for those of another one.

        Args:
            size: Number of the size of those that act.
            other: Number of the size of the others.
            actions: (k,) what they do; see `Conflicts`.

        Returns:
            Rows of `actions`, and what each of them blocks.
        """
        rows, things = [], []
        fixed, more = self._conflicts[size][other]
        for table, used in (
            (fixed, np.flatnonzero(actions < len(fixed.begins) - 1)),
            (more, np.arange(len(actions))),
        ):
            begins, ends = table.begins[actions[used]], table.begins[actions[used] + 1]
            row = np.repeat(used, ends - begins)
            within = np.arange(len(row)) - np.repeat(np.cumsum(ends - begins), ends - begins)
            rows.append(row)
            things.append(table.blocked[np.repeat(ends, ends - begins) + within])
        return np.concatenate(rows), np.concatenate(things)

    def _grow(self, need: int) -> None:
        """Make room for this many spans more."""
        if self._free[0] + need > len(self.spans):
            more = max(len(self.spans), need)
            self.spans = np.vstack([self.spans, np.empty((more, 2))])
            self.links = np.vstack([self.links, np.empty((more, 2), dtype=np.intp)])


@compiled(
    "void(int64[::1], float64[:, ::1], int64[:, ::1], int64[::1], int64, int64, float64, float64)"
)
def _insert(
    heads: Indices,
    spans: Array,
    links: Indices,
    free: Indices,
    who: int,
    thing: int,
    begin: float,
    end: float,
) -> None:
    """Add a span to the list of a thing; what somebody blocks without a break is one span."""
    before = -1
    at = heads[thing]
    while at >= 0 and spans[at, 0] <= begin:
        if links[at, 1] == who and spans[at, 1] >= begin - 1e-9:
            spans[at, 1] = max(spans[at, 1], end)
            return
        before = at
        at = links[at, 0]
    if free[1] >= 0:
        new = free[1]
        free[1] = links[new, 0]
    else:
        new = free[0]
        free[0] += 1
    spans[new, 0], spans[new, 1] = begin, end
    links[new, 0], links[new, 1] = at, who
    if before < 0:
        heads[thing] = new
    else:
        links[before, 0] = new


@compiled(
    "void(int64[::1], float64[:, ::1], int64[:, ::1], int64[::1], int64, int64[::1],"
    " float64[:, ::1], int64[::1], int64[::1], int64[::1], int64[::1])"
)
def add_spans(
    heads: Indices,
    spans: Array,
    links: Indices,
    free: Indices,
    who: int,
    actions: Indices,
    times: Array,
    begins: Indices,
    blocked: Indices,
    more_begins: Indices,
    more_blocked: Indices,
) -> None:
    """Add what a robot blocks; see `Reservations.add`."""
    for k in range(len(actions)):
        begin, end = times[k, 0], times[k, 1]
        known = 0
        if actions[k] < len(begins) - 1:
            known = begins[actions[k] + 1] - begins[actions[k]]
        more = more_begins[actions[k] + 1] - more_begins[actions[k]]
        for item in range(known + more):
            if item < known:
                thing = blocked[begins[actions[k]] + item]
            else:
                thing = more_blocked[more_begins[actions[k]] + item - known]
            _insert(heads, spans, links, free, who, thing, begin, end)


@compiled(
    "void(int64[::1], float64[:, ::1], int64[:, ::1], int64[::1], int64, int64[::1], float64,"
    " float64)"
)
def block_things(
    heads: Indices,
    spans: Array,
    links: Indices,
    free: Indices,
    who: int,
    things: Indices,
    begin: float,
    end: float,
) -> None:
    """Add that somebody blocks some things for a time; see `Reservations.block`."""
    for thing in things:
        _insert(heads, spans, links, free, who, thing, begin, end)


@compiled("void(int64[::1], int64[:, ::1], int64[::1], int64, int64[::1], int64[::1], int64[::1])")
def remove_spans(
    heads: Indices,
    links: Indices,
    free: Indices,
    who: int,
    actions: Indices,
    begins: Indices,
    blocked: Indices,
) -> None:
    """Remove what a robot blocked; see `Reservations.remove`."""
    for action in actions:
        for item in range(begins[action], begins[action + 1]):
            thing = blocked[item]
            before = -1
            at = heads[thing]
            while at >= 0:
                after = links[at, 0]
                if links[at, 1] == who:
                    if before < 0:
                        heads[thing] = after
                    else:
                        links[before, 0] = after
                    links[at, 0] = free[1]
                    free[1] = at
                else:
                    before = at
                at = after


@compiled(
    "float64[::1](int64[:, ::1], float64[:, ::1], int64[:, ::1], int64, int64[::1], int64[::1])"
)
def first_blocked(
    heads: Indices, spans: Array, links: Indices, who: int, sizes: Indices, things: Indices
) -> Array:
    """Return when a robot blocks each of some things first; see `Reservations.blocked_by`."""
    when = np.full(len(things), np.inf)
    for k in range(len(things)):
        at = heads[sizes[k], things[k]]
        while at >= 0:
            if links[at, 1] == who:
                when[k] = spans[at, 0]
                break
            at = links[at, 0]
    return when


@compiled("float64[::1](int64[::1], float64[:, ::1], int64[:, ::1])")
def last_blocked(heads: Indices, spans: Array, links: Indices) -> Array:
    """Return from when on each thing is free for ever; see `Reservations.free_from`."""
    free = np.full(len(heads), -np.inf)
    for thing in range(len(heads)):
        at = heads[thing]
        while at >= 0:
            free[thing] = max(free[thing], spans[at, 1])
            at = links[at, 0]
    return free


@compiled("boolean(int64[::1], float64[:, ::1], int64[:, ::1], int64[::1], float64[:, ::1])")
def all_free(heads: Indices, spans: Array, links: Indices, things: Indices, times: Array) -> bool:
    """Return whether things are free during times; see `Reservations.are_free`."""
    for k in range(len(things)):
        at = heads[things[k]]
        while at >= 0 and spans[at, 0] < times[k, 1] - 1e-9:
            if spans[at, 1] > times[k, 0] + 1e-9:
                return False
            at = links[at, 0]
    return True


@compiled("int64[::1](int64[::1], float64[:, ::1], int64[:, ::1], int64[::1], float64[:, ::1])")
def all_blockers(
    heads: Indices, spans: Array, links: Indices, things: Indices, times: Array
) -> Indices:
    """Return who blocks things during times, some more than once; see `Reservations.blockers`."""
    found = np.empty(64, dtype=np.int64)
    count = 0
    for k in range(len(things)):
        at = heads[things[k]]
        while at >= 0 and spans[at, 0] < times[k, 1] - 1e-9:
            if spans[at, 1] > times[k, 0] + 1e-9:
                if count == len(found):
                    more = np.empty(2 * count, dtype=np.int64)
                    more[:count] = found
                    found = more
                found[count] = links[at, 1]
                count += 1
            at = links[at, 0]
    return found[:count]
