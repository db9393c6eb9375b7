# SPDX-License-Identifier: BSD-3-Clause
"""Measures the cost of computing bids at the robots and at the blackboard.

Whole hives run in this process on virtual time. Two tasks for each robot are posted at once. Until
all are assigned, the processor time of every member is measured, and the size of all calls for
bids and answers as serialized for ROS.
"""

from __future__ import annotations

import io
import time
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from blackboard.codec.tables import WIRES
from blackboard.costing.euclidean_lengths import EuclideanLengths
from blackboard.domain.settings import BlackboardSettings
from blackboard.domain.talker import TASK_BROADCAST, TASK_COST, TASK_STATE
from blackboard.domain.task import Task, TaskState, TaskType
from hive_common.pose import Pose
from hive_lab.bench.allocation.instances import Floor
from hive_lab.bench.registry import BenchResult
from hive_lab.virtual.hive import Hive
from hive_lab.virtual.network import NetworkTalker

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from blackboard.domain.path_lengths import PathLengths
    from hive_lab.virtual.network import Call, Network, Subscription

DECISIONS = ("distributed", "centralized")
SIZES = {"straight": (2, 5, 10, 20, 50, 100), "map": (2, 5, 10, 20)}
"""Numbers of robots, with straight paths and on the warehouse map."""

_TASKS_EACH = 2
_SIDE = 100.0  # side of the floor without a map [m]
_SLICE = 0.05
_LIMIT = 300.0  # virtual time for all tasks to be assigned [s]


@dataclass(frozen=True)
class Taken:
    """The cost of assigning a task, the mean over a burst.

    Attributes:
        size: Of all calls for bids and answers, each counted once [byte].
        blackboard: Processor time of the blackboard [s].
        robot: Of the busiest robot [s].
        every: Of all members together [s].
    """

    size: float
    blackboard: float
    robot: float
    every: float


class TimedTalker(NetworkTalker):
    """A talker that sums its member's processor time in `spent` [s]."""

    def __init__(self, network: Network, member: str) -> None:
        super().__init__(network, member)
        self.spent = 0.0

    def subscribe(
        self, topic: str, handler: Callable[[Any], None], when: Callable[[], bool] | None = None
    ) -> Subscription:
        """Subscribe to a topic."""
        return super().subscribe(
            topic, lambda message: self._timed(lambda: handler(message)), when
        )

    def every(self, period: float, action: Callable[[], None]) -> Call:
        """Call periodically."""
        return super().every(period, lambda: self._timed(action))

    def after(self, delay: float, action: Callable[[], None]) -> Call:
        """Call once."""
        return super().after(delay, lambda: self._timed(action))

    def _timed(self, action: Callable[[], None]) -> None:
        since = time.process_time()
        action()
        self.spent += time.process_time() - since


class TimedHive(Hive):
    """A hive that measures its members' processor time."""

    talkers: dict[str, TimedTalker]  # type: ignore[assignment]  # narrower, and made only below

    def _talker(self, member: str) -> NetworkTalker:
        talker = self.talkers[member] = TimedTalker(self.network, member)
        return talker


class Places:
    """Draws places on the floor, a map or an empty square, and knows the paths between them."""

    def __init__(self, floor: Floor | None, seed: int) -> None:
        self._floor = floor
        self._draw = np.random.default_rng(seed)

    def some(self, number: int) -> list[Pose]:
        """Return random places."""
        if self._floor is not None:
            return self._floor.places(self._draw, number)
        return [Pose(*map(float, xy)) for xy in self._draw.uniform(0.0, _SIDE, (number, 2))]

    def path_lengths(self) -> PathLengths:
        """Return the path lengths of a process of its own, its map prepared."""
        if self._floor is None:
            return EuclideanLengths()
        path_lengths = self._floor.own_path_lengths()
        here = self._floor.places(np.random.default_rng(0), 1)[0]
        path_lengths.length(here, here)
        return path_lengths


def burst(decision: str, robots: int, floor: Floor | None = None) -> Taken:
    """Return the cost of assigning two tasks for each robot, posted at once."""
    places = Places(floor, robots)
    hive = TimedHive(BlackboardSettings(decision=decision), path_lengths=places.path_lengths())
    for number, place in enumerate(places.some(robots)):
        path_lengths = places.path_lengths() if decision == "distributed" else EuclideanLengths()
        hive.add_robot(f"robot{number}", place, cost_model="latency", path_lengths=path_lengths)
    hive.network.run(1.0)
    count = _TASKS_EACH * robots
    ends = zip(places.some(count), places.some(count), strict=True)
    tasks = [Task(f"T{n}", TaskType.GPAB, pair, payload=1.0) for n, pair in enumerate(ends)]
    mark = len(hive.network.sent)
    for talker in hive.talkers.values():
        talker.spent = 0.0
    hive.post(*tasks)
    end = hive.network.now + _LIMIT
    while _assigned(hive, mark) < count and hive.network.now < end:
        hive.network.run(_SLICE)
    spent = {name: talker.spent / count for name, talker in hive.talkers.items()}
    blackboard = spent.pop("blackboard")
    size = sum(_size(*each) for each in hive.network.sent[mark:]) / count
    return Taken(size, blackboard, max(spent.values()), blackboard + sum(spent.values()))


def _assigned(hive: Hive, mark: int) -> int:
    """Return how many tasks were assigned since a position in `sent`."""
    told = (message for topic, message in hive.network.sent[mark:] if topic == TASK_STATE)
    return len({each.task_id for each in told if each.state is TaskState.ASSIGNED})


def _size(topic: str, message: object) -> int:
    if topic not in {TASK_BROADCAST, TASK_COST}:
        return 0
    buffer = io.BytesIO()
    WIRES[topic].encode(message).serialize(buffer)
    return buffer.tell()


def run(sizes: dict[str, Sequence[int]] | None = None) -> BenchResult:
    """Measure both decisions over the size of the fleet; see `SIZES`.

    Returns:
        For each task `..._bytes` [byte], and the processor time of the blackboard, of the busiest
        robot and of all members [s], by path lengths, number of robots and decision.
    """
    floors = {"straight": None, "map": Floor()}
    figures = {}
    for way, numbers in (sizes or SIZES).items():
        for robots in numbers:
            for decision in DECISIONS:
                taken = burst(decision, robots, floors[way])
                name = f"{way}_{robots}_{decision}"
                figures[f"{name}_bytes"] = taken.size
                figures[f"{name}_blackboard"] = taken.blackboard
                figures[f"{name}_robot"] = taken.robot
                figures[f"{name}_all"] = taken.every
    return BenchResult(figures, {})
