# SPDX-License-Identifier: BSD-3-Clause
"""The optimum for a handful of tasks: dynamic programming over all sets of them.

Held and Karp's recursion ("A dynamic programming approach to sequencing problems", 1962) gives
each robot's best list for each set of tasks; a second one distributes the tasks. Time and memory
double with every task: 10 tasks take some tens of milliseconds, 14 some seconds.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from blackboard.errors import AllocationError

if TYPE_CHECKING:
    from collections.abc import Iterator

    from blackboard.auction.search.problem import Floats, Numbers
    from hive_lab.allocation.instance import Instance

MAX_TASKS = 14


def optimum(instance: Instance, objective: str) -> float:
    """Return the least sum of energies [J], makespan [s] or sum of weighted times to done [s].

    It is infinite if no robot can do some task. `objective` is `energy`, `makespan` or `latency`.

    Raises:
        AllocationError: There are more than `MAX_TASKS` tasks, or they have several priorities.
    """
    tasks = len(instance.tasks)
    if tasks > MAX_TASKS or (tasks and np.ptp(instance.tasks.priority)):
        raise AllocationError(
            f"{tasks} tasks with priorities {sorted(set(instance.tasks.priority.tolist()))}; "
            f"allowed: at most {MAX_TASKS} of one priority"
        )
    share = np.full(1 << tasks, np.inf)
    share[0] = 0.0
    for robot in range(len(instance.robots)):
        share = _shared(share, _best_lists(instance, robot, objective), objective)
    return float(share[-1])


def _best_lists(instance: Instance, robot: int, objective: str) -> Floats:
    """Return the cost of each set of tasks (a bit mask) for one robot in its best order."""
    tasks = len(instance.tasks)
    pace = (
        instance.robots.draw[robot] if objective == "energy" else 1 / instance.robots.speed[robot]
    )
    work = 0.0 * instance.tasks.work if objective == "energy" else instance.tasks.work
    way, own = instance.way * pace, instance.tasks.inner * pace + work
    ready = 0.0 if objective == "energy" else instance.robots.ready[robot]
    masks = np.arange(1 << tasks)
    bits = (masks[:, None] >> np.arange(tasks)) & 1
    # In the sum of times to done, a second counts once for every remaining task.
    weight = bits @ instance.tasks.weight if objective == "latency" else np.ones(masks.size)
    rest = np.full((masks.size, tasks), np.inf)
    for mask in range(1, masks.size):
        for first in np.flatnonzero(bits[mask] & instance.able[robot]):
            left = mask & ~(1 << int(first))
            behind = (weight[left] * way[first] + rest[left]).min() if left else 0.0
            rest[mask, first] = weight[mask] * own[first] + behind
    begin = weight[:, None] * (ready + way[tasks + robot])
    best: Floats = (begin + rest).min(axis=1, initial=np.inf)
    best[0] = 0.0 if objective != "makespan" else ready
    return best


def _shared(share: Floats, own: Floats, objective: str) -> Floats:
    """Return the cost of each set of tasks when one more robot does a part of it."""
    join = np.maximum if objective == "makespan" else np.add
    found = np.empty_like(share)
    for mask, parts in _parts(share.size):
        found[mask] = join(share[mask ^ parts], own[parts]).min()
    return found


def _parts(size: int) -> Iterator[tuple[int, Numbers]]:
    """Yield each set with all its subsets, as bit masks."""
    masks = np.arange(size)
    for mask in range(size):
        yield mask, masks[: mask + 1][(masks[: mask + 1] & ~mask) == 0]
