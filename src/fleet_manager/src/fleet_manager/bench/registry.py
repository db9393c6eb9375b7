# SPDX-License-Identifier: BSD-3-Clause
"""The benchmarks by name, and the form in which every one of them gives its figures."""

from __future__ import annotations

from dataclasses import dataclass
from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping

    from fleet_manager.cli.outside import Outside


@dataclass(frozen=True)
class BenchResult:
    """What a benchmark found.

    Attributes:
        figures: Every figure by name; the unit is in the benchmark's description.
        aims: What some of the figures should be at most, by the same names.
    """

    figures: Mapping[str, float]
    aims: Mapping[str, float]

    @property
    def met(self) -> dict[str, bool]:
        """Whether each aim is met."""
        return {name: self.figures[name] <= aim for name, aim in self.aims.items()}


@dataclass(frozen=True)
class Bench:
    """One benchmark.

    Attributes:
        line: What it measures, in a line, with units.
        run: Measures.
    """

    line: str
    run: Callable[[Outside], BenchResult]


def _system(outside: Outside) -> BenchResult:
    result: BenchResult = import_module("fleet_manager.bench.system").measure(outside.connect)
    return result


def _plan(_outside: Outside) -> BenchResult:
    found: dict[str, dict[str, float]] = import_module("robot_description.bench_plan").run()
    return BenchResult(found["figures"], found["aims"])


def _gui(_outside: Outside) -> BenchResult:
    found: dict[str, dict[str, float]] = import_module("fleet_manager.gui.bench").run()
    return BenchResult(found["figures"], found["aims"])


def _allocation(_outside: Outside) -> BenchResult:
    result: BenchResult = import_module("fleet_manager.bench.allocation.measure").measure()
    return result


BENCHES: Mapping[str, Bench] = {
    "allocation": Bench(
        "plans over the best known ones, and times to done [s] of tasks that arrive over time",
        _allocation,
    ),
    "gui": Bench(
        "longest stall [s] of the windows' event loop in each case, start [s], CPU, memory [MB]",
        _gui,
    ),
    "plan": Bench(
        "planning time [s] and length of the way over the shortest one, 200 pairs on each map",
        _plan,
    ),
    "system": Bench(
        "CPU [s per s] and memory [GB] of four robots that all drive, without RViz, in real time",
        _system,
    ),
}
"""Imported only when run, because they need what `hive bench` alone does not."""


def as_json(name: str, result: BenchResult, machine: str, date: str) -> dict[str, Any]:
    """Return a result in the form in which it is kept in files.

    Args:
        name: Of the benchmark.
        result: What it found.
        machine: On which machine, in words.
        date: When, ISO 8601.
    """
    return {
        "bench": name,
        "machine": machine,
        "date": date,
        "figures": dict(result.figures),
        "aims": dict(result.aims),
        "met": result.met,
    }
