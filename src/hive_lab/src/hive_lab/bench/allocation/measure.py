# SPDX-License-Identifier: BSD-3-Clause
"""Measures what hives make of tasks: bursts and streams, each decision, simple rules beside them.

Hives run on virtual time with the classes that run on robots; see `running`. How long a first plan
takes is measured on the wall; see `first_plan`. Figures of bursts are ratios to the best known:
the table's for the fixed instances, and for those drawn anew at each run what a long search finds.
"""

from __future__ import annotations

import random
from collections import defaultdict
from typing import TYPE_CHECKING

import click

from blackboard.costing.cost import measure_for
from blackboard.domain.settings import BlackboardSettings
from hive_lab.allocation.rules import RULES
from hive_lab.bench.allocation.first_plan import measure_first_plan
from hive_lab.bench.allocation.instances import KINDS, SIZES, Floor, Places, places
from hive_lab.bench.allocation.plans import figures, mean_and_worst
from hive_lab.bench.allocation.reference import best_of, read_best
from hive_lab.bench.allocation.running import run_hive
from hive_lab.bench.allocation.streams import measure_streams
from hive_lab.bench.registry import BenchResult

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping

    from hive_lab.allocation.instance import Instance
    from hive_lab.bench.allocation.instances import Size
    from hive_lab.bench.allocation.running import Run

_APART = 0.01
"""Time between two tasks of a burst that is not posted at once [s]."""

_WAYS = (
    ("distributed", "latency", 0.0),
    ("distributed", "makespan", 0.0),
    ("centralized", "latency", 0.0),
    ("planned", "latency", 0.0),
    ("planned", "latency", _APART),
    ("planned", "makespan", 0.0),
    ("planned", "energy", 0.0),
)
"""What is measured: decision, cost model, and time between two tasks [s]."""

_LATENCY = {"3x10": 1.01, "4x20": 1.02, "20x100": 1.02, "100x1000": 1.06}
_WORST = {"4x20": 1.06, "20x100": 1.06}
_MAKESPAN = {"4x20": 1.04, "20x100": 1.04}
_PLANNED = 2.0  # aim for 100 x 1,000 [s]

_ANEW = 2  # instances of each size that are drawn anew, up to 20 x 100
_LARGE = "100x1000"  # measured with one kind of task and one decision


class Ratios:
    """The ratios of one size, collected over its instances."""

    def __init__(self, size: Size) -> None:
        self._size = size
        self._ratios: dict[str, list[float]] = defaultdict(list)
        self._late_beats = 0
        self._processor: dict[str, float] = defaultdict(float)
        self._tasks: dict[str, int] = defaultdict(int)
        self._moves: dict[str, int] = defaultdict(int)
        self._returned: dict[str, int] = defaultdict(int)

    def add_rules(self, instance: Instance, best: Mapping[str, float]) -> None:
        """Measure what simple rules make of an instance."""
        for rule, give_out in RULES.items():
            self._add(rule, figures(instance, give_out(instance)), best)

    def add_run(self, way: str, run: Run, best: Mapping[str, float]) -> None:
        """Take in what a hive made of an instance."""
        measured = {
            "latency": float(run.done.mean()),
            "makespan": run.makespan,
            "energy": run.way,
        }
        self._add(way, measured, best)
        self._late_beats += run.late_beats
        self._processor[way] = max(self._processor[way], run.processor)
        self._tasks[way] += len(run.done)
        self._moves[way] += run.given - len(run.done)
        self._returned[way] += run.returned

    def _add(self, way: str, measured: Mapping[str, float], best: Mapping[str, float]) -> None:
        for name in ("latency", "makespan", "energy"):
            self._ratios[f"{way}: {name}"].append(measured[name] / best[name])

    def figures(self) -> dict[str, float]:
        """Return mean and worst of every ratio."""
        found: dict[str, float] = {f"{self._size.name} late heartbeats": self._late_beats}
        for way, seconds in self._processor.items():
            found[f"{self._size.name} {way}, processor time until assigned [s]"] = seconds
            share = 100 / self._tasks[way]
            found[f"{self._size.name} {way}, moves per 100 tasks"] = share * self._moves[way]
            found[f"{self._size.name} {way}, A-B-A per 100 tasks"] = share * self._returned[way]
        for name, ratios in self._ratios.items():
            found |= mean_and_worst(f"{self._size.name} {name}", ratios)
        return found

    def aims(self) -> dict[str, float]:
        """Return the aims of some of them."""
        size = self._size.name
        aims = {f"{size} late heartbeats": 0.0}
        for way in (_named("planned", "latency", apart) for apart in (0.0, _APART)):
            aims[f"{size} {way}: latency mean"] = _LATENCY[size]
            if size in _WORST:
                aims[f"{size} {way}: latency worst"] = _WORST[size]
        if size in _MAKESPAN:
            aims[f"{size} planned, makespan: makespan mean"] = _MAKESPAN[size]
        if size == _LARGE:
            del aims[f"{size} {_named('planned', 'latency', _APART)}: latency mean"]
            aims[f"{size} planned, latency, processor time until assigned [s]"] = _PLANNED
        return aims


def run() -> BenchResult:
    """Measure bursts and streams; takes a quarter of an hour."""
    floor = Floor()
    found: dict[str, float] = {}
    aims: dict[str, float] = {}
    largest: Places | None = None
    for size in SIZES:
        click.echo(f"measuring {size.name}", err=True)
        ratios = Ratios(size)
        for drawn, kind, best in _instances(size, floor):
            largest = drawn
            _measure(ratios, size, drawn, kind, best)
        found |= ratios.figures()
        aims |= ratios.aims()
    click.echo("measuring first plans", err=True)
    figures_of_plans, aims_of_plans = measure_first_plan(floor)
    found |= figures_of_plans
    aims |= aims_of_plans
    assert largest is not None  # noqa: S101  (there are sizes)
    click.echo("measuring streams", err=True)
    figures_of_streams, aims_of_streams = measure_streams(largest)
    found |= figures_of_streams
    aims |= aims_of_streams
    return BenchResult({name: round(value, 4) for name, value in found.items()}, aims)


def _instances(size: Size, floor: Floor) -> Iterator[tuple[Places, str, Mapping[str, float]]]:
    """Yield the fixed instances of a size, then some that are drawn anew, with the best known."""
    best = read_best()
    for name, drawn in places(size, floor):
        for kind in KINDS:
            yield drawn, kind, best[f"{size.name}/{kind}/{name}"]
    if size.name == _LARGE:
        return
    seed = random.SystemRandom().randrange(2**32)
    for number in range(_ANEW):
        click.echo(f"  drawn anew: {size.name}, seed {seed + number}", err=True)
        drawn = Places.draw(floor, size.robots, size.tasks, [seed + number])
        for kind in KINDS:
            instance = drawn.instance(kind)
            known = {
                each: best_of(instance, each)[1] for each in ("latency", "makespan", "energy")
            }
            yield drawn, kind, known


def _measure(
    ratios: Ratios, size: Size, drawn: Places, kind: str, best: Mapping[str, float]
) -> None:
    ratios.add_rules(drawn.instance(kind), best)
    large = size.name == _LARGE
    if large and kind != KINDS[0]:
        return
    for decision, cost_model, apart in _WAYS:
        if large and (decision, cost_model, apart) != ("planned", "latency", 0.0):
            continue
        settings = BlackboardSettings(decision=decision, improve_by=measure_for(cost_model))
        posted = [apart * number for number in range(size.tasks)]
        run = run_hive(drawn, kind, cost_model, settings, posted)
        ratios.add_run(_named(decision, cost_model, apart), run, best)


def _named(decision: str, cost_model: str, apart: float) -> str:
    return f"{decision}, {cost_model}{f', {1000 * apart:.0f} ms apart' if apart else ''}"
