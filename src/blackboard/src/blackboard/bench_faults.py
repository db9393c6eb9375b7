# SPDX-License-Identifier: BSD-3-Clause
"""Measures how many schedules of faults are simulated in a second, and what they find."""

from __future__ import annotations

import multiprocessing
import os
import time
from collections import Counter
from concurrent.futures import ProcessPoolExecutor
from typing import TYPE_CHECKING

from blackboard.simulation.run import run as run_schedule
from blackboard.simulation.schedule import draw

if TYPE_CHECKING:
    from blackboard.simulation.run import Outcome

_AT_ONCE = 10
"""Schedules that a process takes at a time."""

AIMS = {"violations": 0.0}


def run(schedules: int = 1000, first: int = 0) -> dict[str, dict[str, float]]:
    """Run schedules on all processors.

    Args:
        schedules: How many, at least 1.
        first: Seed of the first.

    Returns:
        `figures`: schedules per second and in all, events per second, takeovers, violations, the
        seed of the first violation (-1 where there is none), how many faults of each kind
        happened; `aims`: no violations.
    """
    began = time.perf_counter()
    outcomes = simulate(range(first, first + schedules))
    took = time.perf_counter() - began
    faults: Counter[str] = Counter()
    for outcome in outcomes:
        faults += outcome.faults
    bad = [outcome.schedule.seed for outcome in outcomes if outcome.violation]
    figures = {
        "schedules": float(len(outcomes)),
        "schedules_per_second": len(outcomes) / took,
        "events_per_second": sum(outcome.events for outcome in outcomes) / took,
        "takeovers": float(sum(outcome.takeovers for outcome in outcomes)),
        "violations": float(len(bad)),
        "first_violation": float(bad[0]) if bad else -1.0,
    }
    for kind, count in sorted(faults.items()):
        figures[f"faults_{kind.lower().replace(' ', '_')}"] = float(count)
    return {"figures": figures, "aims": AIMS}


def simulate(seeds: range) -> list[Outcome]:
    """Run the schedules of some seeds on all processors."""
    context = multiprocessing.get_context("forkserver")
    with ProcessPoolExecutor(os.cpu_count(), mp_context=context) as pool:
        return list(pool.map(_simulate_one, seeds, chunksize=_AT_ONCE))


def _simulate_one(seed: int) -> Outcome:
    return run_schedule(draw(seed))
