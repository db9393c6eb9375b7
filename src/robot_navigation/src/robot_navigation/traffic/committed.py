# SPDX-License-Identifier: BSD-3-Clause
"""What the traffic planner knows of one robot, and the stretch that it can no longer change."""

from __future__ import annotations

import itertools
import math
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from robot_navigation.mapf.route import PlanNumber
    from robot_navigation.planning.path import Point
    from robot_navigation.traffic.right_of_way import Announcement

STANDS = 0.05  # a robot that claims less than this stands [m]
AT_PLACE = 0.2  # a robot this near to a place is at it [m]
LATENCY = 0.5  # time until a robot has heard a new plan, and its progress is known [s]
REFUSES_AFTER = 3.0  # a robot that has taken no route for so long follows none [s]
SILENT = 3.0  # a robot that is not heard for so long follows none [s]
HELD = 4.0  # a robot that stands for so long between two places may be led elsewhere [s]
ACCEPT_WITHIN = 1.5  # a robot that does not follow a route after this time has refused it [s]


@dataclass(frozen=True)
class Drive:
    """The course that a robot was given: places off the roadmap have the index -1.

    Attributes:
        plan: The plan that it belongs to.
        given: When it was given [s].
        first: Number of the first point.
        points: Where it drives, frame map [m].
        places: Index of each point's place in the roadmap.
        arrives: When it is planned to reach each point [s].
        leaves: When it is planned to leave each point [s].
        complete: Whether it ends at the robot's goal.
        goal: The robot's goal when it was given, frame map [m]; None without one.
    """

    plan: PlanNumber
    given: float
    first: int
    points: tuple[Point, ...]
    places: tuple[int, ...]
    arrives: tuple[float, ...]
    leaves: tuple[float, ...]
    complete: bool
    goal: Point | None

    def after(self, number: int) -> Drive:
        """Return what is left of it from the point with a number on."""
        skip = min(max(number - self.first, 0), len(self.points) - 1)
        return replace(
            self,
            first=self.first + skip,
            points=self.points[skip:],
            places=self.places[skip:],
            arrives=self.arrives[skip:],
            leaves=self.leaves[skip:],
        )


@dataclass(frozen=True)
class Committed:
    """The beginning of a robot's next route, which is decided already.

    Attributes:
        first: Number of its first point.
        points: The last place that the robot has passed, and where it goes at any rate.
        places: Index of each point's place; -1 off the roadmap.
        ahead: Length of the way from the robot to the last point [m].
        rest: What the robot was given beyond that point; None if nothing that still holds.
    """

    first: int
    points: tuple[Point, ...]
    places: tuple[int, ...]
    ahead: float
    rest: Drive | None


class Tracked:
    """One robot as the planner knows it.

    Attributes:
        said: What it announced last.
        drive: The course that it was given last; None if it has none that it follows.
    """

    def __init__(self, said: Announcement) -> None:
        self.said = said
        self.claim = _claim(said)  # at most what is left of its path [m]
        self.drive: Drive | None = None
        self.stands_since = said.time  # [s]
        self.refuses_since: float | None = None  # [s]; None if it follows what it was given

    def hear(self, said: Announcement) -> None:
        """Take in what the robot announces."""
        self.said = said
        self.claim = _claim(said)
        if self.claim >= STANDS:
            self.stands_since = said.time
        if self.drive is None or said.plan.epoch == self.drive.plan.epoch:
            self.refuses_since = None

    def give(self, drive: Drive) -> None:
        """Note what the robot is given."""
        if self.refuses_since is None and self.said.plan.epoch != drive.plan.epoch:
            self.refuses_since = drive.given
        self.drive = drive

    def is_planned(self, now: float) -> bool:
        """Return whether the robot can be reckoned with: it is heard, and takes routes."""
        refused = self.refuses_since is not None and now - self.refuses_since > REFUSES_AFTER
        return not refused and now - self.said.time < SILENT

    def follows(self, now: float) -> bool:
        """Return whether the robot follows its course, or may yet begin to."""
        if self.drive is None:
            return False
        return self.said.plan >= self.drive.plan or now < self.drive.given + ACCEPT_WITHIN

    def committed(self, now: float) -> Committed:
        """Return what a new route must begin with."""
        said = self.said
        here = (said.x, said.y)
        if self.drive is None or not self.follows(now):
            return self._announced()
        if said.plan.epoch != self.drive.plan.epoch:  # it has not begun
            return Committed(0, (here,), (-1,), 0.0, self.drive if self._is_fresh() else None)
        left = self.drive.after(said.passed)
        if self.claim < STANDS:
            if math.dist(here, left.points[0]) < AT_PLACE:
                return Committed(left.first, left.points[:1], left.places[:1], 0.0, left)
            if len(left.points) == 1 or now - self.stands_since > HELD:
                return Committed(left.first, (here,), (-1,), 0.0, None)
        wanted = self.claim + _speed(said) * LATENCY
        last, ahead, before = 0, 0.0, here
        while last + 1 < len(left.points) and (last == 0 or ahead < wanted):
            last += 1
            ahead += math.dist(before, left.points[last])
            before = left.points[last]
        return Committed(
            left.first,
            left.points[: last + 1],
            left.places[: last + 1],
            ahead,
            left.after(left.first + last),
        )

    def _is_fresh(self) -> bool:
        assert self.drive is not None  # noqa: S101  (its caller has looked)
        here = (self.said.x, self.said.y)
        return math.dist(here, self.drive.points[0]) < AT_PLACE and self.claim < STANDS

    def _announced(self) -> Committed:
        """Return the claimed stretch of the path that a robot without a route announces."""
        said = self.said
        here = (said.x, said.y)
        if self.claim < STANDS:
            return Committed(said.passed + 1, (here,), (-1,), 0.0, None)
        wanted = self.claim + _speed(said) * LATENCY
        points, ahead = [here], 0.0
        for point in said.path[1:]:
            leg = math.dist(points[-1], point)
            if ahead + leg >= wanted:
                share = (wanted - ahead) / leg
                x, y = points[-1]
                points.append((x + share * (point[0] - x), y + share * (point[1] - y)))
                ahead = wanted
                break
            points.append(point)
            ahead += leg
        return Committed(said.passed + 1, tuple(points), (-1,) * len(points), ahead, None)


def _claim(said: Announcement) -> float:
    """Return how much of the path that a robot announces it claims [m]."""
    length = sum(math.dist(*leg) for leg in itertools.pairwise(said.path))
    return min(said.claim, length)


def _speed(said: Announcement) -> float:
    """Return the speed that a claim stands for, at most [m/s]; see `claimed_stretch`."""
    return min(said.limits.speed, said.claim / 0.8)
