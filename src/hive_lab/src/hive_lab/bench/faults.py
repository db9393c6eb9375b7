# SPDX-License-Identifier: BSD-3-Clause
"""Measures how many fault schedules run in a second, and what they find."""

from __future__ import annotations

import multiprocessing
import os
import time
from collections import Counter
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import click

from hive_lab.bench.registry import BenchResult
from hive_lab.fault_schedules.draw import draw
from hive_lab.fault_schedules.long_run import run_with_freezes, run_with_losses
from hive_lab.fault_schedules.run import run as run_schedule

if TYPE_CHECKING:
    from collections.abc import Iterator

    from hive_lab.fault_schedules.run import RunResult

_BATCH = 10  # schedules per batch of a process
_PROGRESS_EVERY = 5.0  # time between two progress messages [s]
_HOURS, _LOSS = 10.0, 0.2
_FREEZES, _FREEZE = 100, 5.0

AIMS = {
    "violations": 0.0,
    "takeovers_in_10_h_of_losses": 0.0,
    "most_takeovers_for_a_freeze": 1.0,
    "rivals": 0.0,
}


@dataclass
class _Sum:
    """The sum of all results so far."""

    schedules: int = 0
    events: int = 0
    takeovers: int = 0
    hours: float = 0.0
    left_behind: int = 0
    faults: Counter[str] = field(default_factory=Counter)
    bad: list[int] = field(default_factory=list)

    def add(self, result: RunResult) -> None:
        """Add one schedule's result."""
        self.schedules += 1
        self.events += result.events
        self.takeovers += result.takeovers
        self.hours += result.lasted / 3600.0
        self.left_behind += result.ended["left behind"]
        self.faults.update(result.faults)
        if result.violation:
            self.bad.append(result.schedule.seed)

    def figures(self, took: float) -> dict[str, float]:
        """Return the figures by name, of schedules that took a time [s]."""
        figures = {
            "schedules": float(self.schedules),
            "schedules_per_second": self.schedules / took,
            "events_per_second": self.events / took,
            "virtual_hours": self.hours,
            "takeovers": float(self.takeovers),
            "violations": float(len(self.bad)),
            "first_violation": float(min(self.bad, default=-1)),
            "left_behind": float(self.left_behind),
        }
        faults = sorted(self.faults.items())
        return figures | {
            f"faults_{kind.lower().replace(' ', '_')}": float(count) for kind, count in faults
        }


def run(schedules: int = 1000, first: int = 0) -> BenchResult:
    """Run schedules, from the seed `first` on, on all processors.

    Returns:
        Schedules per second and in all, events per second, hours of virtual time, takeovers,
        violations, the seed of the first violation (-1 if none), tasks left behind in a second
        hive, and faults by kind; takeovers in 10 hours with 20 % of the messages lost, and for
        each of 100 freezes of the leader for 5 s. Aims: no violation, no takeover by losses, one
        for each freeze, no rivals.
    """
    began = said = time.perf_counter()
    total = _Sum()
    for result in simulate(range(first, first + schedules)):
        total.add(result)
        if result.violation:
            click.echo(f"seed {result.schedule.seed}: {result.violation}", err=True)
        now = time.perf_counter()
        if now - said > _PROGRESS_EVERY:
            said = now
            rate = total.schedules / (now - began)
            click.echo(f"{total.schedules} of {schedules}, {rate:.1f} schedules/s", err=True)
    figures = total.figures(time.perf_counter() - began)
    figures |= _idle_hive()
    return BenchResult(figures, AIMS, broken=bool(total.bad))


def _idle_hive() -> dict[str, float]:
    losses = run_with_losses(_HOURS, _LOSS, seed=1)
    freezes = run_with_freezes(_FREEZES, _FREEZE, seed=1)
    return {
        "takeovers_in_10_h_of_losses": float(sum(losses.takeovers)),
        "messages_lost_in_10_h": float(losses.lost),
        "fewest_takeovers_for_a_freeze": float(min(freezes.takeovers)),
        "most_takeovers_for_a_freeze": float(max(freezes.takeovers)),
        "rivals": float(losses.rivals + freezes.rivals),
    }


def simulate(seeds: range) -> Iterator[RunResult]:
    """Run the schedules of these seeds on all processors, in the order of the seeds."""
    context = multiprocessing.get_context("forkserver")
    with ProcessPoolExecutor(os.cpu_count(), mp_context=context) as pool:
        yield from pool.map(_simulate_one, seeds, chunksize=_BATCH)


def _simulate_one(seed: int) -> RunResult:
    return run_schedule(draw(seed))
