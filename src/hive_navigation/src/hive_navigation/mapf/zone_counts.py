# SPDX-License-Identifier: BSD-3-Clause
"""Keeps the number of robots in a zone within its limit while a plan is made.

While a zone is full, all of it is reserved, so that no other robot is planned to be in it.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

    from hive_common.geometry import Indices
    from hive_navigation.mapf.path_search import Path
    from hive_navigation.mapf.reservations import Reservations

FIRST = -2  # the number of the first zone among those who reserve; robots have 0 and more

Span = tuple[float, float]


class ZoneCounts:
    """Who is in which zone, when."""

    def __init__(
        self,
        reservations: Reservations,
        things: Sequence[Indices],
        actions: Sequence[Indices],
        most: Sequence[int],
    ) -> None:
        """Begin with nobody in any zone.

        Args:
            reservations: Of the plan.
            things: For each zone, the numbers of its places and ways.
            actions: For each zone, the numbers of what robots do in it; see `conflicts`.
            most: How many robots may be in each zone.
        """
        self._reservations = reservations
        self._things = things
        self._actions = actions
        self._most = most
        self._stays: list[dict[int, list[Span]]] = [{} for _ in most]

    def put(self, robot: int, path: Path) -> None:
        """Take in what a robot does."""
        for zone, actions in enumerate(self._actions):
            spans = stays(path, np.isin(path.actions, actions))
            if spans:
                self._stays[zone][robot] = spans
                self._reserve(zone)

    def stay(self, who: int, blocked: Indices, until: float) -> None:
        """Take in that somebody who is not planned blocks things, (k,), until some time [s]."""
        for zone, things in enumerate(self._things):
            if np.isin(blocked, things).any():
                self._stays[zone].setdefault(who, []).append((-math.inf, until))
                self._reserve(zone)

    def take(self, robot: int) -> None:
        """Forget what a robot was to do."""
        for zone, stays_ in enumerate(self._stays):
            if stays_.pop(robot, None) is not None:
                self._reserve(zone)

    def _reserve(self, zone: int) -> None:
        """Reserve a zone while it is full."""
        things, reservations = self._things[zone], self._reservations
        spans = [span for each in self._stays[zone].values() for span in each]
        for size in range(len(reservations.heads)):
            reservations.unblock(FIRST - zone, size, things)
            for begin, end in full(spans, self._most[zone]):
                reservations.block(FIRST - zone, size, things, begin, end)


def stays(path: Path, inside: NDArray[np.bool_]) -> list[Span]:
    """Return from when to when a robot is in a zone, by which of its actions are in it [s]."""
    spans: list[Span] = []
    for index in np.flatnonzero(inside).tolist():
        begin, end = path.times[index].tolist()
        if spans and spans[-1][1] >= begin:
            spans[-1] = spans[-1][0], end
        else:
            spans.append((begin, end))
    return spans


def full(spans: Sequence[Span], most: int) -> list[Span]:
    """Return when `most` spans or more overlap [s]."""
    events = sorted([(begin, 1) for begin, _ in spans] + [(end, -1) for _, end in spans])
    found: list[Span] = []
    count, since = 0, -math.inf
    for time, change in events:
        if count < most <= count + change:
            since = time
        elif count >= most > count + change and time > since:
            found.append((since, time))
        count += change
    return found
