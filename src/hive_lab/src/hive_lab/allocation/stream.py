# SPDX-License-Identifier: BSD-3-Clause
"""Tasks that arrive over virtual time, and the results of a policy.

A policy is asked whenever a task arrives or a robot becomes free. It may change every list; a task
that has begun is no longer on one.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Protocol

import numpy as np

from hive_lab.allocation.instance import Instance, Robots, Tasks

if TYPE_CHECKING:
    from collections.abc import Iterator

    from blackboard.auction.search.problem import Floats, Numbers, Plan


@dataclass(frozen=True)
class StreamState:
    """The situation for a policy.

    Attributes:
        instance: The tasks that have not begun, in posting order.
        plan: The current lists.
        age: (tasks,) time since each was posted [s].
        has_arrival: Whether there is a new task, which is on no list; otherwise a robot is free.
    """

    instance: Instance
    plan: Plan
    age: Floats
    has_arrival: bool


class Policy(Protocol):
    """Decides on the lists."""

    def decide(self, state: StreamState) -> Plan:
        """Return the new lists. A task may be on none, and is offered again later."""


@dataclass(frozen=True)
class Stream:
    """Tasks of an instance, and when each is posted [s], ascending."""

    instance: Instance
    posted: Floats

    @classmethod
    def poisson(cls, instance: Instance, load: float, random: np.random.Generator) -> Stream:
        """Return a Poisson stream.

        `load` is the share of the robots' time that the tasks would take in a random order.
        Above 1 the waiting times grow, unless the tasks are put in a better order.
        """
        tasks = len(instance.tasks)
        mean = float(instance.way[:tasks].mean() + instance.tasks.inner.mean())
        rate = load * float(instance.robots.speed.sum()) / mean
        return cls(instance, random.exponential(1 / rate, size=tasks).cumsum())


def simulate(stream: Stream, policy: Policy) -> Floats:
    """Return the time from posting to done of each task [s]; infinite if never done."""
    floor = _Floor(stream)
    for now, has_arrival in floor.events():
        floor.ask(policy, now, has_arrival=has_arrival)
    return floor.done - stream.posted


class _Floor:
    """The robots' positions, and the tasks that have not begun."""

    def __init__(self, stream: Stream) -> None:
        self._stream = stream
        robots = len(stream.instance.robots)
        self._node = np.arange(robots) + len(stream.instance.tasks)
        self._free = stream.instance.robots.ready.copy()
        self._lists: list[list[int]] = [[] for _ in range(robots)]
        self._arrived = 0
        self._waiting: list[int] = []
        self._began = False  # whether a task did at the last event
        self.done = np.full(len(stream.instance.tasks), np.inf)

    def events(self) -> Iterator[tuple[float, bool]]:
        """Yield the time of every arrival and of every robot that becomes free, in order."""
        now = -np.inf
        while True:
            left = self._stream.posted[self._arrived :]
            arrival = float(left[0]) if left.size else np.inf
            busy = self._free[self._free > now]
            before, now = now, min(arrival, float(busy.min(initial=np.inf)))
            if not np.isfinite(now) and self._began:
                now = before  # a task took no time, because its robot stood there already
            if not np.isfinite(now) or not (left.size or self._waiting):
                return
            if now == arrival:
                self._waiting.append(self._arrived)
                self._arrived += 1
            yield now, now == arrival

    def ask(self, policy: Policy, now: float, *, has_arrival: bool) -> None:
        """Let a policy decide, and let free robots begin."""
        self._began = False
        if not self._waiting:
            return
        waiting = np.array(self._waiting)
        number = {task: index for index, task in enumerate(self._waiting)}
        plan = tuple(tuple(number[task] for task in row) for row in self._lists)
        age = now - self._stream.posted[waiting]
        state = StreamState(self._now(waiting, now), plan, age, has_arrival)
        self._lists = [[int(waiting[index]) for index in row] for row in policy.decide(state)]
        for robot, row in enumerate(self._lists):
            if row and self._free[robot] <= now:
                self._begin(robot, row.pop(0), now)

    def _now(self, waiting: Numbers, now: float) -> Instance:
        whole = self._stream.instance
        tasks = [getattr(whole.tasks, name)[waiting] for name in Tasks.__dataclass_fields__]
        ready = np.maximum(self._free - now, 0.0)
        robots = Robots(whole.robots.speed, ready, whole.robots.draw)
        rows = np.concatenate([waiting, self._node])
        return Instance(
            robots, Tasks(*tasks), whole.way[np.ix_(rows, waiting)], whole.able[:, waiting]
        )

    def _begin(self, robot: int, task: int, now: float) -> None:
        whole = self._stream.instance
        way = whole.way[self._node[robot], task] + whole.tasks.inner[task]
        end = now + way / whole.robots.speed[robot] + whole.tasks.work[task]
        self._free[robot] = self.done[task] = end
        self._node[robot] = task
        self._waiting.remove(task)
        self._began = True
