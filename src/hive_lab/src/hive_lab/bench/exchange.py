# SPDX-License-Identifier: BSD-3-Clause
"""Measures what exchanging tasks gains in a running hive, on virtual time.

Robots are given tasks at random places of a square and never get on with the first ones, so that
what they have to do stays the same while they exchange it.
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
"""Robots, tasks, side of the square [m], and what is drawn anew in each run."""

LASTS = 80.0
"""Virtual time to exchange tasks in [s]: lateness and aging do not count yet."""

COST_MODELS = ("energy", "time", "makespan", "latency")
"""Those that make something small for the whole fleet."""


def run(seeds: Iterable[int] = SEEDS) -> BenchResult:
    """Let hives exchange tasks under each cost model.

    Args:
        seeds: What places are drawn from; a hive for each.

    Returns:
        `figures`: by cost model what the hive makes small, over what it was when all tasks had
        been given out, in the mean, and the number of tasks that were given anew; `aims`:
        exchanging makes nothing worse.
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
    """Return what lists take by where their robots begin, in metres of way: robots are alike."""
    ends = []
    for start, tasks in lists.items():
        stops = [start, *(goal for task in tasks for goal in task.goals)]
        ways = accumulate(one.distance_to(other) for one, other in pairwise(stops))
        ends.append([*ways][1::2])
    return {
        "way": sum(each[-1] for each in ends if each),
        "makespan": max(each[-1] for each in ends if each),
        "waiting": sum(map(sum, ends)),
    }
