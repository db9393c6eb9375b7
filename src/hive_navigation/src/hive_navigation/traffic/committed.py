# SPDX-License-Identifier: BSD-3-Clause
"""What the traffic planner knows of one robot, and the stretch that it can no longer change."""

from __future__ import annotations

import bisect
import itertools
import math
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

from hive_navigation.mapf.route import PER_METRE, Wait

if TYPE_CHECKING:
    from hive_navigation.mapf.route import PlanNumber
    from hive_navigation.planning.path import Point
    from hive_navigation.traffic.right_of_way import Announcement

STANDS = 0.05  # a robot that claims less than this stands [m]
STILL = 1.0  # so does one that has not moved for so long and claims less than `AT_GOAL` [s]
AT_START = 0.2  # a robot this near to the first point of its course may yet begin it [m]
AT_GOAL = 0.1  # a robot that has stopped this near to its goal is there [m]
EXACT = 0.02  # a robot this near to a place is planned as if it stood there [m]
AWAY = 1000  # how far a robot drives on that clears where it stood [mm]
ROUND = 0.3  # what is decided may be this much longer, to end at a place of the roadmap [m]
LATENCY = 0.5  # time until a robot has heard a new plan, and its progress is known [s]
REFUSES_AFTER = 3.0  # a robot that has taken no route for so long follows none [s]
SILENT = 3.0  # a robot that is not heard for so long follows none [s]
ACCEPT_WITHIN = 1.5  # a robot that does not follow a route after this time has refused it [s]


@dataclass(frozen=True)
class Drive:
    """The course that a robot was given: places off the roadmap have the index -1.

    Attributes:
        plan: The plan that it belongs to.
        given: When it was given [s].
        marks: How far the robot has driven at each point; see `Route`.
        points: Where it drives, frame map [m].
        places: Index of each point's place in the roadmap.
        arrives: When it is planned to reach each point [s].
        leaves: When it is planned to leave each point [s].
        complete: Whether it ends at the robot's goal.
        goal: The robot's goal when it was given, frame map [m]; None without one.
        waits: Whom it lets pass first, where.
        coupled: Whether it was planned in one search with the courses of others.
    """

    plan: PlanNumber
    given: float
    marks: tuple[int, ...]
    points: tuple[Point, ...]
    places: tuple[int, ...]
    arrives: tuple[float, ...]
    leaves: tuple[float, ...]
    complete: bool
    goal: Point | None
    waits: tuple[Wait, ...] = ()
    coupled: bool = False

    def passed_after(self, action: int) -> int:
        """Return the mark that the robot has come to when it has done an action of its course.

        Standing at the last point never ends: a mark that it comes to on a later course.
        """
        last = len(self.marks) - 1
        return self.marks[action + 1] if action < last else self.marks[last] + AWAY

    def after(self, mark: int) -> Drive:
        """Return what is left of it from the last point on that is not beyond a mark."""
        return self._from(max(0, bisect.bisect_right(self.marks, mark) - 1))

    def cut(self, mark: int) -> Drive:
        """Return what is left of it from a mark on."""
        index = max(0, bisect.bisect_right(self.marks, mark) - 1)
        left = self._from(index)
        if len(left.marks) == 1 or left.marks[0] >= mark:
            return left
        share = (mark - left.marks[0]) / (left.marks[1] - left.marks[0])
        (ax, ay), (bx, by) = left.points[:2]
        when = left.leaves[0] + share * (left.arrives[1] - left.leaves[0])
        return replace(
            left,
            marks=(mark, *left.marks[1:]),
            points=((ax + share * (bx - ax), ay + share * (by - ay)), *left.points[1:]),
            places=(-1, *left.places[1:]),
            arrives=(when, *left.arrives[1:]),
            leaves=(when, *left.leaves[1:]),
        )

    def _from(self, index: int) -> Drive:
        """Return what is left of it from a point on."""
        return replace(
            self,
            marks=self.marks[index:],
            points=self.points[index:],
            places=self.places[index:],
            arrives=self.arrives[index:],
            leaves=self.leaves[index:],
        )


@dataclass(frozen=True)
class Committed:
    """The beginning of a robot's next route, which is decided already.

    Attributes:
        first: How far the robot has driven at the first point; see `Route`.
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
        self._still = said.x, said.y, said.time  # where it is without moving, and since when [s]
        self.refuses_since: float | None = None  # [s]; None if it follows what it was given

    def hear(self, said: Announcement) -> None:
        """Take in what the robot announces."""
        if math.dist(self._still[:2], (said.x, said.y)) > EXACT or said.time < self.said.time:
            self._still = said.x, said.y, said.time
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

    def committed(self, now: float, held: float = math.inf) -> Committed:
        """Return what a new route must begin with.

        Args:
            now: The time [s].
            held: The mark at which it has to wait.
        """
        said = self.said
        here = (said.x, said.y)
        if self.drive is None or not self.follows(now):
            return self._announced()
        if said.plan.epoch != self.drive.plan.epoch:  # it has not begun
            return Committed(0, (here,), (-1,), 0.0, self.drive if self._is_fresh() else None)
        left = self.drive.after(said.passed)
        is_still = said.time - self._still[2] >= STILL
        if self.claim < (AT_GOAL if is_still else STANDS):
            return self._standing(left, here)
        wanted = self.claim + _speed(said) * LATENCY
        end = said.passed + round(PER_METRE * wanted)
        index = bisect.bisect_left(left.marks, end)
        if index == len(left.marks):
            end = left.marks[-1]
        elif left.marks[index] - end < ROUND * PER_METRE:
            end = left.marks[index]
        if held < end:
            end = max(int(held), said.passed)
        rest = left.cut(end)
        known = bisect.bisect_left(left.marks, end)
        return Committed(
            left.marks[0],
            (*left.points[:known], rest.points[0]),
            (*left.places[:known], rest.places[0]),
            wanted,
            rest,
        )

    def _standing(self, left: Drive, here: Point) -> Committed:
        """Return where a robot goes on that has stopped; it can still do anything."""
        stays = self.said.goal in {None, left.goal}
        # A course may pass a goal, to make way, and come back to it.
        ends = left.marks[-1] - self.said.passed < 2 * AT_GOAL * PER_METRE
        if stays and left.complete and ends and math.dist(here, left.points[-1]) < AT_GOAL:
            rest = left.cut(left.marks[-1])
            return Committed(left.marks[0], left.points, left.places, 0.0, rest)
        for index, point in enumerate(left.points[:2]):
            if math.dist(here, point) < EXACT:
                rest = left.cut(left.marks[index])
                return Committed(rest.marks[0], rest.points[:1], rest.places[:1], 0.0, rest)
        rest = left.cut(self.said.passed)
        rest = replace(
            rest,
            marks=(self.said.passed, *rest.marks[1:]),
            points=(here, *rest.points[1:]),
            places=(-1, *rest.places[1:]),
        )
        return Committed(self.said.passed, (here,), (-1,), 0.0, rest)

    def _is_fresh(self) -> bool:
        assert self.drive is not None  # noqa: S101  (its caller has looked)
        here = (self.said.x, self.said.y)
        return math.dist(here, self.drive.points[0]) < AT_START and self.claim < STANDS

    def _announced(self) -> Committed:
        """Return the claimed stretch of the path that a robot without a route announces."""
        said = self.said
        here = (said.x, said.y)
        if self.claim < STANDS:
            return Committed(said.passed, (here,), (-1,), 0.0, None)
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
        return Committed(said.passed, tuple(points), (-1,) * len(points), ahead, None)


def _claim(said: Announcement) -> float:
    """Return how much of the path that a robot announces it claims [m]."""
    length = sum(math.dist(*leg) for leg in itertools.pairwise(said.path))
    return min(said.claim, length)


def _speed(said: Announcement) -> float:
    """Return the speed that a claim stands for, at most [m/s]; see `claimed_stretch`."""
    return min(said.limits.speed, said.claim / 0.8)
