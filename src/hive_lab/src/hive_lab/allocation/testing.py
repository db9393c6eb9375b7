# SPDX-License-Identifier: BSD-3-Clause
"""Small instances for tests: robots and tasks on a straight road."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from hive_lab.allocation.instance import Instance, Robots, Tasks

if TYPE_CHECKING:
    from collections.abc import Sequence

    from blackboard.auction.search.problem import Plan


def on_a_road(
    robots: Sequence[float],
    starts: Sequence[float],
    ends: Sequence[float] | None = None,
    *,
    priority: Sequence[int] | None = None,
    speed: Sequence[float] | None = None,
    ready: Sequence[float] | None = None,
) -> Instance:
    """Return robots and tasks on the x axis.

    Positions are in [m]; tasks by default end where they start and have priority 0. Robots by
    default drive at 1 m/s and are ready now, at 0 s.
    """
    start, end = np.array(starts, dtype=float), np.array(starts if ends is None else ends)
    here = np.concatenate([end, np.array(robots, dtype=float)])
    count, tasks = len(robots), len(starts)
    return Instance(
        Robots(
            np.array(speed or [1.0] * count, dtype=float),
            np.array(ready or [0.0] * count, dtype=float),
            np.ones(count),
        ),
        Tasks(
            np.abs(end - start).astype(float),
            np.zeros(tasks),
            np.ones(tasks),
            np.array(priority or [0] * tasks, dtype=int),
        ),
        np.abs(start[None, :] - here[:, None]),
        np.ones((count, tasks), dtype=bool),
    )


def figures(instance: Instance, plan: Plan) -> dict[str, float]:
    """Return the figures of a plan, computed task by task.

    Returns:
        `energy`, the sum of all paths [m]; `makespan` [s]; `latency`, the weighted sum of the
        times to done [s]; and `report`, the sum of place times path length [m].
    """
    energy = latency = toil = 0.0
    ends = []
    for robot, row in enumerate(plan):
        node = len(instance.tasks) + robot
        clock = float(instance.robots.ready[robot])
        for place, task in enumerate(row, start=1):
            way = float(instance.way[node, task] + instance.tasks.inner[task])
            clock += way / float(instance.robots.speed[robot]) + float(instance.tasks.work[task])
            energy += way
            toil += place * way
            latency += float(instance.tasks.weight[task]) * clock
            node = task
        ends.append(clock)
    return {"energy": energy, "makespan": max(ends), "latency": latency, "report": toil}
