# SPDX-License-Identifier: BSD-3-Clause
"""Measures how many fault schedules run in a second, and what they find."""

from __future__ import annotations

import itertools
import time
from collections import Counter
from contextlib import closing
from dataclasses import dataclass, field
from functools import partial
from typing import TYPE_CHECKING, Any

import click

from hive_lab.bench.kept_runs import KeptRuns, program_tree
from hive_lab.bench.mutations import run as search_mutations
from hive_lab.bench.registry import BenchResult
from hive_lab.bench.workers import workers
from hive_lab.fault_schedules.draw import draw
from hive_lab.fault_schedules.drawn_links import ROS, TRANSPORTS, ZENOH
from hive_lab.fault_schedules.features.exercised import FEATURES
from hive_lab.fault_schedules.long_run import run_with_freezes, run_with_losses
from hive_lab.fault_schedules.run import run as run_schedule

if TYPE_CHECKING:
    from collections.abc import Generator, Iterable, Iterator, Mapping
    from pathlib import Path

    from hive_lab.fault_schedules.run import RunResult

_PIECE = 200  # schedules whose results are kept together
_BATCH = 10  # schedules per batch of a process
_PROGRESS_EVERY = 5.0  # time between two progress messages [s]
_HOURS, _LOSS = 10.0, 0.3
_FREEZES, _FREEZE = 100, 5.0

AIMS = {
    "violations": 0.0,
    "takeovers_in_10_h_of_losses": 0.0,
    "most_takeovers_for_a_freeze": 1.0,
    "longest_gap_after_a_freeze": 1.0,
    "rivals": 0.0,
}


@dataclass
class _Sum:
    """The sum of the results of some schedules.

    Attributes:
        took: Time on the wall [s]; of the pieces of a sum, the sum of theirs.
    """

    schedules: int = 0
    events: int = 0
    takeovers: int = 0
    hours: float = 0.0
    took: float = 0.0
    faults: Counter[str] = field(default_factory=Counter)
    exercised: Counter[str] = field(default_factory=Counter)
    bad: list[int] = field(default_factory=list)

    def add(self, result: RunResult) -> None:
        """Add one schedule's result."""
        self.schedules += 1
        self.events += result.events
        self.takeovers += result.takeovers
        self.hours += result.lasted / 3600.0
        self.faults.update(result.faults)
        self.exercised.update(result.exercised.keys())
        if result.violation:
            self.bad.append(result.schedule.seed)

    def add_kept(self, kept: Mapping[str, Any]) -> None:
        """Add a sum that was kept, as `vars` made it."""
        for name in ("schedules", "events", "takeovers", "hours", "took"):
            setattr(self, name, getattr(self, name) + kept[name])
        self.faults.update(kept["faults"])
        self.exercised.update(kept["exercised"])
        self.bad += kept["bad"]

    @property
    def figures(self) -> dict[str, float]:
        """The figures by name."""
        figures = {
            "schedules": float(self.schedules),
            "schedules_per_second": self.schedules / self.took,
            "events_per_second": self.events / self.took,
            "virtual_hours": self.hours,
            "takeovers": float(self.takeovers),
            "violations": float(len(self.bad)),
            "first_violation": float(min(self.bad, default=-1)),
        }
        faults = sorted(self.faults.items())
        return (
            figures
            | {f"faults_{_word(kind)}": float(count) for kind, count in faults}
            | {f"schedules_with_{_word(name)}": float(self.exercised[name]) for name in FEATURES}
        )


def _word(name: str) -> str:
    return name.lower().replace(":", "").replace(" ", "_")


def run(
    schedules: int = 1000,
    first: int = 0,
    resume: Path | None = None,
    transport: str = ROS,
    *,
    mutations: bool = False,
) -> BenchResult:
    """Run schedules, from the seed `first` on, on all processors.

    Args:
        schedules: How many in all, those that `resume` knows included.
        first: The first seed.
        resume: Where the results of each piece are kept, so that a long measurement can go on.
        transport: What carries the messages, one of `TRANSPORTS`; over Zenoh its connections fail
            besides.
        mutations: Run schedules with each mutation instead; see `mutations.run`.

    Returns:
        Schedules per second and in all, events per second, hours of virtual time, takeovers,
        violations, the seed of the first violation (-1 if none), faults by kind, and in how many
        schedules each of `FEATURES` happened; takeovers in 10 hours with 30 % of the messages
        lost, and for each of 100 freezes of the leader for 5 s, with the longest time until
        another leader was heard [s]; these two not over Zenoh.
        Aims: no violation, no takeover by losses, one for each freeze within 1 s, no rivals.

    Raises:
        hive_common.errors.FileError: `resume` holds something else.
        click.UsageError: The transport is not simulated.
    """
    if transport not in TRANSPORTS:
        raise click.UsageError(
            f"faults simulates no --transport {transport}; allowed: {', '.join(TRANSPORTS)}"
        )
    zenoh = transport == ZENOH
    if mutations:
        return search_mutations(schedules, resume, zenoh=zenoh)
    kept = KeptRuns(resume)
    over = "over Zenoh, " if zenoh else ""
    pieces = {
        f"{over}seeds {seeds.start} to {seeds.stop - 1}": seeds
        for seeds in _pieces(first, schedules)
    }
    _run_missing(pieces, kept, schedules, zenoh=zenoh)
    total = _Sum()
    for name in pieces:
        total.add_kept(kept[name])
    trees = sorted({kept[name]["tree"] for name in pieces})
    if len(trees) > 1:
        click.echo(f"some pieces are of other programs; the commits: {', '.join(trees)}", err=True)
    figures = total.figures | ({} if zenoh else _idle_hive())
    aims = {name: aim for name, aim in AIMS.items() if name in figures}
    return BenchResult(figures, aims, broken=bool(total.bad))


def _run_missing(
    pieces: Mapping[str, range], kept: KeptRuns, schedules: int, *, zenoh: bool
) -> None:
    """Run and keep the pieces that are not known, and tell how it goes."""
    todo = {name: seeds for name, seeds in pieces.items() if name not in kept.names}
    done = schedules - sum(map(len, todo.values()))
    tree, ran = program_tree(), 0
    began = said = time.perf_counter()
    seeds_to_run = [seed for seeds in todo.values() for seed in seeds]
    with closing(simulate(seeds_to_run, zenoh=zenoh)) as results:
        for name, seeds in todo.items():
            piece, begun = _Sum(), time.perf_counter()
            for result in itertools.islice(results, len(seeds)):
                piece.add(result)
                ran += 1
                if result.violation:
                    click.echo(f"seed {result.schedule.seed}: {result.violation}", err=True)
                now = time.perf_counter()
                if now - said > _PROGRESS_EVERY:
                    said = now
                    rate = ran / (now - began)
                    click.echo(f"{done + ran} of {schedules}, {rate:.1f} schedules/s", err=True)
            piece.took = time.perf_counter() - begun
            kept.keep(name, {**vars(piece), "tree": tree})


def _pieces(first: int, schedules: int) -> Iterator[range]:
    for begin in range(first, first + schedules, _PIECE):
        yield range(begin, min(begin + _PIECE, first + schedules))


def _idle_hive() -> dict[str, float]:
    losses = run_with_losses(_HOURS, _LOSS, seed=1)
    freezes = run_with_freezes(_FREEZES, _FREEZE, seed=1)
    return {
        "takeovers_in_10_h_of_losses": float(sum(losses.takeovers)),
        "messages_lost_in_10_h": float(losses.lost),
        "fewest_takeovers_for_a_freeze": float(min(freezes.takeovers)),
        "most_takeovers_for_a_freeze": float(max(freezes.takeovers)),
        "longest_gap_after_a_freeze": max(freezes.gaps),
        "rivals": float(losses.rivals + freezes.rivals),
    }


def simulate(seeds: Iterable[int], *, zenoh: bool = False) -> Generator[RunResult, None, None]:
    """Run the schedules of these seeds on all processors, in the order of the seeds."""
    with workers("forkserver") as pool:
        yield from pool.map(partial(_simulate_one, zenoh=zenoh), seeds, chunksize=_BATCH)


def _simulate_one(seed: int, *, zenoh: bool) -> RunResult:
    return run_schedule(draw(seed, zenoh=zenoh))
