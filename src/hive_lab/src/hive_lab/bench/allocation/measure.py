# SPDX-License-Identifier: BSD-3-Clause
"""Compares the auction and the search with simple rules and with the best known plans.

Figures are ratios to the best known, except `p95` (to the search's plan for the shortest mean time
to done) and seconds, which are processor time.
"""

from __future__ import annotations

import time
from collections import defaultdict
from typing import TYPE_CHECKING

import click

from hive_lab.allocation.objectives import OBJECTIVES
from hive_lab.allocation.rules import RULES
from hive_lab.allocation.sequential import auction
from hive_lab.bench.allocation.instances import KINDS, SIZES, Floor, instances
from hive_lab.bench.allocation.plans import figures, mean_and_worst, searched
from hive_lab.bench.allocation.reference import OBJECTIVES as COMPARED
from hive_lab.bench.allocation.reference import read_best
from hive_lab.bench.allocation.streams import measure_streams
from hive_lab.bench.registry import BenchResult

if TYPE_CHECKING:
    from collections.abc import Mapping

    from hive_lab.allocation.instance import Instance
    from hive_lab.bench.allocation.instances import Size

_LATENCY = {"3x10": 1.005, "4x20": 1.01, "20x100": 1.03, "100x1000": 1.08}
_MAKESPAN = {"3x10": 1.02, "4x20": 1.04, "20x100": 1.08, "100x1000": 1.08}
_SECONDS = {"4x20": 0.2, "20x100": 1.0, "100x1000": 2.0}

_LESS_THAN_APPENDING = 0.75
"""Mean time to done over that of appending to the list with the earliest end."""

_SLACK = 0.05  # a round of the search is always finished: share allowed over the time limit


class Ratios:
    """The ratios of one size, collected over its instances."""

    def __init__(self, size: Size) -> None:
        self._size = size
        self._ratios: dict[str, list[float]] = defaultdict(list)
        self._appended: dict[str, list[float]] = defaultdict(list)
        self._seconds: list[float] = []

    def add(self, name: str, instance: Instance, best: Mapping[str, float]) -> None:
        """Measure everything on one instance."""
        made = {rule: figures(instance, give_out(instance)) for rule, give_out in RULES.items()}
        for objective in COMPARED:
            began = time.process_time()
            plan = auction(instance, OBJECTIVES[objective])
            made[f"auction {objective}"] = figures(instance, plan)
            left = self._size.seconds - (time.process_time() - began)
            plan = searched(instance, objective, plan, left)
            self._seconds.append(time.process_time() - began)
            made[f"search {objective}"] = figures(instance, plan)
        p95 = made["search latency"]["p95"]
        for way, found in made.items():
            for objective in COMPARED:
                self._ratios[f"{way}: {objective}"].append(found[objective] / best[objective])
            self._ratios[f"{way}: p95"].append(found["p95"] / p95)
        kind = next(kind for kind in KINDS if f"/{kind}/" in name)
        appended = made["search latency"]["latency"] / made["soonest"]["latency"]
        self._appended[kind].append(appended)

    def figures(self) -> dict[str, float]:
        """Return mean and worst of every ratio."""
        found: dict[str, float] = {f"{self._size.name} seconds": max(self._seconds)}
        for name, ratios in self._ratios.items():
            found |= mean_and_worst(f"{self._size.name} {name}", ratios)
        for kind, ratios in self._appended.items():
            name = f"{self._size.name} {kind} search latency over soonest"
            found |= mean_and_worst(name, ratios)
        return found

    def aims(self) -> dict[str, float]:
        """Return the aims of some of them."""
        size = self._size.name
        aims = {
            f"{size} search latency: latency mean": _LATENCY[size],
            f"{size} search makespan: makespan mean": _MAKESPAN[size],
        }
        for kind in KINDS:
            aims[f"{size} {kind} search latency over soonest mean"] = _LESS_THAN_APPENDING
        if size in _SECONDS:
            aims[f"{size} seconds"] = _SECONDS[size] * (1 + _SLACK)
        return aims


def run() -> BenchResult:
    """Measure instances and streams; takes some minutes, mostly for path lengths."""
    best = read_best()
    floor = Floor()
    found: dict[str, float] = {}
    aims: dict[str, float] = {}
    largest: Instance | None = None
    for size in SIZES:
        click.echo(f"measuring {size.name}", err=True)
        ratios = Ratios(size)
        for name, instance in instances(size, floor):
            ratios.add(name, instance, best[name])
            largest = instance if f"/{KINDS[0]}/" in name else largest
        found |= ratios.figures()
        aims |= ratios.aims()
    if largest is not None:
        click.echo("measuring streams", err=True)
        figures_of_streams, aims_of_streams = measure_streams(largest)
        found |= figures_of_streams
        aims |= aims_of_streams
    return BenchResult({name: round(value, 4) for name, value in found.items()}, aims)
