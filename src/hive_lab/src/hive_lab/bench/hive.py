# SPDX-License-Identifier: BSD-3-Clause
"""Measures the cost of a hive over its size: whole hives in one process, on virtual time."""

from __future__ import annotations

import multiprocessing
import resource
import time
from concurrent.futures import ProcessPoolExecutor

import click

from hive_lab.bench.registry import BenchResult
from hive_lab.fault_schedules.large_hive import LargeHive

SIZES = (10, 30, 100, 300, 1000)  # robots
TASKS_EACH = 10  # tasks for each robot
_SEED = 1


def run(robots: int = 0) -> BenchResult:
    """Let a hive of some robots, or hives of all `SIZES` if it is 0, do ten tasks for each robot.

    Returns:
        By size: processor and wall time [s], virtual time [s], published and delivered messages
        for each task, the most tasks on the list, peak memory of the process [MB], unfinished
        tasks, and broken properties. Aim: nothing broken.
    """
    figures: dict[str, float] = {}
    context = multiprocessing.get_context("forkserver")
    sizes = (robots,) if robots else SIZES
    for size in sizes:
        with ProcessPoolExecutor(1, mp_context=context) as pool:
            found, violation = pool.submit(_measure, size).result()
        if violation:
            click.echo(f"{size} robots: {violation}", err=True)
        took, broken = found["cpu"], found["broken"]
        click.echo(f"{size} robots: {took:.0f} s, {broken:.0f} properties broken", err=True)
        figures |= {f"{size}_robots_{name}": value for name, value in found.items()}
    aims = {f"{size}_robots_broken": 0.0 for size in sizes}
    return BenchResult(figures, aims, any(figures[name] for name in aims))


def _measure(robots: int) -> tuple[dict[str, float], str]:
    wall, cpu = time.perf_counter(), time.process_time()
    tasks = TASKS_EACH * robots
    result = LargeHive(robots, tasks, _SEED).run()
    return {
        "tasks": float(tasks),
        "wall": time.perf_counter() - wall,
        "cpu": time.process_time() - cpu,
        "virtual": result.lasted,
        "messages_per_task": sum(result.sent.values()) / tasks,
        "events_per_task": result.events / tasks,
        "longest_list": float(result.longest_list),
        "memory": resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024,
        "takeovers": float(result.takeovers),
        "not_done": float(tasks - result.ended["DONE"]),
        "broken": float(bool(result.violation)),
    }, result.violation
