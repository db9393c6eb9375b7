# SPDX-License-Identifier: BSD-3-Clause
"""The right of way: who goes first where robots meet, computed from what the robots announce.

Each robot announces its position, its radius, the next metres of its path, and a *claim*: the
first stretch of that path, which it may no longer be able to avoid.

1. No robot drives into another robot's claim. A robot that stands claims where it stands.
2. The robot with the older goal goes first; names break ties. Robots without a goal go last. A
   robot does not extend its claim into the announced path of one that goes first: it waits.
3. A robot on the path of one that goes first, unless it is just leaving that path, moves aside to
   the nearest passing place that these rules let it drive to (`passing_place.py`). Until then it
   has the other robot's right, one step lower, so that a third robot in its way moves aside too.
4. A robot that finds no passing place asks the other one to let it out: it takes the other's
   right, one step higher, so that the other one moves aside by the same rules.
5. A stationary robot (it picks, charges or is defect) does not move aside; the others plan around
   it or wait.
6. Between two robots that follow routes of the traffic planner (`hive_navigation.mapf`) only rule
   1 holds: the planner has said who goes first. Robots with a route go before those without.

The rule is free of deadlocks because rights are totally ordered and their order does not change
while a goal is pursued. The robot with the oldest goal waits for no path, only for bodies, and
rule 3 moves those. When it has arrived, the next one is the first. The reasons, and what else was
tried, are in docs/decisions/011-right-of-way.md.
"""

from __future__ import annotations

import itertools
import math
from dataclasses import dataclass, replace
from functools import cached_property
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from hive_common.compiled import compiled
from hive_navigation.mapf.route import NO_PLAN, PER_METRE
from hive_navigation.planning.path import sampled

if TYPE_CHECKING:
    from collections.abc import Iterable, Sequence

    from numpy.typing import NDArray

    from hive_common.geometry import Array, Indices
    from hive_navigation.mapf.route import PlanNumber
    from hive_navigation.planning.path import Point

    Square = tuple[int, int]

STEP = 0.1  # distance between the points of paths that are compared [m]
GAP = 0.10  # distance between the circles around two robots' footprints [m]
MIN_GAP = 0.03  # the same between robots that are closer than `GAP` already [m]
TOUCHING = 0.01  # robots nearer to each other than this only move apart [m]
ROUTE_GAP = 0.05  # the same between robots that follow routes, which keep `GAP` by plan [m]
HOLD = 0.15  # distance before another robot's path at which a robot waits [m]

BEHIND = 0.1
"""A robot this near to the start of a path is beside or behind its owner, not before it [m]."""

GLANCE = 0.6  # how far ahead a robot checks whether it leaves another robot's path [m]
CLAIM = 0.3  # how much of its path a robot claims beyond its braking distance [m]

SIDE = 4.0  # of the squares by which robots find their neighbours [m]
SLACK = 0.01  # how much nearer than needed counts as near, against rounding [m]
MOST = 1000  # what covers more squares is filed under `ANYWHERE`
ANYWHERE = (0, 0)  # is near every place as well as a square of its own

ROUNDING = 1e-6  # how much shorter than computed a number of steps may be

CLAIM_TIME = 0.5
"""How long a claim must last at the robot's speed, until the others hear the next one [s]."""


class Right(NamedTuple):
    """A right of way; the lesser of two rights goes first.

    Attributes:
        since: When the goal that it serves was given [s]; infinite without a goal.
        owner: The robot whose goal it is.
        step: 0 for the owner, above 0 for robots that move aside for it, below 0 for those that
            it lets out.
        name: The robot that has this right.
    """

    since: float
    owner: str
    step: int
    name: str

    def behind(self, name: str) -> Right:
        """Return the right of a robot that moves aside for the one with this right."""
        return Right(self.since, self.owner, self.step + 1, name)

    def before(self, name: str) -> Right:
        """Return the right of a robot that asks the one with this right to let it out."""
        return Right(self.since, self.owner, self.step - 1, name)


def no_right(name: str) -> Right:
    """Return the right of a robot without a goal."""
    return Right(math.inf, name, 0, name)


class Limits(NamedTuple):
    """How fast a robot can be.

    Attributes:
        speed: Its highest speed [m/s].
        acceleration: [m/s^2]
        yaw_rate: Its highest turning speed [rad/s].
    """

    speed: float
    acceleration: float
    yaw_rate: float


UNKNOWN_LIMITS = Limits(1.0, 1.0, 1.0)
"""What is assumed of a robot that does not say."""


@dataclass(frozen=True)
class Announcement:
    """What a robot tells the others.

    Attributes:
        name: The robot.
        time: When it was so [s].
        x, y: Where it is, frame map [m].
        radius: Radius of the circle around its footprint [m].
        right: Its right of way.
        path: The next metres of its path, from where it is, frame map [m]; one point if it stands.
        claim: How much of the path it claims [m].
        stationary: Whether it will not move by itself, whoever comes.
        yaw: Its heading, frame map [rad].
        goal: Where it is to go, frame map [m]; None without a goal.
        limits: How fast it can be.
        plan: The plan of the route that it follows; `NO_PLAN` without one.
        passed: The mark of that route that it has come to; see `mapf.route.Route`.
        waits_for: The robot for which it waits; empty if for none.
        obstacles: Obstacles in its way that are not on the map: x, y, radius, frame map [m].
    """

    name: str
    time: float
    x: float
    y: float
    radius: float
    right: Right
    path: tuple[Point, ...]
    claim: float
    stationary: bool
    yaw: float = 0.0
    goal: Point | None = None
    limits: Limits = UNKNOWN_LIMITS
    plan: PlanNumber = NO_PLAN
    passed: int = 0
    waits_for: str = ""
    obstacles: tuple[tuple[float, float, float], ...] = ()

    @cached_property
    def reaches(self) -> int:
        """The mark of its route up to which it claims its path.

        Nobody else can be there before it has passed.
        """
        length = sum(math.dist(*leg) for leg in itertools.pairwise(self.path))
        return self.passed + round(PER_METRE * min(self.claim, length))

    @cached_property
    def samples(self) -> tuple[Array, Array]:
        """Points along the path, (n, 2) array [m], and their distances from its start [m]."""
        return sampled(self.path, STEP)

    @cached_property
    def box(self) -> tuple[float, float, float, float]:
        """x_min, y_min, x_max, y_max of what must stay free of those of others [m]."""
        xs, ys = zip(*self.path, strict=True)
        reach = self.radius + GAP / 2
        return min(xs) - reach, min(ys) - reach, max(xs) + reach, max(ys) + reach

    @cached_property
    def squares(self) -> frozenset[Square]:
        """The squares that the robot or its path comes near; see `squares_around`.

        Two robots that must keep apart somewhere share a square.
        """
        points = [(self.x, self.y), *self.path]
        return squares_around(points, self.radius + GAP / 2 + SLACK)

    def with_claim(self, claim: float, right: Right) -> Announcement:
        """Return the announcement with a claim [m] and a right."""
        claiming = replace(self, claim=claim, right=right)
        vars(claiming).update(samples=self.samples, box=self.box, squares=self.squares)
        return claiming


class Meeting(NamedTuple):
    """How one robot gets along with another.

    Attributes:
        other: What the other one announces.
        room: How far the robot may go because of it [m].
        on_its_path: Whether the robot is on the path of the other one, which goes first.
        blocks_it: Whether the robot is on that path and is not leaving it: its own path leads
            towards the other one, or it has none.
    """

    other: Announcement
    room: float
    on_its_path: bool
    blocks_it: bool


def squares_around(points: Sequence[Point], reach: float) -> frozenset[Square]:
    """Return the squares within `reach` [m] of a polyline, and a few more."""
    squares: set[Square] = set()
    for (ax, ay), (bx, by) in itertools.pairwise(points):
        left, right = math.floor((min(ax, bx) - reach) / SIDE), (max(ax, bx) + reach) / SIDE
        low, high = math.floor((min(ay, by) - reach) / SIDE), (max(ay, by) + reach) / SIDE
        if (right - left) * (high - low) > MOST:
            return frozenset({ANYWHERE})
        squares.update(
            itertools.product(range(left, math.floor(right) + 1), range(low, math.floor(high) + 1))
        )
    return frozenset(squares)


def keep_apart(one: float, other: float) -> float:
    """Return the distance between the centres of robots of two radii [m]."""
    return one + other + GAP


def claimed_stretch(speed: float, deceleration: float, room: float) -> float:
    """Return how much of its path a robot claims [m], from speed [m/s] and deceleration [m/s^2].

    It claims no more than the `room` that it has [m], unless its braking distance is longer.
    """
    brake = speed * speed / (2 * deceleration)
    return min(brake + speed * CLAIM_TIME + CLAIM, max(room, brake))


def meetings(me: Announcement, others: Iterable[Announcement]) -> list[Meeting]:
    """Return how a robot gets along with every other one; its own claim does not matter."""
    return [_meeting(me, other) for other in others if other.name != me.name]


def _meeting(me: Announcement, other: Announcement) -> Meeting:
    x_min, y_min, x_max, y_max = me.box
    left, low, right, high = other.box
    if left > x_max or right < x_min or low > y_max or high < y_min:
        return Meeting(other, math.inf, on_its_path=False, blocks_it=False)
    planned = NO_PLAN not in (me.plan, other.plan)
    return Meeting(
        other,
        *_met(
            *me.samples,
            *other.samples,
            other.claim,
            me.radius + other.radius,
            ROUTE_GAP if planned else GAP,
            goes_first(me, other),
        ),
    )


def goes_first(me: Announcement, other: Announcement) -> bool:
    """Return whether a robot need not wait before the announced path of another one."""
    if me.plan != NO_PLAN or other.plan != NO_PLAN:
        return me.plan != NO_PLAN
    return me.right < other.right


@compiled(
    "Tuple((float64[::1], float64[::1], int64[::1]))"
    "(float64[:, ::1], float64[:, ::1], int64, float64)"
)
def _distances(
    points: Array, path: Array, claimed: int, apart: float
) -> tuple[Array, Array, Indices]:
    """Return how far points (n, 2) are from a path and from its first points, and what is nearest.

    What is at least `apart` away counts as infinitely far [m].
    """
    x_min, x_max = np.min(path[:, 0]) - apart, np.max(path[:, 0]) + apart
    y_min, y_max = np.min(path[:, 1]) - apart, np.max(path[:, 1]) + apart
    nearest, nearest_claimed = np.full(len(points), np.inf), np.full(len(points), np.inf)
    place = np.zeros(len(points), dtype=np.int64)
    for index in range(len(points)):
        x, y = points[index]
        if not (x_min < x < x_max and y_min < y < y_max):
            continue
        least, other, found = apart, 0, False
        while other < len(path):
            away = math.hypot(x - path[other, 0], y - path[other, 1])
            if away < least:
                least, place[index], found = away, other, True
                if other < claimed:
                    nearest_claimed[index] = away
            # The points of a path are at most `STEP` apart: none of those left out is nearer.
            other += max(1, int((away - least) / STEP - ROUNDING))
        if found:
            nearest[index] = least
    return nearest, nearest_claimed, place


@compiled("float64(boolean[::1], float64[::1])")
def _first(wanted: NDArray[np.bool_], marks: Array) -> float:
    """Return the first mark where `wanted` is true; infinite if there is none."""
    for index in range(len(marks)):
        if wanted[index]:
            return float(marks[index])
    return np.inf


@compiled("float64(float64[::1], float64[::1], float64, float64)")
def _room_before(away: Array, marks: Array, radii: float, gap: float) -> float:
    """Return how far a robot can go and keep its distance from a claim [m].

    A robot that is too close already may go where it comes no closer.
    """
    if away[0] >= radii + gap:
        return _first(away < radii + gap, marks) - STEP
    # Robots that try again and again must not come nearer bit by bit until they touch.
    body = radii + TOUCHING
    least = min(radii + MIN_GAP, max(away[0] - 0.005, min(away[0], body)))
    return _first(away < least, marks) - STEP


@compiled(
    "Tuple((float64, boolean, boolean))(float64[:, ::1], float64[::1], float64[:, ::1],"
    " float64[::1], float64, float64, float64, boolean)"
)
def _met(
    points: Array,
    marks: Array,
    path: Array,
    path_marks: Array,
    claim: float,
    radii: float,
    gap: float,
    goes_first: bool,
) -> tuple[float, bool, bool]:
    """Return what makes a `Meeting` of robots of two radii, by their sum, with a gap [m]."""
    apart = radii + gap
    nearest, claimed, place = _distances(
        points, path, int(np.sum(path_marks <= claim + STEP / 2)), apart
    )
    room = _room_before(claimed, marks, radii, gap)
    if goes_first:
        return room, False, False
    if nearest[0] >= apart:
        room = min(room, _first(nearest < apart, marks) - HOLD)
        return max(0.0, room), False, False
    on_its_path = bool(path_marks[place[0]] > BEHIND)
    glance = min(len(marks) - 1, math.ceil(GLANCE / STEP))
    nearer = glance == 0 or bool(path_marks[place[glance]] < path_marks[place[0]] - BEHIND)
    blocks_it = on_its_path and nearer and bool(np.all(nearest[: glance + 1] < apart))
    if blocks_it:
        room = 0.0
    else:
        # A robot may always leave the path; what counts is where it would come back to it.
        left = _first(nearest >= apart, marks)
        room = min(room, _first((nearest < apart) & (marks > left), marks) - HOLD)
    return max(0.0, room), on_its_path, blocks_it
