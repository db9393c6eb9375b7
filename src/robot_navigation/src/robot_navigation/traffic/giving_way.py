# SPDX-License-Identifier: BSD-3-Clause
"""What a robot does about the right of way: which right it has, and where it moves aside to."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

from robot_navigation.traffic.passing_place import way_aside
from robot_navigation.traffic.right_of_way import Right, no_right

if TYPE_CHECKING:
    from collections.abc import Sequence

    from hive_common.grid_map import ClearanceField
    from robot_navigation.planning.planner import Planner
    from robot_navigation.traffic.right_of_way import Announcement, Meeting

Point = tuple[float, float]

HESITATION = 1.0
"""After standing this long on another's way a robot that was leaving it moves aside [s]."""

SEARCH_AGAIN = 1.0
"""Time between two searches for a passing place [s]."""

ASK = 20.0
"""How long a robot that found no passing place asks to be let out [s]."""


class GivingWay:
    """The right of way of one robot, as it changes from moment to moment.

    Attributes:
        right: The right it has now.
    """

    def __init__(self, name: str, planner: Planner, field: ClearanceField, need: float) -> None:
        """Start without a goal.

        Args:
            name: The robot.
            planner: Its planner.
            field: The clearances of the map.
            need: The clearance that it needs [m].
        """
        self._name = name
        self._planner = planner
        self._field = field
        self._need = need
        self._own = self.right = no_right(name)
        self._moving_aside = False
        self._search_at = 0.0
        self._ask_until = 0.0

    def take(self, since: float | None) -> None:
        """Take the right of a goal.

        Args:
            since: When the goal was given [s]; None for no goal.
        """
        self._own = no_right(self._name)
        if since is not None:
            self._own = Right(since, self._name, 0, self._name)
        self.give_back()

    def give_back(self) -> None:
        """Go back to the right of the robot's own goal, after moving aside."""
        self.right = self._own
        self._moving_aside = False

    def way_out(
        self, now: float, me: Announcement, met: Sequence[Meeting], standing: float
    ) -> list[Point] | None:
        """Return the way to a passing place, if the robot must move aside and there is one.

        Args:
            now: The time [s].
            me: The robot, as it announces itself.
            met: How it gets along with all others.
            standing: For how long it has been standing still [s].
        """
        if self.right.step < 0 and now > self._ask_until:
            self.give_back()
        on = [meeting.other for meeting in met if meeting.on_its_way]
        towards = any(meeting.towards for meeting in met)
        if not self._moving_aside and self.right.step >= 0:
            # Who just goes on, and so leaves the way of one behind it, does that for the other.
            self.right = min([self._own, *self._behind(on)]) if not towards else self._own
        if not on or now < self._search_at or not (towards or standing >= HESITATION):
            return None
        self._search_at = now + SEARCH_AGAIN
        right, others = min(self._behind(on)), [meeting.other for meeting in met]
        way = self._passing_way(replace(me, right=right), on, others)
        if way is None:
            return self._ask(now, me, min(on, key=_right), others)
        self.right = right
        self._moving_aside = True
        return way

    def _behind(self, on: Sequence[Announcement]) -> list[Right]:
        """Return the rights that the robot gets for leaving the ways of others."""
        return [other.right.behind(self._name) for other in on]

    def _passing_way(
        self, me: Announcement, on: Sequence[Announcement], others: Sequence[Announcement]
    ) -> list[Point] | None:
        """Return a way to a passing place.

        The best place is off all ways and reached past all bodies. The next best is past those
        only that do not move aside for this robot in turn.
        """
        first = [other for other in others if other.right < self.right]
        firm = [other for other in others if other.parked or other in first]
        for bodies in (others, firm):
            for avoided in (first, on):
                way = way_aside(me, avoided, bodies, self._planner, self._field, self._need)
                if way is not None:
                    return way
        return None

    def _ask(
        self, now: float, me: Announcement, first: Announcement, others: Sequence[Announcement]
    ) -> list[Point] | None:
        """Ask the one that goes first to let this robot out.

        A robot that has a way of its own keeps it; one without gets a way past the other one.
        """
        if first.right.step < 0:
            return None  # The other one asks to be let out itself; asking back would never end.
        self.right = first.right.before(self._name)
        self._ask_until = now + ASK
        if len(me.way) > 1:
            return None
        past = [other for other in others if other.name != first.name]
        return way_aside(me, [first], past, self._planner, self._field, self._need)


def _right(announcement: Announcement) -> Right:
    return announcement.right
