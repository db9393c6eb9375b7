# SPDX-License-Identifier: BSD-3-Clause
"""What robots announce, sorted by place: a robot asks only for those that it may meet.

A spatial grid: each announcement is filed under the squares that its robot, or the path it
announces, comes near. All robots of one process may share one neighbourhood.
"""

from __future__ import annotations

import itertools
import math
from typing import TYPE_CHECKING

from robot_navigation.traffic.right_of_way import GAP

if TYPE_CHECKING:
    from collections.abc import Iterable, Sequence

    from robot_navigation.planning.path import Point
    from robot_navigation.traffic.right_of_way import Announcement

    Square = tuple[int, int]

SIDE = 3.0  # of a square [m]
SLACK = 0.01  # how much nearer than needed counts as near, against rounding [m]
MOST = 1000  # an announcement that covers more squares is filed under `ANYWHERE`
ANYWHERE: Square = (0, 0)  # is near every place as well as a square of its own


class Neighbourhood:
    """The latest announcement of every robot."""

    def __init__(self) -> None:
        self._heard: dict[str, Announcement] = {}
        self._order: dict[str, int] = {}
        self._squares: dict[str, set[Square]] = {}
        self._names: dict[Square, set[str]] = {}

    def hear(self, announcement: Announcement) -> None:
        """Take in what a robot announces, in place of what it said before."""
        name = announcement.name
        squares = _near_path(announcement)
        before = self._squares.get(name, set())
        if squares != before:
            for square in before - squares:
                self._names[square].discard(name)
            for square in squares - before:
                self._names.setdefault(square, set()).add(name)
            self._squares[name] = squares
        self._order.setdefault(name, len(self._order))
        self._heard[name] = announcement

    def everyone(self) -> Iterable[Announcement]:
        """Return all announcements, in the order in which the robots were first heard."""
        return self._heard.values()

    def near(self, me: Announcement, reach: float) -> list[Announcement]:
        """Return those within `reach` [m] of a robot, and whose paths it may meet, and a few more.

        They are in the same order as `everyone`; the robot itself is left out.
        """
        squares = _near_path(me) | _around([(me.x, me.y)] * 2, reach) | {ANYWHERE}
        names: set[str] = set().union(*map(self._names.get, squares & self._names.keys()))  # type: ignore[arg-type]  # only known squares
        names.discard(me.name)
        return [self._heard[name] for name in sorted(names, key=self._order.__getitem__)]


def _near_path(announcement: Announcement) -> set[Square]:
    """Return the squares that a robot or its announced path comes near.

    Two robots that must keep apart somewhere share a square.
    """
    points = [(announcement.x, announcement.y), *announcement.path]
    return _around(points, announcement.radius + GAP / 2 + SLACK)


def _around(points: Sequence[Point], reach: float) -> set[Square]:
    """Return the squares within `reach` [m] of a polyline, and a few more."""
    squares: set[Square] = set()
    for (ax, ay), (bx, by) in itertools.pairwise(points):
        left, right = math.floor((min(ax, bx) - reach) / SIDE), (max(ax, bx) + reach) / SIDE
        low, high = math.floor((min(ay, by) - reach) / SIDE), (max(ay, by) + reach) / SIDE
        if (right - left) * (high - low) > MOST:
            return {ANYWHERE}
        squares.update(
            itertools.product(range(left, math.floor(right) + 1), range(low, math.floor(high) + 1))
        )
    return squares
