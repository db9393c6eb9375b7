# SPDX-License-Identifier: BSD-3-Clause
"""Finds robots that cannot go on, from what robots announce.

Two things count as a lock. Robots *wait for each other in a circle*. Or a robot with a goal makes
*no progress*: it has stayed near one place for 15 s, or has come nowhere new for 30 s, as one
that drives back and forth does. The chain of who waits for whom says why. It ends at a robot that
does not go by itself, at one that drives, or at the robot itself.

How locks are resolved stands in `lock_resolver.py`.
"""

from __future__ import annotations

import math
from collections import Counter
from dataclasses import dataclass
from enum import Enum
from typing import TYPE_CHECKING, NamedTuple

from hive_common.last_heard import FORGOTTEN_AFTER

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping

    from hive_navigation.planning.path import Point
    from hive_navigation.traffic.right_of_way import Announcement

STANDS = 0.1  # a robot that moves less than this stands [m]
PROGRESS = 0.5  # a robot with a goal that stays within this makes no progress [m]
CIRCLE_AFTER = 2.0  # robots that stand in a circle for so long do not get out by themselves [s]
NO_PROGRESS_AFTER = 15.0  # [s]
NOTHING_NEW_AFTER = 30.0  # [s]
OVERTAKEN_AFTER = 30.0  # in dense traffic robots wait for others that drive; this is too long [s]
SILENT = 5.0  # a robot that is not heard for so long is not reckoned with [s]


class Kind(Enum):
    """Why robots cannot go on."""

    CIRCLE = "circle"
    """They wait for each other."""
    BLOCKED = "blocked"
    """It waits for a robot that does not move: it has no goal, must stay, is silent, or makes
    no progress either."""
    OVERTAKEN = "overtaken"
    """It waits for robots that drive: others go first again and again."""
    HELD = "held"
    """It waits for no robot: something else is in its way, or it has no way to drive."""


class Lock(NamedTuple):
    """Robots that cannot go on.

    Attributes:
        kind: Why.
        robots: Of a circle its members, each before the one that it waits for; else the robot, the
            one that it waits for, and so on to the end of the chain.
        at: Where each of them was when it was last heard, frame map [m]; one that was never heard
            is where the one is that waits for it.
        since: Since when [s].
    """

    kind: Kind
    robots: tuple[str, ...]
    at: tuple[Point, ...]
    since: float


@dataclass
class _Robot:
    said: Announcement
    stood_at: Point  # a place near which it stands
    stands_since: float  # [s]
    stayed_at: Point  # a place near which it has been since `stays_since`
    stays_since: float  # [s]
    been: set[tuple[int, int]]  # the squares in which it was on the way to its goal
    new_since: float  # when it came into the last of them [s]

    @classmethod
    def of(cls, said: Announcement) -> _Robot:
        here = (said.x, said.y)
        return cls(said, here, said.time, here, said.time, set(), said.time)

    def gets_nowhere(self, now: float) -> bool:
        """Return whether it has a goal to which it makes no progress."""
        stays, nothing_new = now - self.stays_since, now - self.new_since
        return stays > NO_PROGRESS_AFTER or nothing_new > NOTHING_NEW_AFTER

    def hear(self, said: Announcement) -> None:
        here = (said.x, said.y)
        if said.time < self.said.time or math.dist(here, self.stood_at) > STANDS:
            self.stood_at, self.stands_since = here, said.time
        begins = (
            said.time < self.said.time
            or said.goal is None
            or said.goal != self.said.goal
            or said.stationary
        )
        if begins or math.dist(here, self.stayed_at) > PROGRESS:
            self.stayed_at, self.stays_since = here, said.time
        square = math.floor(said.x / PROGRESS), math.floor(said.y / PROGRESS)
        if begins:
            self.been.clear()
        if square not in self.been:
            self.been.add(square)
            self.new_since = said.time
        self.said = said


def circles(waits_for: Mapping[str, str]) -> list[tuple[str, ...]]:
    """Return the robots that wait for each other in a circle.

    Args:
        waits_for: By robot, the one for which it waits.

    Returns:
        Each circle once: the least name first, then each before the one that it waits for.
    """
    found: list[tuple[str, ...]] = []
    seen: set[str] = set()
    for start in waits_for:
        trail: list[str] = []
        robot = start
        while robot in waits_for and robot not in seen:
            seen.add(robot)
            trail.append(robot)
            robot = waits_for[robot]
        if robot in trail:
            members = trail[trail.index(robot) :]
            first = members.index(min(members))
            found.append((*members[first:], *members[:first]))
    return sorted(found)


class LockWatch:
    """Watches all robots.

    Attributes:
        locks: Those of the last look: circles first, then by robot.
        counts: How many of each kind there have been, each counted once.
    """

    def __init__(self) -> None:
        self.locks: tuple[Lock, ...] = ()
        self.counts: Counter[Kind] = Counter()
        self._robots: dict[str, _Robot] = {}
        self._circles: dict[tuple[str, ...], float] = {}  # since when robots wait so [s]
        self._stuck: dict[str, Kind] = {}  # robots without progress that were counted

    def hear(self, said: Announcement) -> None:
        """Take in what a robot announces."""
        known = self._robots.get(said.name)
        if known is None:
            self._robots[said.name] = _Robot.of(said)
        else:
            known.hear(said)

    def look(self, now: float) -> tuple[Lock, ...]:
        """Return the locks at a time [s], and count those that are new."""
        heard = {
            name: robot for name, robot in self._robots.items() if now - robot.said.time < SILENT
        }
        waits_for = {n: r.said.waits_for for n, r in heard.items() if r.said.waits_for}
        self._forget(now, frozenset(waits_for.values()))
        found = self._found_circles(heard, waits_for, now)
        inside = {name for lock in found for name in lock.robots}
        stuck = [
            self._lock_of(name, robot, heard)
            for name, robot in sorted(heard.items())
            if robot.gets_nowhere(now)
        ]
        stuck = [
            lock
            for lock in stuck
            if lock.kind is not Kind.OVERTAKEN or now - lock.since > OVERTAKEN_AFTER
        ]
        # Who waits for a circle goes on when that is resolved.
        stuck = [lock for lock in stuck if inside.isdisjoint(lock.robots)]
        self._count(found, stuck)
        self.locks = (*found, *stuck)
        return self.locks

    def _forget(self, now: float, in_the_way: frozenset[str]) -> None:
        """Forget robots that have left, but not where those are for which others wait."""
        self._robots = {
            name: robot
            for name, robot in self._robots.items()
            if abs(now - robot.said.time) < FORGOTTEN_AFTER or name in in_the_way
        }

    def _found_circles(
        self, heard: Mapping[str, _Robot], waits_for: Mapping[str, str], now: float
    ) -> list[Lock]:
        """Return the circles that have lasted for long enough."""
        before, self._circles = self._circles, {}
        locks = []
        for members in circles(waits_for):
            began = min(before.get(members, now), now)
            self._circles[members] = began
            since = max(began, *(heard[name].stands_since for name in members))
            if now - since >= CIRCLE_AFTER:
                at = tuple((heard[name].said.x, heard[name].said.y) for name in members)
                locks.append(Lock(Kind.CIRCLE, members, at, since))
        return locks

    def _lock_of(self, name: str, robot: _Robot, heard: Mapping[str, _Robot]) -> Lock:
        """Return why a robot makes no progress."""
        chain = [name]
        while (follows := self._robots.get(chain[-1])) is not None:
            after = follows.said.waits_for
            if not after or after in chain or chain[-1] not in heard:
                break
            chain.append(after)
        at: list[Point] = []
        for each in chain:
            known = self._robots.get(each)
            at.append(at[-1] if known is None else (known.said.x, known.said.y))
        return Lock(_kind(chain, heard), tuple(chain), tuple(at), robot.stays_since)

    def _count(self, found: Iterable[Lock], stuck: Iterable[Lock]) -> None:
        """Count what the last look has not found."""
        known = {lock.robots for lock in self.locks if lock.kind is Kind.CIRCLE}
        self.counts.update(lock.kind for lock in found if lock.robots not in known)
        before, self._stuck = self._stuck, {}
        for lock in stuck:
            name = lock.robots[0]
            if name not in before:
                self.counts[lock.kind] += 1
            self._stuck[name] = before.get(name, lock.kind)


def _kind(chain: list[str], heard: Mapping[str, _Robot]) -> Kind:
    """Return why the first robot of a chain makes no progress; the last one waits for nobody."""
    if len(chain) == 1:
        return Kind.HELD
    last = heard.get(chain[-1])
    if last is None or last.said.goal is None or last.said.stationary:
        return Kind.BLOCKED
    return Kind.BLOCKED if last.gets_nowhere(last.said.time) else Kind.OVERTAKEN
