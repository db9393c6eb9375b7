# SPDX-License-Identifier: BSD-3-Clause
"""What a planner is to the rest of navigation: the port behind which OMPL stands."""

from __future__ import annotations

from typing import TYPE_CHECKING, Protocol

from hive_common.errors import HiveError

if TYPE_CHECKING:
    from collections.abc import Sequence

    from hive_common.grid_map import Disc

Point = tuple[float, float]


class PlanError(HiveError):
    """There is no plan; the text says why, with the values, and what to do.

    Attributes:
        lasting: True if no change but one of the map or the goal helps; False if something that
            is not on the map is in the way and may go away.
    """

    def __init__(self, text: str, *, lasting: bool) -> None:
        super().__init__(text)
        self.lasting = lasting


class Planner(Protocol):
    """Finds ways for one robot on one map.

    A way is a list of points that the robot can drive along in straight lines, turning on the
    spot wherever it likes: the planner keeps room for that, whatever the shape of the footprint.
    """

    def plan(self, start: Point, goal: Point, discs: Sequence[Disc] = ()) -> list[Point]:
        """Return the corners of a short way from start to goal, both included.

        Args:
            start: Frame map [m].
            goal: Frame map [m].
            discs: Obstacles that are not on the map.

        Raises:
            PlanError: There is no way.
        """
        ...


def plan_around(
    planner: Planner,
    start: Point,
    goal: Point,
    firm: Sequence[Disc],
    rather: Sequence[Disc],
) -> list[Point]:
    """Plan around obstacles, and around others where that is possible.

    Args:
        planner: The robot's planner.
        start: Frame map [m].
        goal: Frame map [m].
        firm: Obstacles that the way must keep clear of.
        rather: Obstacles that it need not keep clear of where there is no other way.

    Raises:
        PlanError: There is no way even without `rather`.
    """
    if rather:
        try:
            return planner.plan(start, goal, [*firm, *rather])
        except PlanError as error:
            if error.lasting:
                raise
    return planner.plan(start, goal, firm)
