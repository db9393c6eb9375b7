# SPDX-License-Identifier: BSD-3-Clause
"""What robots announce, sorted by place: a robot asks only for those that it may meet.

A spatial grid: each announcement is filed under the squares that its robot, or the path it
announces, comes near. All robots of one process may share one neighbourhood.
"""

from __future__ import annotations

import itertools
from typing import TYPE_CHECKING

from hive_common.last_heard import LastHeard
from hive_navigation.traffic.right_of_way import ANYWHERE, squares_around

if TYPE_CHECKING:
    from hive_navigation.traffic.right_of_way import Announcement, Square

NOWHERE: frozenset[Square] = frozenset()


class Neighbourhood:
    """The latest announcement of every robot that has not left; see `hive_common.last_heard`."""

    def __init__(self) -> None:
        self._numbers = LastHeard[int]()  # of the robots, in the order of their first words
        self._next = itertools.count()
        self._latest: dict[int, Announcement] = {}
        self._squares: dict[Square, set[int]] = {}

    def hear(self, announcement: Announcement) -> None:
        """Take in what a robot announces, in place of what it said before."""
        known = self._numbers.get(announcement.name)
        number = next(self._next) if known is None else known
        gone = self._numbers.hear(announcement.name, number, announcement.time)
        before = NOWHERE if known is None else self._latest[number].squares
        self._latest[number] = announcement
        self._file(number, before, announcement.squares)
        for other in gone:
            self._file(other, self._latest.pop(other).squares, NOWHERE)

    def _file(self, number: int, before: frozenset[Square], squares: frozenset[Square]) -> None:
        """Move a robot from the squares in which it was to those in which it is."""
        for square in before - squares:
            self._squares[square].discard(number)
            if not self._squares[square]:
                del self._squares[square]
        for square in squares - before:
            self._squares.setdefault(square, set()).add(number)

    def latest(self, name: str) -> Announcement | None:
        """Return what a robot has announced last; None if it never has, or has left."""
        number = self._numbers.get(name)
        return None if number is None else self._latest[number]

    def others(self, name: str, now: float, silence: float) -> list[Announcement]:
        """Return what all robots but one have announced in less than `silence` before now [s].

        They are in the order in which they were first heard.
        """
        return [
            other
            for other in self._latest.values()
            if other.name != name and now - other.time < silence
        ]

    def near(self, me: Announcement, reach: float, silence: float) -> list[Announcement]:
        """Return those of `others` that a robot may see or meet, and a few more.

        They are within `reach` of it [m], or their paths come near its own.
        """
        squares = {ANYWHERE, *me.squares, *squares_around([(me.x, me.y)] * 2, reach)}
        numbers: set[int] = set()
        for square in squares & self._squares.keys():
            numbers |= self._squares[square]
        x_min, y_min, x_max, y_max = me.box
        found = []
        for number in sorted(numbers):
            other = self._latest[number]
            far = reach + other.radius
            left, low, right, high = other.box
            if (
                (left <= x_max and right >= x_min and low <= y_max and high >= y_min)
                or (abs(other.x - me.x) < far and abs(other.y - me.y) < far)
            ) and (me.time - other.time < silence and other.name != me.name):
                found.append(other)
        return found
