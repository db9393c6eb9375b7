# SPDX-License-Identifier: BSD-3-Clause
"""Resolves locks: the rule, and a coordinator that obeys it.

1. The planner forgets the courses of the robots that are locked, and plans anew for them: for all
   members of a circle, else for the robot that makes no progress.
2. If the lock lasts for `RETRY`, or comes back, it plans these robots, and those for which they
   wait, in one search, until they have left their goals.
3. If it still lasts after `SEARCHED`, it is left to the right of way: for `LEFT_ALONE` its robots
   get routes without places. Such a robot drops its route, plans alone around what it sees, and
   moves aside or asks others to. Then the rule begins anew.

So no robot stands for ever because one plan, made again and again, cannot be driven.
"""

from __future__ import annotations

import math
from dataclasses import replace
from typing import TYPE_CHECKING, NamedTuple

from hive_navigation.traffic.coordinator import Coordinator, CoordinatorSettings
from hive_navigation.traffic.deadlock import Kind, LockWatch

if TYPE_CHECKING:
    from collections.abc import Iterable, Sequence

    from hive_navigation.mapf.roadmap import Roadmap
    from hive_navigation.mapf.route import Route
    from hive_navigation.planning.clearance import ClearanceField
    from hive_navigation.traffic.deadlock import Lock
    from hive_navigation.traffic.right_of_way import Announcement

LOOK = 0.5  # time between two looks for locks [s]
RETRY = 4.0  # a new plan gets so long to resolve a lock [s]
SEARCHED = 40.0  # and a plan that was made in one search so long [s]
WAITS = (0.0, RETRY, SEARCHED)
"""How long after the remedy before a lock gets the next one [s]: plans, a search, left alone."""

COMES_BACK = 60.0  # a lock of a robot that had one so short a time ago has come back [s]
LEFT_ALONE = 15.0  # how long its robots then go without routes [s]


class Remedy(NamedTuple):
    """What is done about locks.

    Attributes:
        plan_anew: The robots whose courses are forgotten now.
        plan_together: Groups that are planned in one search from now on.
        left_alone: The robots that get no routes.
    """

    plan_anew: frozenset[str]
    plan_together: tuple[frozenset[str], ...]
    left_alone: frozenset[str]


class LockResolver:
    """Remembers what was tried."""

    def __init__(self) -> None:
        self._tried: dict[str, tuple[int, float]] = {}  # how often, and when the last time [s]
        self._alone_until: dict[str, float] = {}  # [s]

    def remedy(
        self, locks: Sequence[Lock], now: float, groups: Iterable[frozenset[str]] = ()
    ) -> Remedy:
        """Return what to do about all locks that there are.

        Args:
            locks: Of which each robot without progress is the first of one.
            now: The time [s].
            groups: Robots that are planned in one search now and have not got to their goals.
        """
        self._alone_until = {
            name: until for name, until in self._alone_until.items() if until > now
        }
        self._tried = {
            name: (tries, last)
            for name, (tries, last) in self._tried.items()
            if now - last < COMES_BACK
        }
        stuck = set().union(*map(concerned, locks))
        # While one of a group makes progress, the others wait for it as they are planned to.
        at_work = set[str]().union(*(group for group in groups if group - stuck))
        anew, together = set[str](), list[frozenset[str]]()
        for lock in locks:
            robots = concerned(lock)
            if not at_work.isdisjoint(robots):
                self._tried.update(dict.fromkeys(robots, (2, now)))
                continue
            tries, last = max(self._tried.get(name, (0, -math.inf)) for name in robots)
            if not self._alone_until.keys().isdisjoint(robots) or now - last < WAITS[tries]:
                continue
            if tries == 0:
                anew |= robots
            elif tries == 1:
                together.append(frozenset(lock.robots))
            else:
                self._alone_until.update(dict.fromkeys(robots, now + LEFT_ALONE))
            after = (tries + 1) % len(WAITS)
            self._tried.update(dict.fromkeys(robots, (after, now)))
        return Remedy(frozenset(anew), tuple(together), frozenset(self._alone_until))


def concerned(lock: Lock) -> frozenset[str]:
    """Return the robots of a lock for which something is done."""
    return frozenset(lock.robots if lock.kind is Kind.CIRCLE else lock.robots[:1])


class ResolvingCoordinator(Coordinator):
    """A coordinator that finds locks and resolves them; it takes what a coordinator takes.

    Attributes:
        watch: Knows the locks.
    """

    def __init__(
        self,
        field: ClearanceField,
        roadmap: Roadmap,
        epoch: int = 1,
        settings: CoordinatorSettings | None = None,
        watch: LockWatch | None = None,
    ) -> None:
        super().__init__(field, roadmap, epoch, settings)
        self.watch = LockWatch() if watch is None else watch
        self._resolver = LockResolver()
        self._looked_at = -math.inf
        self._left_alone: frozenset[str] = frozenset()

    def hear(self, said: Announcement) -> None:
        """Take in what the robot announces."""
        super().hear(said)
        self.watch.hear(said)

    def step(self, now: float) -> tuple[Route, ...]:
        """Return a new plan if one is due, else nothing; robots left alone have no places in it.

        Args:
            now: The time [s].
        """
        if not self._looked_at <= now < self._looked_at + LOOK:
            self._looked_at = now
            remedy = self._resolver.remedy(self.watch.look(now), now, self.groups())
            self._left_alone = remedy.left_alone
            self.plan_anew(remedy.plan_anew)
            for robots in remedy.plan_together:
                self.plan_together(robots)
            self.plan_apart(remedy.left_alone)
        return tuple(
            replace(route, places=(), waits=(), complete=False)
            if route.robot in self._left_alone
            else route
            for route in super().step(now)
        )
