# SPDX-License-Identifier: BSD-3-Clause
"""What takes up space off the roadmap, and which places and ways that blocks."""

from __future__ import annotations

from itertools import pairwise
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from hive_navigation.mapf.conflicts import Lines
from hive_navigation.mapf.segments import segments_apart

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from numpy.typing import NDArray

    from hive_common.geometry import Array, Indices
    from hive_navigation.mapf.ends import Ends

ROUNDING = 1e-6  # [m]


class Body(NamedTuple):
    """What takes up space off the roadmap.

    Attributes:
        radius: Of the circle around it [m].
        track: x, y [m, frame map], and when it has left each point behind [s].
    """

    radius: float
    track: tuple[tuple[float, float, float], ...]


class Blocked(NamedTuple):
    """What a body blocks on one part of its track.

    Attributes:
        body: Its number.
        things: Numbers of places and ways.
        until: When it has passed them [s].
    """

    body: int
    things: Indices
    until: float


class Things:
    """All places and ways of a plan, as bodies may block them.

    A robot that begins too near to a body may leave it, as long as it comes no nearer.
    """

    def __init__(
        self, known: Lines, places: int, ends: Ends, where: Array, starts: Indices
    ) -> None:
        """Take them.

        Args:
            known: The ways and the places of the roadmap, in this order.
            places: How many places the roadmap has.
            ends: Of the plan.
            where: (n + e, 2) all places of the plan, frame map [m].
            starts: (k,) the place at which each robot begins.
        """
        count = len(ends.points)
        legs = np.hstack([where[ends.legs[:, 0]], where[ends.legs[:, 1]]])
        self._known = known
        self._ends = Lines(np.vstack([np.hstack([ends.points, ends.points]), legs]))
        self._begins = where[starts]
        self._stands = len(known) - places + starts
        by_place = np.full(places + count, -1, dtype=np.intp)
        by_place[starts] = np.arange(len(starts))
        owners = by_place[ends.legs[:, 0]]
        owners[ends.legs[:, 0] < places] = -1
        self._owners = np.concatenate([by_place[places:], owners])

    def blocked(self, bodies: Sequence[Body], radius: float, gap: float) -> Iterator[Blocked]:
        """Yield what bodies block for robots of a size.

        Args:
            bodies: The first ones are the robots themselves.
            radius: Of the robots of that size [m].
            gap: To keep between them and a body [m].
        """
        tracks = [list(pairwise(each.track)) or [(p, p) for p in each.track] for each in bodies]
        parts = [(number, *part) for number, track in enumerate(tracks) for part in track]
        if not parts:
            return
        lines = np.array([(*here[:2], *after[:2]) for _, here, after in parts])
        limits = np.array([bodies[number].radius + radius + gap for number, _, _ in parts])
        one, thing = self._known.near(lines, limits)
        other, end = self._ends.near(lines, limits)
        free = self._may_leave(other, end, lines, limits, np.array([part[0] for part in parts]))
        one = np.concatenate([one, other[~free]])
        thing = np.concatenate([thing, len(self._known) + end[~free]])
        kept = ~np.isin(thing, self._stands)
        one, thing = one[kept], thing[kept]
        order = np.argsort(one, kind="stable")
        begins = np.searchsorted(one[order], np.arange(len(parts) + 1))
        things = thing[order]
        for k, (number, _, after) in enumerate(parts):
            yield Blocked(number, things[begins[k] : begins[k + 1]], after[2])

    def _may_leave(
        self, part: Indices, end: Indices, lines: Array, limits: Array, bodies: Indices
    ) -> NDArray[np.bool_]:
        """Return which ends and legs (p,) robots may use though a body's track is too near."""
        free = np.zeros(len(part), dtype=np.bool_)
        owner = self._owners[end]
        for k in np.flatnonzero((owner >= 0) & (owner != bodies[part])):
            begin = self._begins[owner[k]]
            track = lines[part[k], :2], lines[part[k], 2:]
            between = segments_apart(begin, begin, *track)
            line = self._ends.lines[end[k]]
            nearest = segments_apart(line[:2], line[2:], *track)
            free[k] = between < limits[part[k]] and nearest > between - ROUNDING
        return free
