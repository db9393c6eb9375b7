# SPDX-License-Identifier: BSD-3-Clause
"""The figures of a plan, and a plan made by the auction and the search."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from blackboard.auction.search.ruin_recreate import search
from blackboard.auction.search.searcher import Job
from blackboard.costing.cost import measure_for

if TYPE_CHECKING:
    from collections.abc import Iterable

    from blackboard.auction.search.problem import Plan
    from hive_lab.allocation.instance import Instance

SEED = 1


def figures(instance: Instance, plan: Plan) -> dict[str, float]:
    """Return the figures of a plan.

    Returns:
        `energy`, the path length of all robots [m]; `makespan` [s]; `latency` and `p95`, mean and
        95th percentile of the time to done [s].
    """
    problem = instance.problem()
    times = [problem.times(robot, row) for robot, row in enumerate(plan)]
    done = np.array([at for row in times for at in row])
    if done.size != len(instance.tasks):
        raise ValueError(f"{done.size} tasks on the lists, {len(instance.tasks)} to be given out")
    return {
        "energy": sum(problem.energy(robot, row) for robot, row in enumerate(plan)),
        "makespan": float(done.max()),
        "latency": float(done.mean()),
        "p95": float(np.percentile(done, 95)),
    }


def searched(instance: Instance, objective: str, rounds: int, seed: int = SEED) -> Plan:
    """Return the plan of auction and search; `objective` is the name of a cost model."""
    nothing: Plan = tuple(() for _ in instance.robots.ready)
    measure = measure_for(objective)
    job = Job(instance.problem(), nothing, measure, 0.0, seed, rounds, math.inf, math.inf)
    return search(job).plan


def mean_and_worst(name: str, ratios: Iterable[float]) -> dict[str, float]:
    """Return mean and worst of some ratios, as figures with names."""
    values = list(ratios)
    return {f"{name} mean": float(np.mean(values)), f"{name} worst": max(values)}
