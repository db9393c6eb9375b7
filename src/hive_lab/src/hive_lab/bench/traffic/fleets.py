# SPDX-License-Identifier: BSD-3-Clause
"""Measures fleets in the simulator: what they keep of their throughput, and whom they touch."""

from __future__ import annotations

import dataclasses
import statistics
from typing import TYPE_CHECKING, Any, NamedTuple

import click

from hive_lab.bench.registry import BenchResult
from hive_lab.fleets import fault_runs
from hive_lab.fleets.crowd import MODELS, Drive
from hive_lab.fleets.sites import SITES
from hive_lab.fleets.throughput import Throughput, TimeAlone, Trouble, measure, share_kept

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping, Sequence

    from hive_lab.bench.kept_runs import KeptRuns

ALONE = 1800.0  # how long one robot alone drives [s]
LONGEST_STAND = 30.0  # [s]
BY_DELAYS = 0.05  # share of its throughput that a fleet may lose because robots stop at random
LD60 = ("ld60",)


class Fleet(NamedTuple):
    """A fleet in the simulator.

    Attributes:
        site: Where it drives, a name of `SITES`.
        robots: How many there are.
        models: Their models, in turn.
        loses: The share of its throughput that it may lose; None without an aim.
    """

    site: str
    robots: int
    models: tuple[str, ...] = LD60
    loses: float | None = None

    @property
    def name(self) -> str:
        """What its figures are called by."""
        return f"{self.site} {self.robots}{' mixed' if len(self.models) > 1 else ''}"


FLEETS = (
    Fleet("warehouse", 10, LD60, 0.02),
    Fleet("warehouse", 30, LD60, 0.06),
    Fleet("warehouse", 50, LD60, 0.12),
    Fleet("lab", 4, LD60, 0.04),
    Fleet("lab", 8, LD60, 0.10),
    Fleet("lab", 4, MODELS),
    Fleet("hall", 40, MODELS),
)


def chosen(site: str | None, robots: int | None) -> list[Fleet]:
    """Return the fleets of a site, or all; with a number of robots, one of LD-60s if need be.

    Raises:
        click.UsageError: There is no such site, or it is not known where robots are to drive.
    """
    if site is not None and site not in SITES:
        raise click.UsageError(f"--site {site}; allowed: {', '.join(sorted(SITES))}")
    fleets = [fleet for fleet in FLEETS if site in {None, fleet.site}]
    if robots is None:
        return fleets
    as_large = [fleet for fleet in fleets if fleet.robots == robots]
    if not as_large and site is None:
        known = ", ".join(fleet.name for fleet in FLEETS)
        raise click.UsageError(f"--robots {robots} needs a --site; without one allowed: {known}")
    return as_large or [Fleet(site or "", robots)]


def of_fleets(
    fleets: Sequence[Fleet],
    seconds: float,
    runs: int,
    trouble: Trouble,
    kept: KeptRuns,
    *,
    planned: bool,
) -> BenchResult:
    """Let fleets drive, and each of their models alone.

    Args:
        fleets: Which ones.
        seconds: How long each drives, simulated [s].
        runs: With how many seeds, from 1 on.
        trouble: What is in their way. With delays, they drive without them too.
        kept: Knows runs that have been done, and keeps those that are done now.
        planned: Whether a traffic planner coordinates them.
    """
    troubles = [trouble]
    if trouble.delays:
        troubles.append(dataclasses.replace(trouble, delays=False))
    alone = {
        f"{site} {model} alone, {ALONE:g} s": (_driven, (Fleet(site, 1, (model,)), 1, ALONE))
        for site, model in sorted({(f.site, model) for f in fleets for model in f.models})
    }
    seeds = {
        (fleet, its, seed): f"{fleet.name}, {_how(its, planned)}, seed {seed}, {seconds:g} s"
        for fleet in fleets
        for its in troubles
        for seed in range(1, runs + 1)
    }
    driven = {
        name: (_driven, (fleet, seed, seconds, planned, its))
        for (fleet, its, seed), name in seeds.items()
    }
    found = [_throughput(data) for data in kept.all_of(alone | driven)]
    times: dict[tuple[str, str], TimeAlone] = {}
    for (_, (fleet, *_)), drove in zip(alone.values(), found, strict=False):
        (model,) = fleet.models
        times[fleet.site, model] = TimeAlone(SITES[fleet.site](), model, drove.reached)
    of_fleet = dict(zip(seeds, found[len(alone) :], strict=True))
    figures: dict[str, float] = {}
    aims: dict[str, float] = {}
    for fleet in fleets:
        on_site = {model: times[fleet.site, model] for model in fleet.models}
        found_in = [
            [drove for key, drove in of_fleet.items() if key[:2] == (fleet, its)]
            for its in troubles
        ]
        listed = [*_figures(fleet, found_in[0], on_site)]
        if trouble.delays:
            delayed, free = (_kept(each, on_site) for each in found_in)
            listed.append(("loses by delays", 1.0 - delayed / free, BY_DELAYS))
        for name, value, aim in listed:
            figures[f"{fleet.name} {name}"] = value
            if aim is not None:
                aims[f"{fleet.name} {name}"] = aim
    contacts = any(value for name, value in figures.items() if name.endswith("contacts"))
    return BenchResult(figures, aims, contacts)


def _how(trouble: Trouble, planned: bool) -> str:
    """Return what the name of a run says of it."""
    how = "planned" if planned else "local"
    if trouble.people:
        how += f", {trouble.people} people"
    if trouble.closes:
        how += ", lane closes"
    if trouble.delays:
        how += ", delays"
    return how


def _kept(found: Sequence[Throughput], alone: Mapping[str, TimeAlone]) -> float:
    """Return the share of its throughput that a fleet keeps, the mean of some runs."""
    return statistics.mean(share_kept(each, alone) for each in found)


def _figures(
    fleet: Fleet, found: Sequence[Throughput], alone: Mapping[str, TimeAlone]
) -> Iterator[tuple[str, float, float | None]]:
    """Yield a fleet's figures by name, with their aims."""
    yield "goals per hour and robot", statistics.mean(each.rate for each in found), None
    yield "loses", 1.0 - _kept(found, alone), fleet.loses
    yield "contacts", float(sum(each.contacts for each in found)), 0.0
    yield "wall contacts", float(sum(each.wall_contacts for each in found)), 0.0
    yield "person contacts", float(sum(each.person_contacts for each in found)), 0.0
    yield "given up", float(sum(each.given_up for each in found)), 0.0
    yield "longest stand", max(each.longest_stand for each in found), LONGEST_STAND
    yield "locks", float(sum(each.locks for each in found)), None
    yield "plan median", statistics.mean(1000.0 * each.plan_median for each in found), None
    yield "plan p95", statistics.mean(1000.0 * each.plan_p95 for each in found), None
    yield "cpu", statistics.mean(each.cpu for each in found), None


def _driven(
    fleet: Fleet,
    seed: int,
    seconds: float,
    planned: bool = False,
    trouble: Trouble | None = None,
) -> dict[str, Any]:
    site = SITES[fleet.site]()
    return dataclasses.asdict(
        measure(site, fleet.robots, seconds, fleet.models, seed, planned=planned, trouble=trouble)
    )


def _throughput(data: dict[str, Any]) -> Throughput:
    """Return what a fleet did from what was kept of it."""
    return Throughput(**{**data, "drives": tuple(Drive(*each) for each in data["drives"])})


def with_faults(runs: int, kept: KeptRuns) -> BenchResult:
    """Simulate runs in which the planner, messages and positions fail; `kept` as above."""
    done = kept.all_of({f"faults, seed {seed}": (_with_fault, (seed,)) for seed in range(runs)})
    touched = [seed for seed, each in enumerate(done) if each["contacts"]]
    for seed in touched:
        for contact in done[seed]["contacts"]:
            click.echo(f"seed {seed}: {contact}", err=True)
    figures = {
        "runs": float(runs),
        "contacts": float(sum(len(each["contacts"]) for each in done)),
        "first seed with a contact": float(min(touched, default=-1)),
        "goals per run": statistics.mean(each["goals"] for each in done),
        "longest stand": max(each["longest_stand"] for each in done),
    }
    return BenchResult(figures, {"contacts": 0.0}, bool(touched))


def _with_fault(seed: int) -> dict[str, Any]:
    done = fault_runs.run(seed)
    return {
        "contacts": done.contacts,
        "goals": done.goals,
        "longest_stand": done.longest_stand,
    }
