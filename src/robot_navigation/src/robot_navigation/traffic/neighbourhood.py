# SPDX-License-Identifier: BSD-3-Clause
"""What robots announce, sorted by place: a robot asks only for those that it may meet.

A spatial grid: each announcement is filed under the squares that its robot, or the path it
announces, comes near. All robots of one process may share one neighbourhood.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from robot_navigation.traffic.right_of_way import ANYWHERE, squares_around

if TYPE_CHECKING:
    from collections.abc import Iterable

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

    def everyone(self) -> Iterable[Announcement]:
        """Return all announcements, in the order in which the robots were first heard."""
        return self._heard.values()

    def near(self, me: Announcement, reach: float) -> list[Announcement]:
        """Return those within `reach` [m] of a robot, and whose paths it may meet, and a few more.

        They are in the same order as `everyone`; the robot itself is left out.
        """
        squares = {ANYWHERE, *me.squares, *squares_around([(me.x, me.y)] * 2, reach)}
        names = set().union(*[self._names[square] for square in squares if square in self._names])
        names.discard(me.name)
        return [self._heard[name] for name in sorted(names, key=self._order.__getitem__)]
