# SPDX-License-Identifier: BSD-3-Clause
"""What robots announce, sorted by place: a robot asks only for those that it may meet.

A spatial grid: each announcement is filed under the squares that its robot, or the path it
announces, comes near. All robots of one process may share one neighbourhood.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from robot_navigation.traffic.right_of_way import ANYWHERE, squares_around

if TYPE_CHECKING:
    from robot_navigation.traffic.right_of_way import Announcement, Square

NOWHERE: frozenset[Square] = frozenset()


class Neighbourhood:
    """The latest announcement of every robot."""

    def __init__(self) -> None:
        self._heard: dict[str, Announcement] = {}
        self._order: dict[str, int] = {}
        self._squares: dict[str, frozenset[Square]] = {}
        self._names: dict[Square, set[str]] = {}

    def hear(self, announcement: Announcement) -> None:
        """Take in what a robot announces, in place of what it said before."""
        name = announcement.name
        squares, before = announcement.squares, self._squares.get(name, NOWHERE)
        if squares != before:
            for square in before - squares:
                self._names[square].discard(name)
            for square in squares - before:
                self._names.setdefault(square, set()).add(name)
            self._squares[name] = squares
        self._order.setdefault(name, len(self._order))
        self._heard[name] = announcement

    def others(self, name: str, now: float, silence: float) -> list[Announcement]:
        """Return what all robots but one have announced in less than `silence` before now [s].

        They are in the order in which they were first heard.
        """
        return [
            other
            for other in self._heard.values()
            if other.name != name and now - other.time < silence
        ]

    def near(self, me: Announcement, reach: float, silence: float) -> list[Announcement]:
        """Return those of `others` that a robot may see or meet, and a few more.

        They are within `reach` of it [m], or their paths come near its own.
        """
        squares = {ANYWHERE, *me.squares, *squares_around([(me.x, me.y)] * 2, reach)}
        names: set[str] = set()
        for square in squares & self._names.keys():
            names |= self._names[square]
        x_min, y_min, x_max, y_max = me.box
        found = []
        for name in names:
            other = self._heard[name]
            far = reach + other.radius
            left, low, right, high = other.box
            if (
                (left <= x_max and right >= x_min and low <= y_max and high >= y_min)
                or (abs(other.x - me.x) < far and abs(other.y - me.y) < far)
            ) and (me.time - other.time < silence and name != me.name):
                found.append(other)
        if len(found) > 1:
            found.sort(key=self._place)
        return found

    def _place(self, announcement: Announcement) -> int:
        """Return how many robots were heard before this one."""
        return self._order[announcement.name]
