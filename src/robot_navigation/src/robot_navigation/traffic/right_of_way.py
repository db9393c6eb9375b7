# SPDX-License-Identifier: BSD-3-Clause
"""Who goes first where robots meet: the rule, as functions of what the robots tell each other.

Each robot announces where it is, how wide it is, the next metres of its way, and a *claim*: the
first stretch of that way, which it is about to drive and may no longer be able to avoid.

1. Nobody drives into what another one claims. A standing robot claims where it stands.
2. The robot whose goal is older goes first; names break ties. A robot without a goal goes last.
   The others do not extend their claims into the announced way of one that goes first: they wait
   before it.
3. Who stands on the way of one that goes first, and is not just leaving it, moves aside to the
   nearest passing place that these rules let it drive to (`passing_place.py`). Until then it has
   the other's right, one step lower, so that a third robot in its way moves aside for it in turn.
4. Who finds no passing place asks the other to let it out: it takes the other's right, one step
   higher, so that the other moves aside by the same rules.
5. A parked robot (one that picks, charges or is defect) does not move aside; the others plan
   around it or wait.

Why it never locks up: rights are totally ordered, and an order does not change while a goal is
pursued. The robot with the oldest goal waits for nobody's way, only for bodies, and rule 3 moves
those. When it has arrived, the next one is the first. docs/decisions/011-right-of-way.md tells
the whole story with what was tried.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from robot_navigation.planning.path import sampled

if TYPE_CHECKING:
    from collections.abc import Iterable

    from numpy.typing import NDArray

    Array = NDArray[np.float64]

Point = tuple[float, float]

STEP = 0.1
"""Distance between the points of a way that are compared [m]."""

GAP = 0.10
"""Room that two robots leave between the circles that hold their footprints [m]."""

MIN_GAP = 0.03
"""Room that two robots keep that have come closer than `GAP` already [m]."""

HOLD = 0.15
"""How far before another's way a robot waits [m]."""

BEHIND = 0.1
"""Who is this near to the beginning of a way is behind or beside its robot, not before it [m]."""

GLANCE = 0.6
"""How far ahead a robot looks whether it is leaving another's way [m]."""

CLAIM = 0.3
"""How much of its way a robot claims beyond what it needs to brake [m]."""

CLAIM_TIME = 0.5
"""For how long a robot's claim lasts at its speed [s]: until the others have heard the next."""


class Right(NamedTuple):
    """Who goes first; the lesser of two rights does.

    Attributes:
        since: When the goal was given that this right serves [s]; infinite without a goal.
        owner: The robot whose goal it is.
        step: 0 for the owner; above 0 for those who move aside for it; below 0 for those whom it
            lets out.
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


@dataclass(frozen=True)
class Announcement:
    """What a robot tells the others.

    Attributes:
        name: The robot.
        time: When it said so [s].
        x, y: Where it is, frame map [m].
        radius: Radius of the circle that holds its footprint [m].
        right: Its right of way.
        way: The next metres of its way, from where it is, frame map [m]; one point if it stands.
        claim: How much of it the robot claims [m].
        parked: Whether it stays where it is whoever comes.
    """

    name: str
    time: float
    x: float
    y: float
    radius: float
    right: Right
    way: tuple[Point, ...]
    claim: float
    parked: bool

    @cached_property
    def samples(self) -> tuple[Array, Array]:
        """Points along the way, (n, 2) array [m], and their distances from its start [m]."""
        return sampled(self.way, STEP)


@dataclass(frozen=True)
class Meeting:
    """How one robot's way and another robot get along.

    Attributes:
        other: What the other one announces.
        room: How far the robot may go because of it [m].
        on_its_way: Whether the robot stands on the way of one that goes first.
        towards: Whether the robot's own way leads towards the one that goes first, on that one's
            way; also True if it has no way of its own.
    """

    other: Announcement
    room: float
    on_its_way: bool
    towards: bool


def keep_apart(one: float, other: float) -> float:
    """Return the distance that robots of two radii keep between their middles [m]."""
    return one + other + GAP


def claimed_stretch(speed: float, deceleration: float, room: float) -> float:
    """Return how much of its way a robot is about to use [m].

    Args:
        speed: [m/s]
        deceleration: [m/s^2]
        room: How far it may go [m]; it claims no more, unless it cannot brake within that.
    """
    brake = speed * speed / (2 * deceleration)
    return min(brake + speed * CLAIM_TIME + CLAIM, max(room, brake))


def meetings(me: Announcement, others: Iterable[Announcement]) -> list[Meeting]:
    """Work out how far a robot may go for every other one.

    Args:
        me: Who asks; its own claim is not looked at.
        others: What the others announce.
    """
    return [_meeting(me, other) for other in others if other.name != me.name]


def _meeting(me: Announcement, other: Announcement) -> Meeting:
    apart = keep_apart(me.radius, other.radius)
    points, marks = me.samples
    way, way_marks = other.samples
    away = np.hypot(points[:, None, 0] - way[None, :, 0], points[:, None, 1] - way[None, :, 1])
    claimed = away[:, way_marks <= other.claim + STEP / 2]
    room = _room_before(claimed.min(axis=1), marks, apart)
    if other.right > me.right:
        return Meeting(other, room, on_its_way=False, towards=False)
    nearest = away.min(axis=1)
    place = way_marks[away.argmin(axis=1)]
    if nearest[0] >= apart:
        room = min(room, _first(nearest < apart, marks) - HOLD)
        return Meeting(other, max(0.0, room), on_its_way=False, towards=False)
    before = bool(place[0] > BEHIND)
    glance = min(len(marks) - 1, math.ceil(GLANCE / STEP))
    nearer = glance == 0 or bool(place[glance] < place[0] - BEHIND)
    towards = before and nearer and bool((nearest[: glance + 1] < apart).all())
    if towards:
        room = 0.0
    else:
        # Leaving is always allowed; what counts is where it would come back.
        left = _first(nearest >= apart, marks)
        room = min(room, _first((nearest < apart) & (marks > left), marks) - HOLD)
    return Meeting(other, max(0.0, room), on_its_way=before, towards=towards)


def _room_before(away: Array, marks: Array, apart: float) -> float:
    """Return how far a robot can go and keep its distance from a claim [m].

    One that is too close already may go where it comes no closer.
    """
    if away[0] >= apart:
        return _first(away < apart, marks) - STEP
    least = min(apart - GAP + MIN_GAP, float(away[0]) - 0.005)
    return _first(away < least, marks) - STEP


def _first(wanted: NDArray[np.bool_], marks: Array) -> float:
    """Return the first mark at which something is so; infinite if it never is."""
    return float(marks[int(np.argmax(wanted))]) if wanted.any() else math.inf
