# SPDX-License-Identifier: BSD-3-Clause
"""Measures in which of many small hard layouts a fleet locks up."""

from __future__ import annotations

import statistics
from typing import TYPE_CHECKING, Any

import click
import numpy as np

from hive_lab.bench.registry import BenchResult
from hive_lab.fleets.adversarial import draw, drive

if TYPE_CHECKING:
    from hive_lab.bench.kept_runs import KeptRuns

LONGEST_STAND = 60.0  # [s]


def in_layouts(layouts: int, kept: KeptRuns) -> BenchResult:
    """Let a fleet drive in each of some layouts, from seed 0 on; `kept` as in `fleets`."""
    jobs = {f"adversarial, seed {seed}": (_driven, (seed,)) for seed in range(layouts)}
    done = dict(enumerate(kept.all_of(jobs)))
    failed = [
        seed
        for seed, each in done.items()
        if not each["solved"] or each["longest_stand"] > LONGEST_STAND or each["contacts"]
    ]
    for seed in failed:
        click.echo(f"seed {seed}: {done[seed]}\n{draw(seed)}", err=True)
    stands = [each["longest_stand"] for each in done.values()]
    figures = {
        "layouts": float(layouts),
        "unsolved": float(sum(not each["solved"] for each in done.values())),
        "first failed seed": float(min(failed, default=-1)),
        "contacts": float(sum(each["contacts"] for each in done.values())),
        "longest stand": max(stands),
        "median of the longest stands": statistics.median(stands),
        "longest run": max(each["took"] for each in done.values()),
        "locks": float(sum(each["locks"] for each in done.values())),
    }
    aims = {"unsolved": 0.0, "contacts": 0.0, "longest stand": LONGEST_STAND}
    return BenchResult(figures, aims, bool(failed))


def _driven(seed: int) -> dict[str, Any]:
    with np.errstate(invalid="raise"):
        done = drive(draw(seed), seed)
    return {
        "solved": done.reached == done.asked,
        "took": done.took,
        "longest_stand": done.longest_stand,
        "contacts": done.contacts,
        "locks": done.locks,
    }
