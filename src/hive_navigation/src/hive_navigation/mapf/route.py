# SPDX-License-Identifier: BSD-3-Clause
"""What the traffic planner tells a robot: its path, and whom it lets pass first.

A route fixes an order, not times: an action dependency graph (Hoenig et al., Persistent and Robust
Execution of MAPF Schedules in Warehouses, IEEE RA-L 4(2), 2019). A late robot delays others and
never meets them.
"""

from __future__ import annotations

import itertools
import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, NamedTuple

if TYPE_CHECKING:
    from collections.abc import Sequence

    from hive_navigation.planning.path import Point


PER_METRE = 1000  # marks


class PlanNumber(NamedTuple):
    """Which plan something belongs to; the greater one is the newer one.

    Attributes:
        epoch: Of the blackboard that the planner belongs to; it grows with each takeover.
        number: Counts the plans of an epoch, from 1.
    """

    epoch: int
    number: int


NO_PLAN = PlanNumber(0, 0)


class Wait(NamedTuple):
    """A robot may not go past a mark of its own before another robot has come to one of its own.

    It is enough that the other robot claims its path up to there: it goes first then in any case,
    and by the right of way nobody drives into a claim.

    Attributes:
        at: The mark past which it may not go; see `Route`.
        robot: The other robot.
        passes: The mark that the other robot must have come to, or claim its path up to.
    """

    at: int
    robot: str
    passes: int


@dataclass(frozen=True)
class Route:
    """One robot's part of a plan.

    A mark says how far the robot has driven [mm] along all its routes of an epoch, so that a new
    route goes on with the marks of the one before.

    Attributes:
        robot: Whose route it is.
        plan: The plan that it belongs to.
        goal: The goal that it leads to, x and y, frame map [m]; None for a robot without one.
        first: The mark of the first of `places`.
        places: Where it drives, straight from each to the next, frame map [m]. The first is one
            that the robot has reached or cannot avoid any more. Without any the robot is to
            drop its route and to go by the right of way.
        waits: Whom it lets pass first, where.
        complete: Whether it ends at the goal; else it goes on in a later plan.
    """

    robot: str
    plan: PlanNumber
    goal: Point | None
    first: int
    places: tuple[Point, ...]
    waits: tuple[Wait, ...]
    complete: bool


def marks(first: int, places: Sequence[Point]) -> tuple[int, ...]:
    """Return the mark of each place of a route, of which the first has the mark `first`."""
    found, way = [first], 0.0
    for before, here in itertools.pairwise(places):
        way += math.dist(before, here)
        found.append(first + round(PER_METRE * way))
    return tuple(found)
