# SPDX-License-Identifier: BSD-3-Clause
"""The port through which navigation plans; the OMPL adapter is behind it."""

from __future__ import annotations

from typing import TYPE_CHECKING, Protocol

from hive_common.errors import HiveError

if TYPE_CHECKING:
    from collections.abc import Sequence

    from hive_navigation.planning.clearance import Disc
    from hive_navigation.planning.path import Point


class PlanError(HiveError):
    """There is no path; the text says why, with the values, and what to do.

    Attributes:
        lasting: True if only another map or goal helps; False if an obstacle that is not on the
            map blocks the path and may go away.
    """

    def __init__(self, text: str, *, lasting: bool) -> None:
        super().__init__(text)
        self.lasting = lasting


class Planner(Protocol):
    """Finds paths for one robot on one map.

    The robot drives straight from corner to corner of a path and may turn on the spot anywhere on
    it: the planner leaves room for that, whatever the shape of the footprint.
    """

    def plan(self, start: Point, goal: Point, discs: Sequence[Disc] = ()) -> list[Point]:
        """Return the corners of a short path from start to goal, both included, frame map [m].

        `discs` are obstacles that are not on the map.

        Raises:
            PlanError: There is no path.
        """
        ...


def plan_around(
    planner: Planner, start: Point, goal: Point, hard: Sequence[Disc], soft: Sequence[Disc]
) -> list[Point]:
    """Plan around hard obstacles, and around soft ones too if that is possible.

    Raises:
        PlanError: There is no path around the hard obstacles.
    """
    if soft:
        try:
            return planner.plan(start, goal, [*hard, *soft])
        except PlanError as error:
            if error.lasting:
                raise
    return planner.plan(start, goal, hard)
