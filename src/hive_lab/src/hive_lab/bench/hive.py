# SPDX-License-Identifier: BSD-3-Clause
"""Measures what a hive costs over its size: whole hives in one process, on virtual time."""

from __future__ import annotations

import multiprocessing
import resource
import time
from concurrent.futures import ProcessPoolExecutor

import click

from hive_lab.bench.registry import BenchResult
from hive_lab.fault_schedules.large_hive import LargeHive

SIZES = (10, 30, 100, 300, 1000)
"""Robots."""

TASKS_EACH = 10
"""Tasks for each robot."""

_SEED = 1


def run(*sizes: int) -> BenchResult:
    """Let hives of some sizes do ten tasks for each robot, each hive in a process of its own.

    Args:
        sizes: How many robots, each at least 2; `SIZES` where none is given.

    Returns:
        `figures`, by size: processor and wall time [s], virtual time [s], messages that were
        published and that were handed over for each task, the most tasks on the list, peak memory
        of the process [MB], tasks that were not done, and properties that were broken; `aims`:
        nothing broken.
    """
    figures: dict[str, float] = {}
    context = multiprocessing.get_context("forkserver")
    sizes = sizes or SIZES
    for robots in sizes:
        with ProcessPoolExecutor(1, mp_context=context) as pool:
            found, violation = pool.submit(_measure, robots).result()
        if violation:
            click.echo(f"{robots} robots: {violation}", err=True)
        took, broken = found["cpu"], found["broken"]
        click.echo(f"{robots} robots: {took:.0f} s, {broken:.0f} properties broken", err=True)
        figures |= {f"{robots}_robots_{name}": value for name, value in found.items()}
    aims = {f"{robots}_robots_broken": 0.0 for robots in sizes}
    return BenchResult(figures, aims, any(figures[name] for name in aims))


def _measure(robots: int) -> tuple[dict[str, float], str]:
    wall, cpu = time.perf_counter(), time.process_time()
    tasks = TASKS_EACH * robots
    outcome = LargeHive(robots, tasks, _SEED).run()
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
