# SPDX-License-Identifier: BSD-3-Clause
"""What a robot does about the right of way: which right it has, and where it moves aside to."""

from __future__ import annotations

from typing import TYPE_CHECKING

from robot_description.passing_place import way_aside
from robot_description.right_of_way import Right, no_right

if TYPE_CHECKING:
    from collections.abc import Sequence

    from robot_description.grid_map import ClearanceField
    from robot_description.planner import Planner
    from robot_description.right_of_way import Announcement, Meeting

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
        waits = standing < HESITATION and not any(meeting.towards for meeting in met)
        if not on or waits or now < self._search_at:
            return None
        self._search_at = now + SEARCH_AGAIN
        others = [meeting.other for meeting in met]
        first = [other for other in others if other.right < self.right]
        for avoided in (first, on):
            way = way_aside(me, avoided, others, self._planner, self._field, self._need)
            if way is not None:
                self.right = min(other.right for other in on).behind(self._name)
                return way
        return self._ask(now, me, min(on, key=lambda other: other.right), others)

    def _ask(
        self, now: float, me: Announcement, first: Announcement, others: Sequence[Announcement]
    ) -> list[Point] | None:
        """Ask the one that goes first to let this robot out.

        A robot that has a way of its own keeps it; one without gets a way past the other one.
        """
        if first.right.owner == self._name:
            return None  # The other one asks this robot already; asking back would never end.
        self.right = first.right.before(self._name)
        self._ask_until = now + ASK
        if len(me.way) > 1:
            return None
        past = [other for other in others if other.name != first.name]
        return way_aside(me, [first], past, self._planner, self._field, self._need)
