# SPDX-License-Identifier: BSD-3-Clause
"""Measures the gain of reallocation in a running hive, on virtual time.

Robots get tasks at random places of a square and never finish the first one, so their total work
stays constant while they exchange tasks.
"""

from __future__ import annotations

import math
import random
import statistics
from itertools import accumulate, pairwise
from typing import TYPE_CHECKING

from blackboard.costing.cost import measure_for
from blackboard.domain.settings import BlackboardSettings
from blackboard.domain.task import Task, TaskType
from hive_common.pose import Pose
from hive_lab.bench.registry import BenchResult
from hive_lab.virtual.hive import Hive

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping, Sequence

ROBOTS, TASKS, SIDE, SEEDS = 6, 30, 60.0, range(4)
"""Robots, tasks, side of the square [m], and the runs' seeds."""

LASTS = 80.0  # virtual time for reallocation [s]: before lateness and aging count

COST_MODELS = ("energy", "time", "makespan", "latency")
"""The models that minimise a figure of the whole fleet."""


def run(seeds: Iterable[int] = SEEDS) -> BenchResult:
    """Let hives reallocate under each cost model, one hive for each seed.

    Returns:
        By cost model the mean ratio of the minimised figure after reallocation to that before, and
        the mean number of reassigned tasks. Aim: no figure gets worse.
    """
    figures = {}
    for model in COST_MODELS:
        runs = [_exchange(model, seed) for seed in seeds]
        figures[f"{model} {measure_for(model)}"] = statistics.mean(share for share, _ in runs)
        figures[f"{model} given anew"] = statistics.mean(again for _, again in runs)
    aims = {f"{model} {measure_for(model)}": 1.0 for model in COST_MODELS}
    return BenchResult(figures, aims)


def _exchange(model: str, seed: int) -> tuple[float, float]:
    draw = random.Random(seed)

    def place() -> Pose:
        return Pose(draw.uniform(0.0, SIDE), draw.uniform(0.0, SIDE))

    hive = Hive(BlackboardSettings(improve_by=measure_for(model)))
    starts = {f"robot{number}": place() for number in range(ROBOTS)}
    for name, start in starts.items():
        hive.add_robot(name, start, cost_model=model)
        hive.commands[name].duration = lambda _: math.inf
    names = [f"T{number}" for number in range(TASKS)]
    tasks = {name: Task(name, TaskType.GAB, (place(), place())) for name in names}

    def taken() -> float:
        lists = {
            start: [tasks[name] for name in hive.robots[robot].status.tasks]
            for robot, start in starts.items()
        }
        return _taken(lists)[measure_for(model)]

    hive.post(*tasks.values())
    while sum(len(robot.status.tasks) for robot in hive.robots.values()) < TASKS:
        hive.network.run(0.05)
    before = taken()
    hive.network.run(LASTS)
    again = sum(hive.record(name).assignment for name in names) - TASKS
    return taken() / before, float(again)


def _taken(lists: Mapping[Pose, Sequence[Task]]) -> dict[str, float]:
    """Return what lists cost by their starting poses, as path lengths [m]: robots are alike."""
    ends = []
    for start, tasks in lists.items():
        stops = [start, *(goal for task in tasks for goal in task.goals)]
        lengths = accumulate(one.distance_to(other) for one, other in pairwise(stops))
        ends.append([*lengths][1::2])
    return {
        "way": sum(each[-1] for each in ends if each),
        "makespan": max(each[-1] for each in ends if each),
        "waiting": sum(map(sum, ends)),
    }
