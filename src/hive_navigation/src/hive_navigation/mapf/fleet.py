# SPDX-License-Identifier: BSD-3-Clause
"""The robots of one plan while it is made: who is planned, and what that blocks for the others."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from hive_navigation.mapf.path_search import Path
from hive_navigation.mapf.reservations import Reservations

if TYPE_CHECKING:
    from collections.abc import Sequence

    from hive_common.geometry import Array, Indices
    from hive_navigation.mapf.path_search import PathSearch, Task
    from hive_navigation.mapf.zone_counts import ZoneCounts

IDLE = 0.01  # what the time of a robot counts that only makes way, beside that of others
GAIN = 0.1  # a shorter path that is worth a change [s]
STICK = 3.0  # how much faster a new way must be than the way that a robot has [s]
NEVER = 1e5  # when a robot that does not get to its goal is taken to go on, without a horizon [s]


class Fleet:
    """The robots of one plan, and what each is to do as far as it is planned.

    Attributes:
        tasks: What each robot is planned for.
        sizes: The number of each robot's size in the reservations.
        searches: How each robot's paths are found.
        paths: What each robot does; None if it is not planned yet.
        effort: How many searches are left.
        counts: How many robots are in zones with a limit; None without such zones.
        dwells: How long each robot stays at its goal [s].
        habits: The lanes and legs that a robot was to drive along before, (k,), by robot.
    """

    def __init__(
        self,
        tasks: Sequence[Task],
        sizes: Sequence[int],
        searches: Sequence[PathSearch],
        reservations: Reservations,
        horizon: float,
        effort: int,
        states: int,
        dwells: Sequence[float],
    ) -> None:
        """Start with no robot planned.

        Args:
            tasks: What each robot is planned for.
            sizes: The number of each robot's size in the reservations.
            searches: How each robot's paths are found.
            reservations: Of nobody yet.
            horizon: From when on a path may end anywhere [s].
            effort: Most searches.
            states: Most states of one search.
            dwells: How long each robot stays at its goal [s].
        """
        self.tasks = list(tasks)
        self.sizes = sizes
        self.searches = searches
        self.paths: list[Path | None] = [None] * len(tasks)
        self.effort = effort
        self.habits: dict[int, Indices] = {}
        self.counts: ZoneCounts | None = None
        self.reservations = reservations
        self._horizon = horizon
        self._states = states
        self.dwells = list(dwells)
        self._stood: dict[int, float] = {}
        self._budget = 0
        self._nobody = Reservations.like(reservations)
        self._ideals: dict[int, Path | None] = {}
        self._alone: dict[int, float] = {}  # how long each robot takes to its goal, alone [s]
        self._settled: list[int] = []
        self._sizes = np.array(sizes, dtype=np.intp)
        starts = zip(tasks, searches, strict=True)
        self._starts = np.array([s.thing(task.start) for task, s in starts], dtype=np.intp)

    def put(self, robot: int, path: Path) -> None:
        """Plan a robot."""
        self._get_up(robot)
        self.paths[robot] = path
        self.reservations.add(robot, self.sizes[robot], path.actions, path.times)
        if self.counts is not None:
            self.counts.put(robot, path)
        self._settled.append(robot)

    def take(self, robot: int) -> Path:
        """Forget a robot's plan and return it."""
        path = self.paths[robot]
        if path is None:
            raise ValueError(f"robot {robot} is not planned")
        self.reservations.remove(robot, self.sizes[robot], path.actions)
        if self.counts is not None:
            self.counts.take(robot)
        self.paths[robot] = None
        self._settled.remove(robot)
        return path

    def forget(self) -> None:
        """Forget all plans."""
        for robot, path in enumerate(self.paths):
            if path is not None:
                self.take(robot)
            self._get_up(robot)
        self.habits.clear()

    def fits(self, robot: int, path: Path) -> bool:
        """Return whether a path meets none of the others."""
        return self.reservations.are_free(self.sizes[robot], *self._needs(robot, path))

    def _needs(self, robot: int, path: Path) -> tuple[Indices, Array]:
        """Return which places and ways a path needs, and when."""
        search = self.searches[robot]
        things = path.actions.copy()
        things[0::2] = search.things_of(path.actions[0::2])
        things[1::2] = search.ways_of(path.actions[1::2])
        # A place has to be free from when the robot sets out to it.
        times = path.times.copy()
        times[2::2, 0] = times[1::2, 0]
        return things, times

    def free_from(self, robot: int) -> Array:
        """Return from when on each place and way is free for a robot for ever [s]."""
        return self.reservations.free_from(self.sizes[robot])

    def stand(self, robot: int) -> Path:
        """Return the path of a robot that stays where it is."""
        task = self.tasks[robot]
        return Path(
            self._standing(robot),
            np.array([[-math.inf, math.inf]]),
            complete=task.start == task.goal,
            left=0.0 if task.goal < 0 else self.searches[robot].alone(task),
        )

    def find(self, robot: int, most: float = math.inf) -> Path | None:
        """Return the fastest path of a robot among the others, or None.

        It keeps to where it drove before unless another way is faster by `STICK`.

        Args:
            robot: The robot.
            most: What another path may cost at most; see `cost` [s].
        """
        latest = math.inf if self.tasks[robot].goal < 0 else most
        if robot not in self.habits:
            return self._found(robot, self.reservations, latest=latest)
        task = self.tasks[robot]
        kept = self._found(robot, self.reservations, self.habits[robot])
        soonest = task.ready + self.searches[robot].alone(task)
        if kept is not None and kept.complete and kept.end <= soonest + STICK:
            return kept
        path = self._found(robot, self.reservations, latest=latest)
        if kept is None or path is None or (path.complete and not kept.complete):
            return path
        return kept if kept.end + kept.left <= path.end + path.left + STICK else path

    def shorten(self, robot: int, only: Indices) -> None:
        """Plan a robot anew along some lanes and legs, (k,), if it gets to its end sooner."""
        path = self.take(robot)
        found = self._found(robot, self.reservations, only)
        if found is None or found.complete < path.complete or found.end > path.end - GAIN:
            found = path
        self.put(robot, found)

    def _found(
        self,
        robot: int,
        reservations: Reservations,
        only: Indices | None = None,
        latest: float = math.inf,
    ) -> Path | None:
        """Return the fastest path of a robot among reservations, or None."""
        return self.searches[robot].find(
            self.tasks[robot],
            self.sizes[robot],
            reservations,
            self._horizon,
            self._states,
            self.dwells[robot],
            only,
            latest,
        )

    def cost(self, robot: int) -> float:
        """Return when a robot gets to its goal by its plan, at least [s]."""
        path = self.paths[robot]
        if path is None:
            raise ValueError(f"robot {robot} is not planned")
        if self.tasks[robot].goal < 0:
            return IDLE * max(path.end, 0.0)
        if path.complete:
            return path.end
        return max(path.end, min(self._horizon, NEVER)) + path.left

    def least(self, robot: int) -> float:
        """Return when a robot gets to its goal if it is alone [s]; 0 without one."""
        task = self.tasks[robot]
        if task.goal < 0:
            return 0.0
        if robot not in self._alone:
            self._alone[robot] = self.searches[robot].alone(task)
        return task.ready + self._alone[robot]

    def delay(self, robot: int) -> float:
        """Return how much later a robot gets to its goal than if it were alone [s]."""
        if self.tasks[robot].goal < 0:
            return 0.0
        return max(self.cost(robot) - self.least(robot), 0.0)

    def hinder(self, robot: int) -> list[int]:
        """Return who is in a robot's way if it goes as if it were alone."""
        if robot not in self._ideals:
            self._ideals[robot] = self._found(robot, self._nobody)
        path = self._ideals[robot]
        return [] if path is None else self.blockers(robot, path)

    def blockers(self, robot: int, path: Path) -> list[int]:
        """Return who is in a robot's way on a path."""
        things, times = self._needs(robot, path)
        found = self.reservations.blockers(self.sizes[robot], things, times)
        # Bodies have numbers behind those of the robots, and full zones negative ones.
        return [int(other) for other in found if 0 <= other < len(self.tasks) and other != robot]

    def _stand_until(self, robot: int, until: float) -> None:
        """Take a robot that is not planned yet to stand where it is until some time [s]."""
        self._get_up(robot)
        self._stood[robot] = until
        times = np.array([[-math.inf, until]])
        self.reservations.add(robot, self.sizes[robot], self._standing(robot), times)

    def _get_up(self, robot: int) -> None:
        """Forget that a robot that is not planned yet stands at its start."""
        if self._stood.pop(robot, None) is not None:
            self.reservations.remove(robot, self.sizes[robot], self._standing(robot))

    def _standing(self, robot: int) -> Indices:
        """Return the action of a robot that stands at its start, (1,)."""
        standing = self.searches[robot].standing(self.tasks[robot].start)
        return np.array([standing], dtype=np.intp)
