# SPDX-License-Identifier: BSD-3-Clause
"""Plans robots one after the other; each moves those out of its way that come after it.

A robot that is planned may drive through where a robot stands that is not planned yet. That one is
planned at once, among the reservations of those before it: it inherits the right of the one
that it hinders, as in PIBT (Okumura et al., Priority Inheritance with Backtracking for Iterative
Multi-agent Path Finding, Artificial Intelligence 310, 2022), but with whole paths in continuous
time. If it cannot get out of the way, the first one goes back, takes it to stand longer, at last
for ever, and is planned again.

So a robot that is not planned yet can always stay where it is, and there is always a plan. The
first robot waits only for what cannot move out of its way.
"""

from __future__ import annotations

import math
from collections import deque
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from hive_navigation.mapf.fleet import Fleet

if TYPE_CHECKING:
    from collections.abc import Collection, Iterable, Sequence

    from hive_navigation.mapf.path_search import Path

PATIENCE = (0.0, 1.5, 4.0, math.inf)
"""For how long a robot that has to move aside is taken to stand, in lanes that it could drive.

A robot that has to turn or to speed up never clears its start at once, so it begins with the next.
"""

DEPTH = 12  # most robots that push each other in a row
TRIES = 8  # most plans of one robot for those that it has to push
BUMPS = 5  # how often a robot takes out those in its way, on average
REFUGES = 24  # places to which a robot may be let out
SHARE = 60  # most searches for one robot and all those that it has to push


class PushingFleet(Fleet):
    """Robots that are planned one after the other; see the module.

    Attributes:
        contested: Those of which one found no way past another, since all plans were forgotten.
    """

    contested: frozenset[int] = frozenset()

    def forget(self) -> None:
        """Forget all plans, and who was contested."""
        super().forget()
        self.contested = frozenset()

    def settle_freely(self, order: Sequence[int], fixed: Collection[int]) -> bool:
        """Plan robots in some order as if those that are not planned yet were not there.

        One that finds no way to its goal takes out whoever is in its way, and goes before them.

        Args:
            order: In which they are planned.
            fixed: Those that may not be taken out.

        Returns:
            Whether there is a plan for all; where there are many robots, there may be none.
        """
        waiting = deque(robot for robot in order if self.paths[robot] is None)
        bumps = dict.fromkeys(order, 0)
        left = BUMPS * len(waiting)
        while waiting:
            robot = waiting.popleft()
            path = self.find(robot)
            others: Collection[int] = ()
            if not self._satisfies(robot, path):
                others = self._bumped(robot, path, fixed)
            if others:
                left -= 1
                if left < 0:
                    return False
                bumps[robot] += 1
                for other in others:
                    self.take(other)
                path = self.find(robot)
                waiting.extendleft(sorted(others, key=bumps.__getitem__))
            if path is None:
                return False
            self.put(robot, path)
        return True

    def _bumped(self, robot: int, path: Path | None, fixed: Collection[int]) -> set[int]:
        """Return whom a robot takes out that gets, by its best path, not as far as it wants to.

        Those in its way, and those that drive through where it is if it cannot go anywhere.
        """
        others = {*self.hinder(robot)}
        if path is None:
            others |= {*self.blockers(robot, self.stand(robot))}
        others -= {*fixed}
        self.contested |= {robot, *others}
        return others

    def _satisfies(self, robot: int, path: Path | None) -> bool:
        """Return whether a path leads to a robot's goal or up to the horizon."""
        return path is not None and (
            path.complete or path.end >= self._horizon or self.tasks[robot].goal < 0
        )

    def settle_all(self, order: Sequence[int]) -> bool:
        """Plan robots in some order.

        Returns:
            False if one that is not planned cannot get out of the way of one that was planned
            before; never if none was, or only robots that stand.
        """
        for robot in order:
            if self.paths[robot] is None:
                self._stand_until(robot, self._until(robot, 0))
        for robot in self._in_the_way(range(len(self.tasks))):
            if self.paths[robot] is None and not self._settle_within(robot):
                return False
        for robot in order:
            if self.paths[robot] is None and not self._settle_within(robot):
                self.put(robot, self._around_all(robot))
        return True

    def _around_all(self, robot: int) -> Path:
        """Return the path of a robot that pushes nobody."""
        stood = dict(self._stood)
        self._get_up(robot)
        for other in list(self._stood):
            self._stand_until(other, math.inf)
        path = self.find(robot)
        for other, until in stood.items():
            self._stand_until(other, until)
        return self.stand(robot) if path is None else path

    def _settle_within(self, robot: int) -> bool:
        """Plan a robot and those in its way with its share of the effort."""
        self._budget = min(self.effort, SHARE)
        self.effort -= self._budget
        done = self._settle(robot, 0)
        self.effort += self._budget
        return done

    def _settle(self, robot: int, depth: int) -> bool:
        """Plan a robot and those in its way; return whether it succeeded, else nothing changed."""
        stood = dict(self._stood)
        self._get_up(robot)
        done = depth < DEPTH and self._settle_patiently(robot, depth)
        for other, until in stood.items():
            if self.paths[other] is None and self._stood.get(other) != until:
                self._stand_until(other, until)
        return done

    def _settle_patiently(self, robot: int, depth: int) -> bool:
        """Plan a robot; wait the longer for those in its way the less they can get out of it."""
        patient: dict[int, int] = {}
        for attempt in range(TRIES):
            if self._budget <= 0:
                return False
            self._budget -= 1
            path = self.find(robot)
            if path is None:
                return False
            mark = len(self._settled)
            stood = dict(self._stood)
            self.put(robot, path)
            stuck = self._push(robot, depth)
            if stuck is None:
                return True
            for other in reversed(self._settled[mark:]):
                self.take(other)
                if other != robot:
                    self._stand_until(other, stood[other])
            more = 1 if attempt < TRIES // 2 else len(PATIENCE)
            patient[stuck] = patient.get(stuck, 0) + more
            until = self._until(stuck, patient[stuck])
            if depth == 0 and math.isinf(until) and self._let_out(robot, stuck):
                return True
            self._stand_until(stuck, until)
        return False

    def _let_out(self, robot: int, stuck: int) -> bool:
        """Plan a robot that is stuck behind another one out of its way first.

        That other one goes aside for it and then to its goal. The one that was stuck goes on from
        where it let the other one pass in a later plan.
        """
        ideal = self._found(robot, self._nobody)
        if ideal is None:
            return False
        until, task = self._stood[stuck], self.tasks[stuck]
        times = self.searches[stuck].times_from(task.start)
        refuges = np.argsort(times, kind="stable")
        passed = self.searches[robot].places_of(ideal.actions[0::2])
        refuges = refuges[~np.isin(refuges, passed) & np.isfinite(times[refuges])]
        self._get_up(stuck)
        for refuge in refuges[:REFUGES].tolist():
            mark = len(self._settled)
            stood = dict(self._stood)
            self.tasks[stuck] = task._replace(goal=refuge)
            dwell, self.dwells[stuck] = self.dwells[stuck], math.inf
            # The other one needs some time to clear its start.
            self._stand_until(robot, self._until(robot, 0))
            out = self.find(stuck)
            self._get_up(robot)
            self.tasks[stuck], self.dwells[stuck] = task, dwell
            if out is None or not out.complete:
                continue
            left = float(self.searches[stuck].times_from(task.goal)[refuge])
            self.put(stuck, replace(out, complete=False, left=left))
            path = self.find(robot)
            if path is not None and self._satisfies(robot, path):
                self.put(robot, path)
                if self._push(stuck, 1) is None and self._push(robot, 1) is None:
                    return True
            for other in reversed(self._settled[mark:]):
                self.take(other)
                if other in stood:
                    self._stand_until(other, stood[other])
        self._stand_until(stuck, until)
        return False

    def _push(self, robot: int, depth: int) -> int | None:
        """Plan those in the way of a robot; return one that cannot get out of it, or None."""
        for other in self._in_the_way([robot]):
            if self.paths[other] is None and not self._settle(other, depth + 1):
                return other
        return None

    def _in_the_way(self, robots: Iterable[int]) -> list[int]:
        """Return who is not planned yet and stands where robots drive, first come first."""
        waiting = np.array(sorted(self._stood), dtype=np.intp)
        if not len(waiting):
            return []
        when = np.full(len(waiting), math.inf)
        for robot in robots:
            if self.paths[robot] is not None:
                found = self.reservations.blocked_by(
                    robot, self._sizes[waiting], self._starts[waiting]
                )
                when = np.minimum(when, found)
        order = np.argsort(when, kind="stable")
        return [int(waiting[k]) for k in order if when[k] < math.inf]

    def _until(self, robot: int, patience: int) -> float:
        """Return until when a robot that has to move aside is taken to stand [s]."""
        search = self.searches[robot]
        factor = PATIENCE[min(patience + (1 if search.turns else 0), len(PATIENCE) - 1)]
        return self.tasks[robot].ready + factor * search.one_lane
