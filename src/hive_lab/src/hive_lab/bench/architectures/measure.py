# SPDX-License-Identifier: BSD-3-Clause
"""Measures architectures of a fleet manager side by side, on virtual time."""

from __future__ import annotations

import itertools
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from hive_lab.architectures.kinds import ARCHITECTURES
from hive_lab.architectures.run import CONDITIONS, Outcome
from hive_lab.architectures.run import run as run_one
from hive_lab.bench.kept_runs import KeptRuns
from hive_lab.bench.registry import BenchResult

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping, Sequence
    from pathlib import Path

SIZES = {2: 5, 5: 5, 10: 5, 20: 5, 50: 3, 100: 3}
"""Numbers of robots, each with how many seeds are run."""

FAULTY = (10, 50)
"""The sizes that are run under every condition; the others only as usual."""

SUMMED = ("not_done", "done_twice", "unanswered")
"""Figures that are summed over the seeds; of the others the median is told."""

_PROMISED = ("not_done", "done_twice")  # 0 with a hive, whatever goes wrong
_FIGURES = tuple(name for name in Outcome._fields if name not in {"posted", "ended"})


class Group(NamedTuple):
    """Runs that differ only in their seed."""

    robots: int
    condition: str
    architecture: str


def run(robots: int = 0, runs: int = 0, resume: Path | None = None) -> BenchResult:
    """Let fleets of all `SIZES` work under each architecture, and some of them with faults.

    Args:
        robots: The only size, which is run under every condition; 0 for all.
        runs: How many seeds for each size; 0 for those of `SIZES`.
        resume: Where each run is kept; `hive_lab.bench.architectures.picture` draws them.

    Returns:
        By size, condition and architecture the figures of `architectures.run.Outcome`. Aims: a
        hive does every task, and none twice.
    """
    sizes = {robots: SIZES.get(robots, 3)} if robots else SIZES
    faulty = (robots,) if robots else FAULTY
    kept = KeptRuns(resume)
    named = {
        group: [run_name(group, seed) for seed in range(1, (runs or sizes[group.robots]) + 1)]
        for group in groups(sizes, faulty)
    }
    jobs = {
        name: (measure, (group, seed))
        for group, names in named.items()
        for seed, name in enumerate(names, start=1)
    }
    kept.all_of(jobs)
    figures: dict[str, float] = {}
    aims: dict[str, float] = {}
    for group, names in named.items():
        prefix = "{}_robots_{}_{}".format(*group)
        found = over_seeds([kept[name] for name in names])
        figures |= {f"{prefix}_{name}": value for name, value in found.items()}
        if ARCHITECTURES[group.architecture].is_hive:
            aims |= {f"{prefix}_{name}": 0.0 for name in _PROMISED}
    return BenchResult(figures, aims, any(figures[name] > 0.0 for name in aims))


def groups(sizes: Sequence[int] | Mapping[int, int], faulty: Sequence[int]) -> Iterator[Group]:
    """Yield what is run: every architecture with each size, the faulty ones with every fault."""
    for group in itertools.starmap(Group, itertools.product(sizes, CONDITIONS, ARCHITECTURES)):
        if group.condition == "usual" or group.robots in faulty:
            yield group


def run_name(group: Group, seed: int) -> str:
    """Return the name under which a run is kept."""
    return f"{group.architecture}, {group.robots} robots, {group.condition}, seed {seed}"


def measure(group: Group, seed: int) -> dict[str, Any]:
    """Return the outcome of one run."""
    return run_one(group.architecture, group.robots, group.condition, seed)._asdict()


def over_seeds(runs: Sequence[Mapping[str, Any]]) -> dict[str, float]:
    """Return the figures of runs that differ only in their seed."""
    return {
        name: float((np.sum if name in SUMMED else np.median)([run[name] for run in runs]))
        for name in _FIGURES
    }
