# SPDX-License-Identifier: BSD-3-Clause
"""What the traffic planner tells a robot: its path, and whom it lets pass first.

A route fixes an order, not times: an action dependency graph (Hoenig et al., Persistent and Robust
Execution of MAPF Schedules in Warehouses, IEEE RA-L 4(2), 2019). A late robot delays others and
never meets them.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, NamedTuple

if TYPE_CHECKING:
    from robot_navigation.planning.path import Point


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
    """A robot may not go past one of its places before another robot has gone past one of its own.

    Attributes:
        at: Number of the place past which it may not go; see `Route.first`.
        robot: The other robot.
        passes: Number of the place of the other robot's route that it must have reached.
    """

    at: int
    robot: str
    passes: int


@dataclass(frozen=True)
class Route:
    """One robot's part of a plan.

    Places are numbered along everything that the robot ever drives in an epoch, so that a new
    route goes on with the numbers of the one before.

    Attributes:
        robot: Whose route it is.
        plan: The plan that it belongs to.
        goal: The goal that it leads to, x and y, frame map [m]; None for a robot without one.
        first: Number of the first place of `places`.
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
