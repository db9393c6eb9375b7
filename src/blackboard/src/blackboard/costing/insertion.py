# SPDX-License-Identifier: BSD-3-Clause
"""Where in a robot's schedule one more task goes best, and what it takes there."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from itertools import accumulate
from operator import attrgetter
from types import MappingProxyType
from typing import TYPE_CHECKING, NamedTuple

from blackboard.costing.effort import Effort, Job

if TYPE_CHECKING:
    from collections.abc import Sequence

    from blackboard.costing.effort import Predictor
    from blackboard.domain.task import Task
    from hive_common.pose import Pose


_MAX_DOUBLINGS = 20.0
"""A factor of a million is more than any schedule is long."""


class Aging:
    """Says what a second of waiting counts for a task now, so that no task waits forever.

    Where short tasks go before long ones, new short ones might keep doing so. The longer a task
    has waited, the more its waiting counts, until it goes before everything new.

    Args:
        now: Gives the time on the clock of `Task.posted` [s].
        doubling: Time in which it doubles [s]; infinite if age does not count.
    """

    def __init__(self, now: Callable[[], float] = lambda: 0.0, doubling: float = math.inf) -> None:
        self._now = now
        self._doubling = doubling

    def weight(self, task: Task) -> float:
        """Return what a second counts; 1 for a task that is new or does not say how old it is."""
        if task.posted <= 0.0:
            return 1.0
        age = max(0.0, self._now() - task.posted)
        return float(2.0 ** min(age / self._doubling, _MAX_DOUBLINGS))


class Insertion(NamedTuple):
    """One position for one more task."""

    position: int  # in the schedule; 0 is first
    effort: Effort  # what the task itself takes there
    before: Effort  # what the robot does before its turn comes
    added_distance: float  # how much further the robot drives because of it [m]
    added_energy: float  # how much more the robot draws because of it [J]; at least 0
    finish: float  # time from now until the whole schedule is done with it [s]
    # How much longer all tasks of the schedule wait until they are done, its own wait included,
    # summed [s]; old tasks count more, see `Aging`.
    added_waiting: float


InsertionRule = Callable[[Insertion], float]
"""What is least at the best position."""

shortest: InsertionRule = attrgetter("added_distance")

INSERTION_RULES: Mapping[str, InsertionRule] = MappingProxyType(
    {"makespan": attrgetter("finish"), "latency": attrgetter("added_waiting")}
)
"""By the names of cost models; the others go by `shortest`."""

_DIGITS = 6
"""Positions that differ by less than a micrometre or a microsecond are equally good."""


@dataclass(frozen=True, slots=True)
class Stop:
    """A task on the schedule."""

    priority: int  # of the task
    job: Job  # what is left to do of it
    weight: float = 1.0  # what a second of waiting for it counts


class Route:
    """A robot's schedule at one moment, for all bids on what is offered then.

    Args:
        stops: What it has to do, in this order.
        rule: What is least at the best position.
        keep_first: Whether the first stop is under way and stays first.

    Attributes:
        before: What the robot has done from here before each stop, and after the last one.
    """

    def __init__(
        self,
        here: Pose,
        stops: Sequence[Stop],
        predictor: Predictor,
        rule: InsertionRule,
        *,
        keep_first: bool,
        aging: Aging,
    ) -> None:
        self._stops = stops
        self._predictor = predictor
        self._rule = rule
        self._keep_first = keep_first
        self._aging = aging
        weights = [stop.weight for stop in reversed(stops)]
        self._weight_behind = [*accumulate(weights, initial=0.0)][::-1]
        self._own: list[Effort] = []
        self.before = [Effort(0.0, 0.0, 0.0, here)]
        for stop in stops:
            self._own.append(stop.job.effort_from(self.before[-1].end))
            self.before.append(self.before[-1].then(self._own[-1]))

    def best_insertion(self, task: Task, step: int) -> Insertion:
        """Find the best position for one more task, from a step on.

        It does not pass a higher priority. Of equally good positions it takes the last, so that
        it passes nothing that is on the schedule already.
        """
        ahead = sum(
            1
            for index, stop in enumerate(self._stops)
            if stop.priority > task.priority or (self._keep_first and index == 0)
        )
        equals = sum(1 for stop in self._stops[ahead:] if stop.priority == task.priority)
        job, weight = Job(task, step, self._predictor), self._aging.weight(task)
        positions = range(ahead, ahead + equals + 1)
        insertions = [self._insertion(position, job, weight) for position in positions]
        best, least = insertions[0], math.inf
        for insertion in insertions:
            value = round(self._rule(insertion), _DIGITS)
            if value <= least:
                best, least = insertion, value
        return best

    def _insertion(self, position: int, job: Job, weight: float) -> Insertion:
        """Return what inserting a job takes; a second of waiting for it counts `weight`."""
        before = self.before[position]
        own = job.effort_from(before.end)
        waiting = weight * (before.duration + own.duration)
        distance, energy, longer = own.distance, own.energy, own.duration
        if position < len(self._stops):
            earlier = self._own[position]
            later = self._stops[position].job.effort_from(own.end)
            distance += later.distance - earlier.distance
            energy = max(0.0, energy + later.energy - earlier.energy)
            longer += later.duration - earlier.duration
        if behind := self._weight_behind[position]:
            waiting += behind * longer
        finish = self.before[-1].duration + longer
        return Insertion(position, own, before, distance, energy, finish, waiting)
