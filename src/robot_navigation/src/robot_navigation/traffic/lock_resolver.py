# SPDX-License-Identifier: BSD-3-Clause
"""Resolves locks: the rule, and a coordinator that obeys it.

1. The planner forgets the courses of the robots that are locked, and plans anew for them: for all
   members of a circle, else for the robot that makes no progress.
2. It does so again after `RETRY`, `TRIES` times in all.
3. A lock that lasts all the same is left to the right of way: for `LEFT_ALONE` its robots get
   routes without places. Such a robot drops its route, plans alone around what it sees, and moves
   aside or asks others to. Then the rule begins anew.

So no robot stands for ever because one plan, made again and again, cannot be driven.
"""

from __future__ import annotations

import math
from dataclasses import replace
from typing import TYPE_CHECKING, NamedTuple

from robot_navigation.traffic.coordinator import Coordinator, CoordinatorSettings
from robot_navigation.traffic.deadlock import Kind, LockWatch

if TYPE_CHECKING:
    from collections.abc import Iterable

    from robot_navigation.mapf.roadmap import Roadmap
    from robot_navigation.mapf.route import Route
    from robot_navigation.planning.clearance import ClearanceField
    from robot_navigation.traffic.deadlock import Lock
    from robot_navigation.traffic.right_of_way import Announcement

LOOK = 0.5  # time between two looks for locks [s]
RETRY = 4.0  # a new plan gets so long to resolve a lock [s]
TRIES = 2  # new plans before a lock is left to the right of way
LEFT_ALONE = 15.0  # how long its robots then go without routes [s]


class Remedy(NamedTuple):
    """What is done about locks.

    Attributes:
        plan_anew: The robots whose courses are forgotten now.
        left_alone: The robots that get no routes.
    """

    plan_anew: frozenset[str]
    left_alone: frozenset[str]


class LockResolver:
    """Remembers what was tried."""

    def __init__(self) -> None:
        self._tries: dict[frozenset[str], tuple[int, float]] = {}  # and when the last one was [s]
        self._alone_until: dict[str, float] = {}  # [s]

    def remedy(self, locks: Iterable[Lock], now: float) -> Remedy:
        """Return what to do at a time [s] about all locks that there are."""
        self._alone_until = {
            name: until for name, until in self._alone_until.items() if until > now
        }
        before, self._tries = self._tries, {}
        anew = set[str]()
        for lock in locks:
            robots = concerned(lock)
            tries, last = before.get(robots, (0, -math.inf))
            if not self._alone_until.keys().isdisjoint(robots):
                continue  # and once that is over, it is a new lock
            if now - last >= RETRY:
                if tries == TRIES:
                    self._alone_until.update(dict.fromkeys(robots, now + LEFT_ALONE))
                    continue
                tries, last = tries + 1, now
                anew |= robots
            self._tries[robots] = tries, last
        return Remedy(frozenset(anew), frozenset(self._alone_until))


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
            remedy = self._resolver.remedy(self.watch.look(now), now)
            self._left_alone = remedy.left_alone
            self._plan_anew(remedy.plan_anew)
        return tuple(
            replace(route, places=(), waits=(), complete=False)
            if route.robot in self._left_alone
            else route
            for route in super().step(now)
        )

    def _plan_anew(self, robots: Iterable[str]) -> None:
        """Forget the courses of robots, so that the next plan begins with what they claim."""
        for name in robots:
            known = self._robots.get(name)
            if known is not None:
                known.drive = None
                self._planned_at = -math.inf
