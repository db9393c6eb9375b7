# SPDX-License-Identifier: BSD-3-Clause
"""Measures what a hive costs over its size: whole hives in one process, on virtual time."""

from __future__ import annotations

import multiprocessing
import resource
import time
from concurrent.futures import ProcessPoolExecutor
from typing import TYPE_CHECKING

from hive_lab.fault_schedules.crowd import Crowd

if TYPE_CHECKING:
    from collections.abc import Callable

SIZES = (10, 30, 100, 300, 1000)
"""Robots."""

TASKS_EACH = 10
"""Tasks for each robot."""

_SEED = 1


def run(
    sizes: tuple[int, ...] = SIZES, say: Callable[[str], None] = lambda _: None
) -> dict[str, dict[str, float]]:
    """Let hives of some sizes do ten tasks for each robot, each hive in a process of its own.

    Args:
        sizes: How many robots, each at least 2.
        say: Told in words how far it is, and of every broken property.

    Returns:
        `figures`, by size: processor and wall time [s], virtual time [s], messages that were
        published and that were handed over for each task, the most tasks on the list, peak memory
        of the process [MB], tasks that were not done, and properties that were broken; `aims`:
        nothing broken.
    """
    figures: dict[str, float] = {}
    context = multiprocessing.get_context("forkserver")
    for robots in sizes:
        with ProcessPoolExecutor(1, mp_context=context) as pool:
            found, violation = pool.submit(_measure, robots).result()
        if violation:
            say(f"{robots} robots: {violation}")
        say(f"{robots} robots: {found['cpu']:.0f} s, {found['broken']:.0f} properties broken")
        figures |= {f"{robots}_robots_{name}": value for name, value in found.items()}
    aims = {f"{robots}_robots_broken": 0.0 for robots in sizes}
    return {"figures": figures, "aims": aims}


def _measure(robots: int) -> tuple[dict[str, float], str]:
    wall, cpu = time.perf_counter(), time.process_time()
    tasks = TASKS_EACH * robots
    outcome = Crowd(robots, tasks, _SEED).run()
    return {
        "tasks": float(tasks),
        "wall": time.perf_counter() - wall,
        "cpu": time.process_time() - cpu,
        "virtual": outcome.lasted,
        "messages_per_task": sum(outcome.sent.values()) / tasks,
        "events_per_task": outcome.events / tasks,
        "longest_list": float(outcome.longest_list),
        "memory": resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024,
        "takeovers": float(outcome.takeovers),
        "not_done": float(tasks - outcome.ended["DONE"]),
        "broken": float(bool(outcome.violation)),
    }, outcome.violation
