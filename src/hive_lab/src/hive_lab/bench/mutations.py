# SPDX-License-Identifier: BSD-3-Clause
"""Measures how many fault schedules it takes to notice each mutation of the program."""

from __future__ import annotations

import statistics
from dataclasses import asdict
from typing import TYPE_CHECKING, Any

import click

from hive_lab.bench.kept_runs import KeptRuns, program_tree
from hive_lab.bench.registry import BenchResult
from hive_lab.fault_schedules.mutations.search import MUTATIONS, search

if TYPE_CHECKING:
    from pathlib import Path


def run(schedules: int = 1000, resume: Path | None = None, *, zenoh: bool = False) -> BenchResult:
    """Search for a schedule that notices each mutation, on all processors.

    Args:
        schedules: How many run for a mutation at most.
        resume: Where the result of each search is kept, for this commit of the program.
        zenoh: Whether the messages go over Zenoh.

    Returns:
        How many mutations there are, how many of them past mistakes; how many no schedule has
        noticed; the most schedules that it took and their median, and how many it took for each.
        The aim: each is noticed.

    Raises:
        hive_common.errors.FileError: `resume` holds something else.
    """
    tree, over = program_tree(), ", over Zenoh" if zenoh else ""
    jobs = {
        f"{each.name}, {schedules} at most, {tree}{over}": (_search, (number, schedules, zenoh))
        for number, each in enumerate(MUTATIONS)
    }
    found = KeptRuns(resume).all_of(jobs)
    took = [result["schedules"] for result in found]
    for mutation, result in zip(MUTATIONS, found, strict=True):
        told = f"{result['where']}: {result['broken']}" if result["where"] else "NOT noticed"
        click.echo(f"{mutation.name}: {told}", err=True)
    figures = {
        "mutations": float(len(MUTATIONS)),
        "past_mistakes": float(sum(bool(each.bug) for each in MUTATIONS)),
        "not_noticed": float(sum(not result["where"] for result in found)),
        "most_schedules": float(max(took)),
        "median_of_schedules": float(statistics.median(took)),
    }
    each_took = zip(MUTATIONS, took, strict=True)
    figures |= {f"schedules_to_{each.name.replace(' ', '_')}": float(n) for each, n in each_took}
    return BenchResult(figures, {"not_noticed": 0.0}, broken=bool(figures["not_noticed"]))


def _search(number: int, most: int, zenoh: bool) -> dict[str, Any]:
    return asdict(search(MUTATIONS[number], most, zenoh=zenoh))
