# SPDX-License-Identifier: BSD-3-Clause
"""How one robot gives way: which right of way it has, and when and where it moves aside."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

from hive_navigation.traffic.passing_place import PassingPlaces
from hive_navigation.traffic.right_of_way import Right, no_right

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from hive_navigation.planning.clearance import ClearanceField
    from hive_navigation.planning.path import Point
    from hive_navigation.planning.planner import Planner
    from hive_navigation.traffic.right_of_way import Announcement, Meeting

HESITATION = 1.0
"""A robot that was leaving another's path moves aside after standing this long on it [s]."""

SEARCH_AGAIN = 1.0  # time between two searches for a passing place [s]
ASK = 20.0  # how long a robot without a passing place asks to be let out [s]


class GivingWay:
    """The right of way of one robot, which changes from moment to moment.

    Attributes:
        right: The right that it has now.
    """

    def __init__(self, name: str, planner: Planner, field: ClearanceField, need: float) -> None:
        """Start without a goal; the robot needs a clearance of `need` [m] at a passing place."""
        self._name = name
        self._planner = planner
        self._field = field
        self._need = need
        self._own = self.right = no_right(name)
        self._moving_aside = False
        self._search_at = 0.0
        self._ask_until = 0.0

    def set_goal(self, since: float | None) -> None:
        """Take the right of a goal that was given at a time [s]; None for no goal."""
        self._own = no_right(self._name)
        if since is not None:
            self._own = Right(since, self._name, 0, self._name)
        self.restore()

    def restore(self) -> None:
        """Return to the right of the robot's own goal, after moving aside."""
        self.right = self._own
        self._moving_aside = False

    def path_aside(
        self,
        now: float,
        me: Announcement,
        met: Sequence[Meeting],
        standing: float,
        everyone: Callable[[], Sequence[Announcement]],
    ) -> list[Point] | None:
        """Return the path to a passing place, if the robot must move aside and there is one.

        Args:
            now: The time [s].
            me: What the robot announces.
            met: How it meets others.
            standing: How long it has been standing still [s].
            everyone: Returns all other robots, near or not.
        """
        if self.right.step < 0 and now > self._ask_until:
            self.restore()
        first = [meeting.other for meeting in met if meeting.on_its_path]
        blocks = any(meeting.blocks_it for meeting in met)
        if not self._moving_aside and self.right.step >= 0:
            # A robot that only drives on, out of another's path, does so for that other robot.
            self.right = min([self._own, *self._behind(first)]) if not blocks else self._own
        if not first or now < self._search_at or not (blocks or standing >= HESITATION):
            return None
        self._search_at = now + SEARCH_AGAIN
        right, others = min(self._behind(first)), everyone()
        path = self._passing_path(replace(me, right=right), first, others)
        if path is None:
            return self._ask(now, me, min(first, key=_right), others)
        self.right = right
        self._moving_aside = True
        return path

    def _behind(self, first: Sequence[Announcement]) -> list[Right]:
        """Return the rights that the robot gets for leaving the paths of others."""
        return [other.right.behind(self._name) for other in first]

    def _passing_path(
        self, me: Announcement, on: Sequence[Announcement], others: Sequence[Announcement]
    ) -> list[Point] | None:
        """Return a path to a passing place.

        The best place is off all paths and reached around all robots. The next best is reached
        around the robots only that do not move aside for this one in turn.
        """
        first = [other for other in others if other.right < self.right]
        fixed = [other for other in others if other.stationary or other.right < self.right]
        for obstacles in (others, fixed):
            places = PassingPlaces(me, obstacles, self._planner, self._field, self._need)
            for avoided in (first, on):
                path = places.path_off(avoided)
                if path is not None:
                    return path
        return None

    def _ask(
        self, now: float, me: Announcement, first: Announcement, others: Sequence[Announcement]
    ) -> list[Point] | None:
        """Ask the robot that goes first to let this one out.

        A robot that has a path keeps it; one without gets a path past the other robot.
        """
        if first.right.step < 0:
            return None  # The other one asks to be let out itself; asking back would never end.
        self.right = first.right.before(self._name)
        self._ask_until = now + ASK
        if len(me.path) > 1:
            return None
        past = [other for other in others if other.name != first.name]
        places = PassingPlaces(me, past, self._planner, self._field, self._need)
        return places.path_off([first])


def _right(announcement: Announcement) -> Right:
    return announcement.right
