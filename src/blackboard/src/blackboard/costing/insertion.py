# SPDX-License-Identifier: BSD-3-Clause
"""Where in a robot's list one more task goes best, and what it takes there."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from itertools import accumulate
from operator import attrgetter
from types import MappingProxyType
from typing import TYPE_CHECKING, NamedTuple

from blackboard.costing.effort import Effort, Job, Series

if TYPE_CHECKING:
    from collections.abc import Sequence

    from blackboard.costing.aging import Aging
    from blackboard.costing.pace import Pace
    from blackboard.domain.characteristics import RobotCharacteristics
    from blackboard.domain.path_lengths import PathLengths
    from blackboard.domain.task import Task
    from hive_common.pose import Pose


@dataclass(frozen=True, slots=True)
class Insertion:
    """A place for one more task.

    Attributes:
        index: In the list, 0 is first.
        effort: What the task itself takes there.
        added_energy: How much more the robot draws because of it [J]; at least 0.
        added_way: How much further the robot drives because of it [m].
        before: What the robot does before its turn comes.
        finish: Time from now until the whole list is done with it [s].
        added_waiting: How much longer all tasks of the list wait until they are done, the wait
            of the task itself included, summed [s]; old tasks count more, see `aging`.
    """

    index: int
    effort: Effort
    added_energy: float
    added_way: float
    before: Effort
    finish: float
    added_waiting: float


_DIGITS = 6
"""Places are as good as each other if they differ by less than a micrometre or a microsecond."""


class Gain(NamedTuple):
    """What a place changes; see `Insertion`."""

    added_way: float
    finish: float
    added_waiting: float


PlaceRule = Callable[[Gain], float]
"""What is to be least at the best place."""

_MIN_WAY: PlaceRule = attrgetter("added_way")

_PLACE_RULES: Mapping[str, PlaceRule] = MappingProxyType(
    {"makespan": attrgetter("finish"), "latency": attrgetter("added_waiting")}
)


def place_rule(cost_model: str) -> PlaceRule:
    """Return what is to be least at the best place under a cost model, by its name."""
    return _PLACE_RULES.get(cost_model, _MIN_WAY)


@dataclass(frozen=True, slots=True)
class Stop:
    """A task on the list.

    Attributes:
        priority: Of the task.
        job: What is left to do of it.
        weight: What a second of waiting for it counts.
    """

    priority: int
    job: Job
    weight: float = 1.0


class Route:
    """A robot's list at one moment, for all bids on what is offered then.

    Args:
        here: Where the robot stands.
        stops: What it has to do, in this order.
        robot: What the robot is.
        ways: Knows how far it is.
        rule: What is to be least at the best place.
        keep_first: Whether the first stop is being done and stays there.
        aging: Says what a second of waiting counts.
        pace: Knows how long the robot's drives take.

    Attributes:
        before: What the robot has done from here before each place of the list, and before the
            place behind all.
    """

    def __init__(
        self,
        here: Pose,
        stops: Sequence[Stop],
        robot: RobotCharacteristics,
        path_lengths: PathLengths,
        rule: PlaceRule,
        *,
        keep_first: bool,
        aging: Aging,
        pace: Pace,
    ) -> None:
        self._stops = stops
        self._robot = robot
        self._path_lengths = path_lengths
        self._rule = rule
        self._keep_first = keep_first
        self._aging = aging
        self._pace = pace
        weights = [stop.weight for stop in reversed(stops)]
        self._weight_behind = [*accumulate(weights, initial=0.0)][::-1]
        self._own: list[Effort] = []
        self.before = [Effort(0.0, 0.0, 0.0, here)]
        for stop in stops:
            self._own.append(stop.job.effort_from(self.before[-1].end))
            self.before.append(self.before[-1].then(self._own[-1]))

    def best_place(self, *bundle: tuple[Task, int]) -> Insertion:
        """Find the best place for one more task, or for several that follow each other.

        They do not pass a higher priority, and where several places are as good, nothing that is
        on the list already.

        Args:
            piece: Tasks of one priority that `analyze_task` has passed, each with its first step
                that is still to be done.
        """
        task, _ = bundle[0]
        ahead = sum(
            1
            for index, stop in enumerate(self._stops)
            if stop.priority > task.priority or (self._keep_first and index == 0)
        )
        equals = sum(1 for stop in self._stops[ahead:] if stop.priority == task.priority)
        series = Series(
            [
                Job(each, step, self._robot, self._path_lengths, pace=self._pace)
                for each, step in bundle
            ],
            [self._aging.weight(each) for each, _ in bundle],
        )
        gains = [self._gain(index, series) for index in range(ahead, ahead + equals + 1)]
        best, nearest = 0, math.inf
        for number, gain in enumerate(gains):
            value = round(self._rule(gain), _DIGITS)
            if value <= nearest:
                best, nearest = number, value
        index, gain = ahead + best, gains[best]
        before = self.before[index]
        own = series.effort_from(before.end)
        added = own.energy
        if index < len(self._stops):
            behind = self._stops[index].job.effort_from(own.end)
            added = max(0.0, added + behind.energy - self._own[index].energy)
        return Insertion(
            index, own, added, gain.added_way, before, gain.finish, gain.added_waiting
        )

    def _gain(self, index: int, series: Series) -> Gain:
        before = self.before[index]
        added, longer, first = series.reach(before.end)
        if index < len(self._stops):
            way, duration = self._stops[index].job.reach(series.end_from(before.end))
            added += way - self._own[index].way
            longer += duration - self._own[index].duration
        waiting = series.weight * (before.duration + first) + series.waiting
        if behind := self._weight_behind[index]:
            waiting += behind * longer
        return Gain(added, self.before[-1].duration + longer, waiting)
